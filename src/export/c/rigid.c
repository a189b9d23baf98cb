/* ---- Undeflected arm: T_i = Rx(alpha) Tx(a) Rz(theta + q) Tz(d) Ry(beta) [Chen2021, eq. 1] ---- */

/* Computes the frame that carries a target, arm base frame. */
static int arm_frame(const real *number, const flexcal_pose *pose, const terms *term, frame *out)
{
    frame behind[JOINTS + 1];
    int i;
    (void)pose;
    behind[0] = identity();
    for (i = 0; i < JOINTS; ++i) {
        const real *joint = number + N_JOINT + i * J_SIZE;
        const real q = term->coordinate[i];
        const real angle = joint[J_THETA] + (JOINT[i].kind == REVOLUTE ? q : R(0.0));
        frame f = behind[JOINT[i].parent + 1];
        advance_to_link(&f, joint, JOINT[i].is_placed);
        shift(&f, 0, joint[J_A]);
#if MOTIONS
        displace(&f, term->motion[i]);
#endif
        turn(&f, 0, 1, SIN(angle), COS(angle));
        shift(&f, 2, joint[J_D] + (JOINT[i].kind == PRISMATIC ? q : R(0.0)));
        turn(&f, 2, 0, joint[J_BETA_SIN], joint[J_BETA_COS]);
#if MOTIONS
        displace(&f, term->motion[i] + 6);
#endif
        behind[i + 1] = f;
    }
    *out = behind[TARGET_JOINT[pose->target] + 1];
    return FLEXCAL_OK;
}
