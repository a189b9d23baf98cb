
/* ---- Laws and effects ---- */

/* Terms of a pose: coordinates of joints, strains of beams, and displacements and rotations of all
   bases ([0]) and of readings by errors of the instrument ([1]). */
typedef struct {
    real coordinate[JOINTS];
    real shift[2][3];
    real turn[2][3];
#if BEAMS
    real strain[BEAMS][3];
#endif
} terms;

static void evaluate_terms(const real *number, const flexcal_pose *pose, terms *term)
{
    int k;
    (void)number;
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
