#include <math.h>
#include <stddef.h>

typedef flexcal_real real;
#define R(number) ((real)(number))

#ifdef FLEXCAL_FLOAT
#define SIN sinf
#define COS cosf
#define TAN tanf
#define TANH tanhf
#define EXP expf
#define EXPM1 expm1f
#define LOG logf
#define POW powf
#define SQRT sqrtf
#define FABS fabsf
#define ATAN2 atan2f
#define EPSILON R(1.2e-7)
#define TOLERANCE R(1e-5) /* relative change of the moments in equilibrium */
#define STEP R(3e-2)      /* of fourth-order differences by coordinates [rad] or [m] */
#define FINE_STEP R(3e-3) /* of differences by commands, which laws may follow in short waves */
#define REACHED R(1e-4)   /* misfit of a command that counts as reached [m] and [rad] */
#define SETTLED R(1e-5)   /* last step of a command [rad] or [m] */
#else
#define SIN sin
#define COS cos
#define TAN tan
#define TANH tanh
#define EXP exp
#define EXPM1 expm1
#define LOG log
#define POW pow
#define SQRT sqrt
#define FABS fabs
#define ATAN2 atan2
#define EPSILON R(2.3e-16)
#define TOLERANCE R(1e-13)
#define STEP R(1e-3)
#define FINE_STEP R(1e-5)
#define REACHED R(1e-6)
#define SETTLED R(1e-12)
#endif

#define JOINTS FLEXCAL_JOINTS

enum { REVOLUTE, PRISMATIC, FIXED };

/* Structure of a joint; indices are -1 where there is none. */
typedef struct {
    int kind;
    int parent;
    int leader; /* joint whose command it follows */
    int is_commanded;
    int is_placed;
    int beam;
    int is_flexible;
    int is_lateral;
    int is_slide;
    int has_spring;
    int first_body;
    int bodies;
} joint_info;
