/* ---- Vectors, frames and rotations (flexcal: src/spatial) ---- */

typedef struct { real x, y, z; } vec;
typedef struct { vec axis[3]; vec origin; } frame;

static vec vec_of(real x, real y, real z)
{
    vec v;
    v.x = x;
    v.y = y;
    v.z = z;
    return v;
}

/* Returns a + s b. */
static vec add(vec a, real s, vec b)
{
    return vec_of(a.x + s * b.x, a.y + s * b.y, a.z + s * b.z);
}

static real dot(vec a, vec b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static vec cross(vec a, vec b)
{
    return vec_of(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

static vec vec_at(const real *number)
{
    return vec_of(number[0], number[1], number[2]);
}

static frame identity(void)
{
    frame f;
    f.axis[0] = vec_of(R(1.0), R(0.0), R(0.0));
    f.axis[1] = vec_of(R(0.0), R(1.0), R(0.0));
    f.axis[2] = vec_of(R(0.0), R(0.0), R(1.0));
    f.origin = vec_of(R(0.0), R(0.0), R(0.0));
    return f;
}

/* Returns the reference coordinates of a vector, and of a point, given in a frame. */
static vec vector_in(const frame *f, vec v)
{
    return add(add(add(vec_of(R(0.0), R(0.0), R(0.0)), v.x, f->axis[0]), v.y, f->axis[1]), v.z, f->axis[2]);
}

static vec point_in(const frame *f, vec v)
{
    return add(f->origin, R(1.0), vector_in(f, v));
}

/* Rotates about the frame's axis that turns `first` into `second`. */
static void turn(frame *f, int first, int second, real sine, real cosine)
{
    const vec u = f->axis[first];
    const vec v = f->axis[second];
    f->axis[first] = add(vec_of(cosine * u.x, cosine * u.y, cosine * u.z), sine, v);
    f->axis[second] = add(vec_of(cosine * v.x, cosine * v.y, cosine * v.z), -sine, u);
}

static void shift(frame *f, int axis, real distance)
{
    f->origin = add(f->origin, distance, f->axis[axis]);
}

/* Returns the axes of exp([w]x), R = cos|w| I + A [w]x + B w w' with A = sin|w| / |w| and
   B = (1 - cos|w|) / |w|^2 (Rodrigues); a power series below 0.1 rad. */
static frame rotation(vec w)
{
    const real square = dot(w, w);
    real a, b;
    frame f = identity();
    if (square < R(0.01)) {
        a = R(1.0) + square * (R(-1.0) / R(6.0) + square * (R(1.0) / R(120.0)
            + square * (R(-1.0) / R(5040.0) + square / R(362880.0))));
        b = R(0.5) + square * (R(-1.0) / R(24.0) + square * (R(1.0) / R(720.0)
            + square * (R(-1.0) / R(40320.0) + square / R(3628800.0))));
    } else {
        const real angle = SQRT(square);
        a = SIN(angle) / angle;
        b = (R(1.0) - COS(angle)) / square;
    }
    f.axis[0] = vec_of(R(1.0) - b * (w.y * w.y + w.z * w.z), b * w.x * w.y + a * w.z, b * w.x * w.z - a * w.y);
    f.axis[1] = vec_of(b * w.x * w.y - a * w.z, R(1.0) - b * (w.x * w.x + w.z * w.z), b * w.y * w.z + a * w.x);
    f.axis[2] = vec_of(b * w.x * w.z + a * w.y, b * w.y * w.z - a * w.x, R(1.0) - b * (w.x * w.x + w.y * w.y));
    return f;
}

/* Returns `inner`, given in `outer`, in the reference frame. */
static frame compose(const frame *outer, const frame *inner)
{
    frame f;
    int k;
    for (k = 0; k < 3; ++k) {
        f.axis[k] = vector_in(outer, inner->axis[k]);
    }
    f.origin = point_in(outer, inner->origin);
    return f;
}

#if MOTIONS
/* Moves a frame by a small motion in its axes: translation, then rotation vector. */
static void displace(frame *f, const real *motion)
{
    frame by = rotation(vec_at(motion + 3));
    by.origin = vec_at(motion);
    *f = compose(f, &by);
}
#endif

/* Returns the rotation vector, in the reference frame, that rotates the axes of `from` into those
   of `to`: log(R2 R1'), at most half a turn [rad]. */
static vec rotation_between(const frame *from, const frame *to)
{
    vec sine = vec_of(R(0.0), R(0.0), R(0.0));
    real cosine = R(-1.0);
    real size, angle;
    int k;
    for (k = 0; k < 3; ++k) {
        sine = add(sine, R(0.5), cross(from->axis[k], to->axis[k]));
        cosine += dot(from->axis[k], to->axis[k]);
    }
    cosine *= R(0.5);
    size = SQRT(dot(sine, sine));
    angle = ATAN2(size, cosine);
    if (size < EPSILON && cosine < R(0.0)) {
        /* Half a turn: the direction is not determined by the sines; any command is far off. */
        return vec_of(angle, R(0.0), R(0.0));
    }
    return add(vec_of(R(0.0), R(0.0), R(0.0)), size > EPSILON ? angle / size : R(1.0), sine);
}

/* Returns the frame of twelve numbers: three axes and an origin [m]. */
static frame frame_at(const real *number)
{
    frame f;
    f.axis[0] = vec_at(number);
    f.axis[1] = vec_at(number + 3);
    f.axis[2] = vec_at(number + 6);
    f.origin = vec_at(number + 9);
    return f;
}

/* Moves a frame through placement and Rx(alpha) of a joint. */
static void advance_to_link(frame *f, const real *joint, int is_placed)
{
    if (is_placed) {
        f->origin = point_in(f, vec_at(joint + J_X));
        turn(f, 0, 1, joint[J_YAW_SIN], joint[J_YAW_COS]);
        turn(f, 2, 0, joint[J_PITCH_SIN], joint[J_PITCH_COS]);
        turn(f, 1, 2, joint[J_ROLL_SIN], joint[J_ROLL_COS]);
    }
    turn(f, 1, 2, joint[J_ALPHA_SIN], joint[J_ALPHA_COS]);
}
