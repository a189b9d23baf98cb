
#ifdef FLEXCAL_FLOAT
typedef float flexcal_real;
#else
typedef double flexcal_real;
#endif

/* Limits of all iterations, which bound the time of every call. */
#ifndef FLEXCAL_MAX_PASSES
#define FLEXCAL_MAX_PASSES 200 /* passes towards static equilibrium */
#endif
#ifndef FLEXCAL_STEPS
#define FLEXCAL_STEPS 100 /* Newton steps of a correction; most take 4 to 8, near singular poses more */
#endif

enum {
    FLEXCAL_OK = 0,
    FLEXCAL_NO_EQUILIBRIUM = 1, /* the deflection does not settle: the arm is too soft for its loads */
    FLEXCAL_BAD_INPUT = 2,      /* base or target is out of range */
    FLEXCAL_NOT_REACHED = 3     /* a correction ended away from its target: see the residual */
};

/* Commands and conditions of a pose; flexcal_default_pose fills in the declared ones. */
typedef struct {
    flexcal_real q[FLEXCAL_JOINTS];        /* commands [rad] or [m]; those of fixed and mimic joints are not used */
    flexcal_real payload_kg;
    flexcal_real hoist_N;                  /* used if has_hoist is not 0 */
    flexcal_real temperature_C;
    flexcal_real elapsed_s;                /* `t` in formulas: time since the first pose */
    flexcal_real time_s;                   /* `time` in formulas */
    flexcal_real approach[FLEXCAL_JOINTS]; /* -1, 0 or +1, used if has_approach is not 0 */
    flexcal_real covariate[FLEXCAL_COVARIATES + 1];
    int has_hoist;
    int has_approach;
    int base;                              /* session, counted from 0 */
    int target;                            /* tool, counted from 0 */
} flexcal_pose;

/* Frame in the measuring frame: axes x, y, z as unit vectors, and position [m]. */
typedef struct {
    flexcal_real axis[3][3];
    flexcal_real position_m[3];
} flexcal_frame;

/* Desired position [m] and, if has_axes is not 0, orientation of the target, measuring frame. */
typedef struct {
    flexcal_real position_m[3];
    flexcal_real axis[3][3];
    int has_axes;
} flexcal_target;

/* Distance and angle from the target that a correction leaves, by the model, and its last step: how
   far the command may be from the one nearest to the seed [rad] or [m]. */
typedef struct {
    flexcal_real position_m;
    flexcal_real angle_rad;
    flexcal_real last_step;
} flexcal_residual;

/* Fills in command 0 and the conditions that the problem declares. */
void flexcal_default_pose(flexcal_pose *pose);

/* Computes where the target is. Returns FLEXCAL_OK or a reason. */
int flexcal_forward(const flexcal_pose *pose, flexcal_frame *out);

/* Computes what the measuring instrument reads, with its errors: `flexcal predict`. */
int flexcal_reading(const flexcal_pose *pose, flexcal_frame *out);

/* Computes the command nearest to seed->q that brings the target to its goal: `flexcal compensate`. */
int flexcal_correct(const flexcal_pose *seed, const flexcal_target *goal, flexcal_real *command, flexcal_residual *left);

#endif
