/* ---- Remainder: errors of the joints as Gaussian processes (flexcal: src/remainder) ----
   shift = w (J delta + sum_s A_s e_s(q)); A_s is the slope of the reading by a command over its
   lever, e_s the mean of a Matern 5/2 process, J delta the change of the parameters beside it, and
   the share w falls from 1 to 0 where no measured pose is near. */

/* Returns the reading of the arm with some numbers; NaN without equilibrium. */
static vec reading_of(const real *number, const flexcal_pose *pose, const terms *term)
{
    frame f;
    if (placed(number, pose, term, 1, &f) != FLEXCAL_OK) {
        f.origin = vec_of((real)NAN, (real)NAN, (real)NAN);
    }
    return f.origin;
}

/* Returns the slope of the reading by a command; strains and turns of the base keep their values. */
static vec command_slope(const flexcal_pose *pose, const terms *here, int joint)
{
    vec at[2];
    int side, k;
    for (side = 0; side < 2; ++side) {
        flexcal_pose moved = *pose;
        terms term;
        moved.q[joint] += side == 0 ? FINE_STEP : -FINE_STEP;
        evaluate_terms(NUMBER, &moved, &term);
        for (k = 0; k < 2 * 3; ++k) {
            term.turn[k / 3][k % 3] = here->turn[k / 3][k % 3];
        }
#if BEAMS
        for (k = 0; k < BEAMS * 3; ++k) {
            term.strain[k / 3][k % 3] = here->strain[k / 3][k % 3];
        }
#endif
        at[side] = reading_of(NUMBER, pose, &term);
    }
    at[0] = add(at[0], R(-1.0), at[1]);
    return add(vec_of(R(0.0), R(0.0), R(0.0)), R(0.5) / FINE_STEP, at[0]);
}

/* Returns the slope of the reading by an additional compliance of a joint; h [rad/(N m)] moves it by
   about 10 um. */
static vec compliance_slope(const flexcal_pose *pose, const terms *here, int joint, real h)
{
    vec at[2];
    int side, k;
    for (side = 0; side < 2; ++side) {
        real number[NUMBERS];
        for (k = 0; k < NUMBERS; ++k) {
            number[k] = NUMBER[k];
        }
        number[N_JOINT + joint * J_SIZE + J_FLEXIBILITY] += side == 0 ? h : -h;
        at[side] = reading_of(number, pose, here);
    }
    at[0] = add(at[0], R(-1.0), at[1]);
    return add(vec_of(R(0.0), R(0.0), R(0.0)), R(0.5) / h, at[0]);
}

/* Returns the derivative of the reading along a direction of the parameters: listed numbers take
   their values at +h and -h. */
static vec parameter_slope(const flexcal_pose *pose, int first, int count, real h)
{
    vec at[2];
    int side, k;
    for (side = 0; side < 2; ++side) {
        real number[NUMBERS];
        terms term;
        for (k = 0; k < NUMBERS; ++k) {
            number[k] = NUMBER[k];
        }
        for (k = first; k < first + count; ++k) {
            number[CHANGED[k]] = CHANGE[k][side];
        }
        evaluate_terms(number, pose, &term);
        at[side] = reading_of(number, pose, &term);
    }
    at[0] = add(at[0], R(-1.0), at[1]);
    return add(vec_of(R(0.0), R(0.0), R(0.0)), R(0.5) / h, at[0]);
}

/* Returns the Matern 5/2 correlation at a squared distance [Rasmussen & Williams 2006, eq. 4.17]. */
static real matern(real square)
{
    const real scaled = SQRT(R(5.0) * square);
    return (R(1.0) + scaled + R(5.0) / R(3.0) * square) * EXP(-scaled);
}

/* Returns an input of a pose; a hoist force that is not stated counts as the mean of those fitted. */
static real input_of(const flexcal_pose *pose, const input_info *input)
{
    if (input->source >= 0) {
        return pose->q[input->source];
    }
    if (input->source == HOIST) {
        return pose->has_hoist ? pose->hoist_N : input->offset;
    }
    return input->source == TEMPERATURE ? pose->temperature_C : pose->payload_kg;
}

static real squared_distance(int is_angle, real difference)
{
    const real chord = R(2.0) * SIN(R(0.5) * difference);
    return is_angle ? chord * chord : difference * difference;
}

/* Adds a weighted feature, its column in the measuring frame, to the mean. */
static void enter(real feature[3][FEATURES], int at, vec column, real weight, vec *mean)
{
    feature[0][at] = column.x;
    feature[1][at] = column.y;
    feature[2][at] = column.z;
    *mean = add(*mean, weight, column);
}

/* Computes the shift of the reading by the remainder, measuring frame [m]. */
static int remainder_shift(const flexcal_pose *pose, vec *out)
{
    const vec zero = vec_of(R(0.0), R(0.0), R(0.0));
    vec slope[SITES];
    real value[INPUTS], square[INPUTS];
    real feature[3][FEATURES];
    real prior = R(0.0), explained = R(0.0), share;
    const real *row = EXPLAINED;
    vec mean;
    terms here;
    int s, c, b, k, i, axis;
    evaluate_terms(NUMBER, pose, &here);
    for (s = 0; s < SITES; ++s) {
        slope[s] = SITE[s].is_compliance ? compliance_slope(pose, &here, SITE[s].joint, R(1e-5) / SITE[s].lever)
                                         : command_slope(pose, &here, SITE[s].joint);
        slope[s] = add(zero, R(1.0) / SITE[s].lever, slope[s]);
        prior += (SITE[s].single + SITE[s].all + SITE[s].constant) * dot(slope[s], slope[s]);
    }
    for (i = 0; i < INPUTS; ++i) {
        value[i] = (input_of(pose, &INPUT[i]) - INPUT[i].offset) / INPUT[i].unit;
    }
    /* Richardson's combination of two central differences: exact to the fourth order. */
    mean = parameter_slope(pose, DELTA_FIRST[1], DELTA_FIRST[2] - DELTA_FIRST[1], DELTA_STEP);
    mean = add(mean, R(1.0) / R(3.0), add(mean, R(-1.0),
        parameter_slope(pose, DELTA_FIRST[0], DELTA_FIRST[1] - DELTA_FIRST[0], R(2.0) * DELTA_STEP)));
    for (c = 0; c < CENTRES; ++c) {
        real covariance[SITES];
        real sum = R(0.0), all;
        for (i = 0; i < INPUTS; ++i) {
            square[i] = squared_distance(INPUT[i].is_angle, value[i] - CENTRE[c][i]);
            sum += square[i] * INPUT[i].scale;
        }
        all = matern(sum);
        for (s = 0; s < SITES; ++s) {
            covariance[s] = SITE[s].all * all + SITE[s].constant;
            if (SITE[s].input >= 0) {
                covariance[s] += SITE[s].single * matern(square[SITE[s].input] * SITE[s].scale);
            }
        }
        for (b = 0; b < 3; ++b) {
            vec column = zero;
            for (s = 0; s < SITES; ++s) {
                column = add(column, CENTRE_SLOPE[c][b * SITES + s] * covariance[s], slope[s]);
            }
            enter(feature, 3 * c + b, column, WEIGHT[3 * c + b], &mean);
        }
    }
    for (k = 0; k < KNOTS; ++k) {
        const site_info *site = &SITE[KNOT[k].site];
        const real distance = squared_distance(INPUT[site->input].is_angle, value[site->input] - KNOT[k].at);
        const vec column = add(zero, site->single * matern(distance * site->scale), slope[KNOT[k].site]);
        enter(feature, 3 * CENTRES + k, column, WEIGHT[3 * CENTRES + k], &mean);
    }
    for (k = 0; k < PARAMETERS; ++k) {
        const vec column = parameter_slope(pose, PARAMETER_FIRST[k], PARAMETER_FIRST[k + 1] - PARAMETER_FIRST[k], PARAMETER_STEP);
        enter(feature, 3 * CENTRES + KNOTS + k, column, R(0.0), &mean);
    }
    for (i = 0; i < FEATURES; ++i) {
        for (axis = 0; axis < 3; ++axis) {
            real sum = R(0.5) * row[i] * feature[axis][i];
            for (k = 0; k < i; ++k) {
                sum += row[k] * feature[axis][k];
            }
            explained += R(2.0) * feature[axis][i] * sum;
        }
        row += i + 1;
    }
    share = prior > R(0.0) ? explained / prior : R(0.0);
    share = share < R(0.0) ? R(0.0) : (share > R(1.0) ? R(1.0) : share);
    *out = add(zero, share, mean);
    return mean.x == mean.x ? FLEXCAL_OK : FLEXCAL_NO_EQUILIBRIUM;
}
