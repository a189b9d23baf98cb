
/* ---- Laws and effects ---- */

/* Terms of a pose: coordinates of joints, strains of beams, displacements and rotations of all bases
   ([0]) and of readings by errors of the instrument ([1]), and displacement along the line of sight.
   A motion holds x, y, z and a rotation vector, before the joint turns and behind it. */
typedef struct {
    real coordinate[JOINTS];
    real shift[2][3];
    real turn[2][3];
    real range;
#if MOTIONS
    real motion[JOINTS][12];
#endif
#if BEAMS
    real strain[BEAMS][3];
#endif
} terms;

static void evaluate_terms(const real *number, const flexcal_pose *pose, terms *term)
{
    int k;
    (void)number;
    term->range = R(0.0);
#if MOTIONS
    for (k = 0; k < JOINTS * 12; ++k) {
        term->motion[k / 12][k % 12] = R(0.0);
    }
#endif
    for (k = 0; k < 6; ++k) {
        term->shift[k / 3][k % 3] = R(0.0);
        term->turn[k / 3][k % 3] = R(0.0);
    }
#if BEAMS
    for (k = 0; k < BEAMS * 3; ++k) {
        term->strain[k / 3][k % 3] = R(0.0);
    }
#endif
    for (k = 0; k < JOINTS; ++k) {
        term->coordinate[k] = pose->q[k];
    }
