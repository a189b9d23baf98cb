
/* ---- Tables of the remainder ---- */

/* Sources of inputs that are no commands. */
enum { TEMPERATURE = -1, PAYLOAD_MASS = -2, HOIST = -3 };

/* Site that errs: the coordinate or compliance of a joint, the input that is its own command, lever
   [m/rad], [1] or [N m^2/rad], variances of the errors that follow its own command, all inputs and
   none [m^2], and 1/length^2 of the first. */
typedef struct {
    int joint, is_compliance, input;
    real lever, single, all, constant, scale;
} site_info;

/* Input: joint of the command, or source; offset, unit, and 1/length^2 of errors that follow all inputs. */
typedef struct {
    int source, is_angle;
    real offset, unit, scale;
} input_info;

/* Knot of an error that follows one input. */
typedef struct {
    int site;
    real at;
} knot_info;

