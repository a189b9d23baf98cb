
/* Columns of a row: base, target, payload, hoist, has_hoist, temperature, elapsed, time,
   has_approach; commands; directions of approach; covariates; reading; axes; goal, has_axes, axes;
   is_reached; command of `flexcal compensate`. */

#ifdef FLEXCAL_FLOAT
#define MAX_POSITION 2e-4
#define MAX_AXIS 2e-4
#define MAX_COMMAND 1.0 /* near singular poses a command is not determined in float; it reaches its target */
#define MAX_LAST_STEP 1e30 /* and rounding may end the steps: what counts is that the target is reached */
#else
#define MAX_POSITION 1e-9
#define MAX_AXIS 1e-9
#define MAX_COMMAND 1e-9
#define MAX_LAST_STEP 1e-11
#endif

enum {
    READING = 9 + 2 * FLEXCAL_JOINTS + FLEXCAL_COVARIATES,
    GOAL = READING + 12,
    IS_REACHED = 13, /* after GOAL: 1, 0, or -1 without a command */
    COMMAND = 14
};

static void read_pose(const double *number, flexcal_pose *pose)
{
    int k;
    flexcal_default_pose(pose);
    pose->base = (int)number[0];
    pose->target = (int)number[1];
    pose->payload_kg = (flexcal_real)number[2];
    pose->hoist_N = (flexcal_real)number[3];
    pose->has_hoist = number[4] > 0.0;
    pose->temperature_C = (flexcal_real)number[5];
    pose->elapsed_s = (flexcal_real)number[6];
    pose->time_s = (flexcal_real)number[7];
    pose->has_approach = number[8] > 0.0;
    for (k = 0; k < FLEXCAL_JOINTS; ++k) {
        pose->q[k] = (flexcal_real)number[9 + k];
        pose->approach[k] = (flexcal_real)number[9 + FLEXCAL_JOINTS + k];
    }
    for (k = 0; k < FLEXCAL_COVARIATES; ++k) {
        pose->covariate[k] = (flexcal_real)number[9 + 2 * FLEXCAL_JOINTS + k];
    }
}

/* One command of so many may not settle within FLEXCAL_STEPS. */
#define MAX_UNSETTLED 10

static double larger(double a, double b)
{
    const double size = b < 0.0 ? -b : b;
    return size > a || b != b ? size : a;
}

int main(void)
{
    double position = 0.0, axis = 0.0, command = 0.0, forward_us, correct_us;
    int row, k, compared = 0, unsettled = 0, failed = 0, corrected = 0;
    clock_t start = clock();
    for (row = 0; row < ROWS; ++row) {
        const double *number = ROW[row];
        flexcal_pose pose;
        flexcal_frame found;
        read_pose(number, &pose);
        failed += flexcal_reading(&pose, &found) != FLEXCAL_OK;
        for (k = 0; k < 3; ++k) {
            position = larger(position, (double)found.position_m[k] - number[READING + k]);
        }
        for (k = 0; k < 9; ++k) {
            axis = larger(axis, (double)found.axis[k / 3][k % 3] - number[READING + 3 + k]);
        }
    }
    forward_us = 1e6 * (double)(clock() - start) / CLOCKS_PER_SEC / ROWS;
    start = clock();
    for (row = 0; row < ROWS; ++row) {
        const double *number = ROW[row] + GOAL;
        flexcal_pose pose;
        flexcal_target goal;
        flexcal_residual left;
        flexcal_real q[FLEXCAL_JOINTS];
        int status;
        if (number[IS_REACHED] < 0.0) {
            continue;
        }
        read_pose(ROW[row], &pose);
        for (k = 0; k < 3; ++k) {
            goal.position_m[k] = (flexcal_real)number[k];
        }
        goal.has_axes = number[3] > 0.0;
        for (k = 0; k < 9; ++k) {
            goal.axis[k / 3][k % 3] = (flexcal_real)number[4 + k];
        }
        status = flexcal_correct(&pose, &goal, q, &left);
        corrected += 1;
        if (number[IS_REACHED] > 0.0) {
            double differs = 0.0;
            for (k = 0; k < FLEXCAL_JOINTS; ++k) {
                differs = larger(differs, (double)q[k] - number[COMMAND + k]);
            }
            if (status == FLEXCAL_NOT_REACHED
                || (left.last_step > (flexcal_real)MAX_LAST_STEP && differs > MAX_COMMAND)) {
                /* Near a singular pose it is still on its way to the target or to the nearest command. */
                unsettled += 1;
                continue;
            }
            failed += status != FLEXCAL_OK;
            compared += 1;
            command = larger(command, differs);
        }
    }
    correct_us = 1e6 * (double)(clock() - start) / CLOCKS_PER_SEC / (corrected > 0 ? corrected : 1);
    (void)printf("%d poses: positions within %.1e m, axes within %.1e, %.2f us a pose\n", ROWS, position, axis, forward_us);
    (void)printf("%d commands: within %.1e rad or m, %.1f us a command; %d near singular poses take more steps, %d targets are not compared (out of reach)\n",
        compared, command, correct_us, unsettled, ROWS - compared - unsettled);
    if (failed > 0 || !(position <= MAX_POSITION) || !(axis <= MAX_AXIS) || !(command <= MAX_COMMAND)
        || unsettled > (compared + unsettled) / MAX_UNSETTLED) {
        (void)printf("FAILED: %d without an answer (allowed: 0), %d of %d commands near singular poses (allowed: every %dth), "
            "or further off than %.0e m, %.0e rad\n",
            failed, unsettled, compared + unsettled, MAX_UNSETTLED, MAX_POSITION, MAX_COMMAND);
        return 1;
    }
    return 0;
}
