/* ---- Interface ---- */

static int is_valid(const flexcal_pose *pose)
{
    return pose->base >= 0 && pose->base < FLEXCAL_BASES && pose->target >= 0 && pose->target < FLEXCAL_TARGETS;
}

static void write_frame(const frame *f, flexcal_frame *out)
{
    int k;
    for (k = 0; k < 3; ++k) {
        out->axis[k][0] = f->axis[k].x;
        out->axis[k][1] = f->axis[k].y;
        out->axis[k][2] = f->axis[k].z;
    }
    out->position_m[0] = f->origin.x;
    out->position_m[1] = f->origin.y;
    out->position_m[2] = f->origin.z;
}

static int predict(const flexcal_pose *pose, int with_errors, flexcal_frame *out)
{
    terms term;
    frame f;
    int status;
    if (!is_valid(pose)) {
        return FLEXCAL_BAD_INPUT;
    }
    evaluate_terms(NUMBER, pose, &term);
    status = placed(NUMBER, pose, &term, with_errors, &f);
#if REMAINDER
    if (status == FLEXCAL_OK) {
        vec by;
        status = remainder_shift(pose, &by);
        f.origin = add(f.origin, R(1.0), by);
    }
#endif
    if (status == FLEXCAL_OK) {
        write_frame(&f, out);
    }
    return status;
}

void flexcal_default_pose(flexcal_pose *pose)
{
    int k;
    for (k = 0; k < JOINTS; ++k) {
        pose->q[k] = R(0.0);
        pose->approach[k] = R(0.0);
    }
    for (k = 0; k < FLEXCAL_COVARIATES + 1; ++k) {
        pose->covariate[k] = R(0.0);
    }
    pose->base = 0;
    pose->target = 0;
    pose->payload_kg = PAYLOAD;
    pose->hoist_N = HOIST_FORCE;
    pose->has_hoist = 0;
    pose->has_approach = HAS_APPROACH;
    pose->temperature_C = REFERENCE;
    pose->elapsed_s = R(0.0);
    pose->time_s = R(0.0);
}

int flexcal_forward(const flexcal_pose *pose, flexcal_frame *out)
{
    return predict(pose, 0, out);
}

int flexcal_reading(const flexcal_pose *pose, flexcal_frame *out)
{
    return predict(pose, 1, out);
}

/* ---- Inverse correction (flexcal: src/fit/apply/compensate.rs) ----
   Minimises |goal - predicted(q)|^2 / (1 um)^2 + |log(goal predicted(q)')|^2 / (1 urad)^2
   + |q - seed|^2 within the limits of the joints. With slopes J, misfit r and z = seed - q a step is
   d = z + J' l, (J J' + 1e-12) l = r - J z, over the joints that no limit holds; a step that does
   not help is damped (Levenberg-Marquardt). */

#define WEIGHT_SQUARED R(1e-12)
#define MIN_DAMPING R(0.3) /* damping after the first step that does not help [1/rad^2] */
#define MAX_DAMPING R(1e20)

/* Solves A x = b for a symmetric positive definite matrix of m rows, in place (Cholesky). */
static void solve(real a[6][6], real *b, int m)
{
    int i, j, k;
    for (i = 0; i < m; ++i) {
        for (j = 0; j <= i; ++j) {
            real sum = a[i][j];
            for (k = 0; k < j; ++k) {
                sum -= a[i][k] * a[j][k];
            }
            if (i == j) {
                a[i][i] = SQRT(sum > WEIGHT_SQUARED * EPSILON ? sum : WEIGHT_SQUARED * EPSILON);
            } else {
                a[i][j] = sum / a[j][j];
            }
        }
    }
    for (i = 0; i < m; ++i) {
        for (k = 0; k < i; ++k) {
            b[i] -= a[i][k] * b[k];
        }
        b[i] /= a[i][i];
    }
    for (i = m - 1; i >= 0; --i) {
        for (k = i + 1; k < m; ++k) {
            b[i] -= a[k][i] * b[k];
        }
        b[i] /= a[i][i];
    }
}

/* Computes the slopes of position and orientation by the coordinate of a joint, and of those that
   follow it, as fourth-order differences. */
static int slopes_by(const flexcal_pose *pose, const terms *term, int joint, real slopes[6][JOINTS])
{
    frame at[4];
    vec d[2][2];
    int k, side;
    for (side = 0; side < 4; ++side) {
        const real step = STEP * R(side < 2 ? 1 : 2) * R(side % 2 == 0 ? -1 : 1);
        terms moved = *term;
        int status;
        for (k = 0; k < JOINTS; ++k) {
            if (k == joint) {
                moved.coordinate[k] += step;
            } else if (JOINT[k].leader == joint) {
                moved.coordinate[k] += RATIO[k] * step;
            }
        }
        status = placed(NUMBER, pose, &moved, 0, &at[side]);
        if (status != FLEXCAL_OK) {
            return status;
        }
    }
    for (k = 0; k < 2; ++k) {
        d[k][0] = add(at[2 * k + 1].origin, R(-1.0), at[2 * k].origin);
        d[k][1] = rotation_between(&at[2 * k], &at[2 * k + 1]);
    }
    for (k = 0; k < 2; ++k) {
        /* (8 (f(h) - f(-h)) - (f(2 h) - f(-2 h))) / 12 h */
        const vec slope = add(d[1][k], R(-8.0), d[0][k]);
        slopes[3 * k][joint] = slope.x / (R(-12.0) * STEP);
        slopes[3 * k + 1][joint] = slope.y / (R(-12.0) * STEP);
        slopes[3 * k + 2][joint] = slope.z / (R(-12.0) * STEP);
    }
    return FLEXCAL_OK;
}

/* Computes misfit and, if wanted, slopes by the coordinates of commanded joints. */
static int misfit(const flexcal_pose *pose, const flexcal_target *goal, int with_slopes, const int *serves,
    real *r, real slopes[6][JOINTS])
{
    terms term;
    frame here, wanted = identity();
    int status, k, j;
    vec miss;
    evaluate_terms(NUMBER, pose, &term);
    status = placed(NUMBER, pose, &term, 0, &here);
    miss = add(vec_at(goal->position_m), R(-1.0), here.origin);
#if REMAINDER
    if (status == FLEXCAL_OK) {
        vec by;
        status = remainder_shift(pose, &by);
        miss = add(miss, R(-1.0), by);
    }
#endif
    if (status != FLEXCAL_OK) {
        return status;
    }
    r[0] = miss.x;
    r[1] = miss.y;
    r[2] = miss.z;
    if (goal->has_axes) {
        for (k = 0; k < 3; ++k) {
            wanted.axis[k] = vec_at(goal->axis[k]);
        }
        miss = rotation_between(&here, &wanted);
        r[3] = miss.x;
        r[4] = miss.y;
        r[5] = miss.z;
    }
    for (j = 0; j < JOINTS && with_slopes; ++j) {
        status = serves[j] ? slopes_by(pose, &term, j, slopes) : FLEXCAL_OK;
        if (status != FLEXCAL_OK) {
            return status;
        }
    }
    return FLEXCAL_OK;
}

/* Marks the joints whose command moves a target. */
static void find_serving(int target, int *serves)
{
    int k, at = TARGET_JOINT[target];
    for (k = 0; k < JOINTS; ++k) {
        serves[k] = 0;
    }
    for (k = 0; k < JOINTS && at >= 0; ++k) {
        const int driver = JOINT[at].leader >= 0 ? JOINT[at].leader : at;
        serves[driver] = JOINT[driver].is_commanded;
        at = JOINT[at].parent;
    }
}

/* Computes a step within the limits, an active-set method of at most 2 n passes; the damping adds
   damping |d|^2 to what is minimised. */
static void bounded_step(const real *q, const real *seed, const int *serves, const real *r, real slopes[6][JOINTS],
    int m, real damping, real *d)
{
    const real stiff = R(1.0) + damping;
    int held[JOINTS];
    int pass_number, i, j, k;
    for (j = 0; j < JOINTS; ++j) {
        held[j] = !serves[j];
        d[j] = R(0.0);
    }
    for (pass_number = 0; pass_number < 2 * JOINTS + 1; ++pass_number) {
        real a[6][6], l[6];
        real worst = R(0.0);
        int which = -1;
        for (i = 0; i < m; ++i) {
            l[i] = r[i];
            for (k = 0; k < m; ++k) {
                a[i][k] = i == k ? WEIGHT_SQUARED * stiff : R(0.0);
            }
        }
        for (j = 0; j < JOINTS; ++j) {
            const real taken = held[j] ? d[j] : (seed[j] - q[j]) / stiff;
            for (i = 0; i < m && serves[j]; ++i) {
                l[i] -= slopes[i][j] * taken;
                for (k = 0; k < m && !held[j]; ++k) {
                    a[i][k] += slopes[i][j] * slopes[k][j];
                }
            }
        }
        solve(a, l, m);
        for (j = 0; j < JOINTS; ++j) {
            real along = (seed[j] - q[j]) / stiff;
            real beyond;
            if (!serves[j]) {
                continue;
            }
            for (i = 0; i < m; ++i) {
                along += slopes[i][j] * l[i];
            }
            if (held[j]) {
                /* Without the limit the joint would move by `along`: inwards it is released. */
                beyond = d[j] <= LIMIT[j][0] - q[j] ? along - d[j] : d[j] - along;
            } else {
                d[j] = along;
                beyond = along < LIMIT[j][0] - q[j] ? LIMIT[j][0] - q[j] - along : along - (LIMIT[j][1] - q[j]);
            }
            if (beyond > R(10.0) * EPSILON && beyond > worst) {
                worst = beyond;
                which = j;
            }
        }
        if (which < 0) {
            break;
        }
        held[which] = !held[which];
        if (held[which]) {
            d[which] = d[which] < LIMIT[which][0] - q[which] ? LIMIT[which][0] - q[which] : LIMIT[which][1] - q[which];
        }
    }
}

/* Returns what a correction minimises, times the squared weight. */
static real cost(const real *r, const real *q, const real *seed)
{
    real sum = R(0.0), away = R(0.0);
    int k;
    for (k = 0; k < 6; ++k) {
        sum += r[k] * r[k];
    }
    for (k = 0; k < JOINTS; ++k) {
        away += (q[k] - seed[k]) * (q[k] - seed[k]);
    }
    return sum + WEIGHT_SQUARED * away;
}

int flexcal_correct(const flexcal_pose *seed, const flexcal_target *goal, real *command, flexcal_residual *left)
{
    flexcal_pose pose = *seed;
    int serves[JOINTS];
    real r[6] = {R(0.0), R(0.0), R(0.0), R(0.0), R(0.0), R(0.0)};
    real slopes[6][JOINTS];
    real d[JOINTS];
    real damping = R(0.0), longest = R(1.0);
    const int m = goal->has_axes ? 6 : 3;
    int step, j, k, status;
    if (!is_valid(seed)) {
        return FLEXCAL_BAD_INPUT;
    }
    for (j = 0; j < JOINTS; ++j) {
        for (k = 0; k < 6; ++k) {
            slopes[k][j] = R(0.0);
        }
    }
    find_serving(seed->target, serves);
    status = misfit(&pose, goal, 1, serves, r, slopes);
    for (step = 0; step < FLEXCAL_STEPS && status == FLEXCAL_OK && longest > SETTLED && damping < MAX_DAMPING; ++step) {
        flexcal_pose next = pose;
        real tried[6] = {R(0.0), R(0.0), R(0.0), R(0.0), R(0.0), R(0.0)};
        bounded_step(pose.q, seed->q, serves, r, slopes, m, damping, d);
        longest = R(0.0);
        for (j = 0; j < JOINTS; ++j) {
            if (serves[j]) {
                const real q = pose.q[j] + d[j];
                next.q[j] = q < LIMIT[j][0] ? LIMIT[j][0] : (q > LIMIT[j][1] ? LIMIT[j][1] : q);
                longest = FABS(d[j]) * (R(1.0) + damping) > longest ? FABS(d[j]) * (R(1.0) + damping) : longest;
            }
        }
        status = misfit(&next, goal, 0, serves, tried, slopes);
        if (status == FLEXCAL_OK && cost(tried, next.q, seed->q) <= (R(1.0) + R(1e4) * EPSILON) * cost(r, pose.q, seed->q)) {
            pose = next;
            damping = damping > MIN_DAMPING ? R(0.03) * damping : R(0.0);
            status = misfit(&pose, goal, 1, serves, r, slopes);
        } else {
            /* Also where the arm has no equilibrium: nearer to the last command. */
            damping = damping > R(0.0) ? R(30.0) * damping : MIN_DAMPING;
            longest = R(1.0);
            status = FLEXCAL_OK;
        }
    }
    for (j = 0; j < JOINTS; ++j) {
        command[j] = pose.q[j];
    }
    left->position_m = SQRT(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    left->last_step = longest;
    left->angle_rad = SQRT(r[3] * r[3] + r[4] * r[4] + r[5] * r[5]);
    if (status == FLEXCAL_OK && !(left->position_m <= REACHED && left->angle_rad <= REACHED)) {
        status = FLEXCAL_NOT_REACHED;
    }
    return status;
}
