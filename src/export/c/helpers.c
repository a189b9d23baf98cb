static real sign_of(real x)
{
    return x > R(0.0) ? R(1.0) : (x < R(0.0) ? R(-1.0) : x);
}

static real step_of(real x)
{
    return x >= R(0.0) ? R(1.0) : R(0.0);
}

/* Uniform cubic B-spline over the intervals 0 to 4. */
static real spline_of(real u)
{
    const real v = u > R(2.0) ? R(4.0) - u : u;
    const real w = R(2.0) - v;
    if (v <= R(0.0)) {
        return R(0.0);
    }
    return v <= R(1.0) ? v * v * v / R(6.0) : (R(3.0) * w * w * w - R(6.0) * w * w + R(4.0)) / R(6.0);
}

static real smaller_of(real a, real b)
{
    return b < a || b != b ? b : a;
}

static real larger_of(real a, real b)
{
    return b > a || b != b ? b : a;
}

