/* ---- Prediction: base, target and instrument (flexcal: src/model/predictor.rs, instrument.rs) ---- */

/* Computes the frame of the target in the measuring frame; with errors of the instrument its origin
   is the reading. */
static int placed(const real *number, const flexcal_pose *pose, const terms *term, int with_errors, frame *out)
{
    const frame target = frame_at(number + N_TARGET + pose->target * F_SIZE);
    frame base = frame_at(number + N_BASE + pose->base * F_SIZE);
    frame arm;
    const int status = arm_frame(number, pose, term, &arm);
    vec p, sight, by = vec_at(term->turn[0]);
    real distance;
    if (status != FLEXCAL_OK) {
        return status;
    }
    if (with_errors) {
        by = add(by, R(1.0), vec_at(term->turn[1]));
    }
    if (dot(by, by) > R(0.0)) {
        const frame turned = rotation(by);
        base = compose(&turned, &base);
    }
    arm = compose(&arm, &target);
    *out = compose(&base, &arm);
    p = out->origin;
    if (with_errors) {
        const real *e = number + N_INSTRUMENT;
        distance = SQRT(dot(p, p));
        sight = distance > R(0.0) ? add(vec_of(R(0.0), R(0.0), R(0.0)), R(1.0) / distance, p) : p;
        p = vec_of(p.x * (R(1.0) + e[0] + e[1]) + e[4] * p.y + e[5] * p.z,
            p.y * (R(1.0) + e[0] + e[2]) + e[6] * p.z, p.z * (R(1.0) + e[0] + e[3]));
        p = add(add(p, R(1.0), vec_at(term->shift[1])), term->range, sight);
    }
    out->origin = add(p, R(1.0), vec_at(term->shift[0]));
    return FLEXCAL_OK;
}
