/* ---- Arm in static equilibrium (flexcal: src/mechanics) ----
   The unknowns are the moments at the sections that deflect. A pass from the base outwards with
   given moments places every load, and the loads give new moments; their fixed point is the
   equilibrium on the deflected arm. */

enum { RIGID, BENT, FIRST_ORDER };
enum { LOAD, TIP, AXIS, TILT, BEGIN, END };

/* Event of a pass: a load, a section whose moments are unknown, or an end of a joint. */
typedef struct {
    int kind;
    int index;      /* first unknown of a section, or joint */
    vec at;         /* [m] */
    vec force;      /* of a load [N]; axis of a section */
    vec second;     /* second axis of a tilt */
    real pull;      /* moment of a spring about the axis [N m] */
} event;

typedef struct {
    real moment[UNKNOWNS];
    real next[UNKNOWNS];
    event events[EVENTS];
    int count;
    int unknown;
    int hook;
    frame behind[JOINTS + 1];
    frame root[JOINTS];
    vec beyond[JOINTS];
    vec rope[JOINTS];
} state;

typedef struct { real mass; vec force; } weight;

static real payload(const real *number, const flexcal_pose *pose)
{
    const real mass = pose->payload_kg;
    return mass > R(0.0) ? mass + number[N_PAYLOAD_ERROR] : mass;
}

static event *record(state *s, int kind, int index, vec at)
{
    event *e = &s->events[s->count];
    s->count += 1;
    e->kind = kind;
    e->index = index;
    e->at = at;
    e->force = vec_of(R(0.0), R(0.0), R(0.0));
    e->second = e->force;
    e->pull = R(0.0);
    return e;
}

static void record_load(state *s, vec at, vec force)
{
    record(s, LOAD, 0, at)->force = force;
}

#if HOISTS
/* Returns the force of a rope whose hook is at x, y [m] of the arm base frame [N]. */
static vec rope_force(const real *number, const flexcal_pose *pose, int hoist, real x, real y)
{
    const real *of = number + N_HOIST + hoist * H_SIZE;
    const real tension = pose->has_hoist ? pose->hoist_N : of[H_FORCE];
    vec direction = vec_at(of + H_DIRECTION_X);
#if LEANING_ROPES
    const real *rope = number + N_ROPE;
    real length;
    direction.x += rope[1] + rope[3] * x;
    direction.y += rope[2] + rope[3] * y;
    length = SQRT(dot(direction, direction));
    return add(vec_of(R(0.0), R(0.0), R(0.0)), (R(1.0) + rope[0]) * tension / length, direction);
#else
    (void)x;
    (void)y;
    return add(vec_of(R(0.0), R(0.0), R(0.0)), tension, direction);
#endif
}
#endif

/* Computes the forces of ropes, and the forces beyond each link; `hooks` are positions of hooks, or
   NULL for hooks above the base. */
static void gather_forces(const real *number, const flexcal_pose *pose, const real *hooks, state *s)
{
    weight of[JOINTS + 1];
    const vec gravity = vec_at(number + N_GRAVITY);
    int i, k;
    for (i = 0; i <= JOINTS; ++i) {
        of[i].mass = R(0.0);
        of[i].force = vec_of(R(0.0), R(0.0), R(0.0));
    }
    for (i = JOINTS - 1; i >= 0; --i) {
        weight sum = of[i + 1];
        weight *parent = &of[JOINT[i].parent + 1];
        if (i == PAYLOAD_JOINT) {
            sum.mass += payload(number, pose);
        }
        for (k = JOINT[i].first_body; k < JOINT[i].first_body + JOINT[i].bodies; ++k) {
            sum.mass += number[N_BODY + k * L_SIZE + L_MASS];
        }
        s->beyond[i] = add(sum.force, sum.mass, gravity);
        s->rope[i] = vec_of(R(0.0), R(0.0), R(0.0));
#if BEAMS
        if (JOINT[i].beam >= 0) {
            const beam_info *beam = &BEAM[JOINT[i].beam];
            sum.mass += number[N_BEAM + JOINT[i].beam * B_SIZE + B_MASS];
            for (k = beam->first_load; k < beam->first_load + beam->loads; ++k) {
                sum.mass += number[N_LOAD + k * L_SIZE + L_MASS];
            }
#if HOISTS
            if (beam->hoist >= 0) {
                const real x = hooks == NULL ? R(0.0) : hooks[2 * beam->hoist];
                const real y = hooks == NULL ? R(0.0) : hooks[2 * beam->hoist + 1];
                s->rope[i] = rope_force(number, pose, beam->hoist, x, y);
                sum.force = add(sum.force, R(1.0), s->rope[i]);
            }
#endif
        }
#endif
        parent->mass += sum.mass;
        parent->force = add(parent->force, R(1.0), sum.force);
    }
    (void)hooks;
}

#if BEAMS || TILTS
static void rotate(frame *f, vec w)
{
    const frame by = rotation(w);
    const frame old = *f;
    int k;
    for (k = 0; k < 3; ++k) {
        f->axis[k] = vector_in(&old, by.axis[k]);
    }
}
#endif

#if TILTS
/* Tilts the frame by flexibilities about x and y [rad/(N m)]; the moments act about the axes at
   half the tilt. */
static void tilt(frame *f, real about_x, real about_y, int mode, state *s)
{
    const int first = s->unknown;
    vec half = vec_of(R(0.0), R(0.0), R(0.0));
    s->unknown += 2;
    if (mode != RIGID) {
        half = vec_of(R(0.5) * about_x * s->moment[first], R(0.5) * about_y * s->moment[first + 1], R(0.0));
    }
    rotate(f, half);
    if (mode != FIRST_ORDER) {
        event *e = record(s, TILT, first, f->origin);
        e->force = f->axis[0];
        e->second = f->axis[1];
    }
    rotate(f, half);
}
#endif

#if BEAMS
/* Force on a beam: the element that carries it, its position in the beam's frame [m], and the force
   in the arm base frame [N]. */
typedef struct { int element; vec at; vec force; int is_rope; } link_load;
/* Load at a station s of a clamped beam, in the beam's frame. */
typedef struct { real at; vec force; vec moment; } station_load;
typedef struct { vec displacement; vec rotation; } deflection;

/* Clamped uniform beam with its loads (Euler-Bernoulli); rigidities have the sign of the length. */
typedef struct {
    real length, axial, about_y, about_z, twist, coupling_y, coupling_z;
    real strain[3];
    vec spread;
    station_load point[MAX_LOADS + 1];
    int points;
} cantilever;

/* Adds a deflection from deflection and slope per force and per moment. */
static void superpose(deflection *out, const cantilever *c, vec f, vec m, real df, real sf, real dm, real sm)
{
    out->displacement.x += c->axial * f.x * sm;
    out->displacement.y += c->about_z * (f.y * df + m.z * dm) + c->coupling_z * m.x * dm;
    out->displacement.z += c->about_y * (f.z * df - m.y * dm) - c->coupling_y * m.x * dm;
    out->rotation.x += c->twist * m.x * sm + c->coupling_y * (m.y * sm - f.z * sf) + c->coupling_z * (m.z * sm + f.y * sf);
    out->rotation.y += c->about_y * (m.y * sm - f.z * sf) + c->coupling_y * m.x * sm;
    out->rotation.z += c->about_z * (m.z * sm + f.y * sf) + c->coupling_z * m.x * sm;
}

/* Adds the deflection by the spread load and by the strain without load. */
static void superpose_spread(deflection *out, const cantilever *c, real df, real sf, real stretch, real x, real half_square)
{
    const vec q = c->spread;
    out->displacement.x += c->axial * q.x * stretch + c->strain[0] * x;
    out->displacement.y += c->about_z * q.y * df + c->strain[2] * half_square;
    out->displacement.z += c->about_y * q.z * df - c->strain[1] * half_square;
    out->rotation.x += (c->coupling_z * q.y - c->coupling_y * q.z) * sf;
    out->rotation.y += c->strain[1] * x - c->about_y * q.z * sf;
    out->rotation.z += c->strain[2] * x + c->about_z * q.y * sf;
}

static deflection no_deflection(void)
{
    deflection d;
    d.displacement = vec_of(R(0.0), R(0.0), R(0.0));
    d.rotation = d.displacement;
    return d;
}

/* Returns the deflection of the section at x [m] [Chen2021, eq. 4 and 6, without misprints]. */
static deflection deflection_at(const cantilever *c, real x)
{
    const real l = c->length;
    const real x2 = x * x;
    deflection out = no_deflection();
    int k;
    for (k = 0; k < c->points; ++k) {
        const real s = c->point[k].at;
        const real half = R(0.5) * s * s;
        if (FABS(x) <= FABS(s)) {
            superpose(&out, c, c->point[k].force, c->point[k].moment,
                x2 * (R(0.5) * s - x / R(6.0)), x * (s - R(0.5) * x), R(0.5) * x2, x);
        } else {
            superpose(&out, c, c->point[k].force, c->point[k].moment,
                s * half * (R(2.0) / R(3.0)) + half * (x - s), half, half + s * (x - s), s);
        }
    }
    superpose_spread(&out, c, x2 * (R(0.25) * l * l - l * x / R(6.0) + x2 / R(24.0)),
        x * (R(0.5) * l * l - R(0.5) * l * x + x2 / R(6.0)), x * (l - R(0.5) * x), x, R(0.5) * x2);
    return out;
}

/* Returns the mean displacement along the beam, which is that of its centre of mass [m]. */
static vec mean_displacement(const cantilever *c)
{
    const real l = c->length;
    const real l2 = l * l;
    deflection out = no_deflection();
    int k;
    for (k = 0; k < c->points; ++k) {
        const real s = c->point[k].at;
        const real rest = l - s;
        const real half = R(0.5) * s * s;
        superpose(&out, c, c->point[k].force, c->point[k].moment,
            (R(0.5) * half * half + (s * half * (R(2.0) / R(3.0)) + R(0.5) * half * rest) * rest) / l, half,
            (s * half / R(3.0) + (half + R(0.5) * s * rest) * rest) / l, (half + s * rest) / l);
    }
    superpose_spread(&out, c, R(0.05) * l2 * l2, l2 * l / R(6.0), l2 / R(3.0), R(0.5) * l, l2 / R(6.0));
    return out.displacement;
}

static vec resolve(const frame *f, vec v)
{
    return vec_of(dot(f->axis[0], v), dot(f->axis[1], v), dot(f->axis[2], v));
}

/* Returns the section that carries a load, from the element's root, and the rigid offset to it [m]. */
static real station_of(const link_load *load, real start, real length, vec *offset)
{
    const real x = load->at.x - start;
    const real part = x / length;
    const real station = part < R(0.0) ? R(0.0) : (part > R(1.0) ? length : x);
    *offset = vec_of(x - station, load->at.y, load->at.z);
    return station;
}

/* Element of a beam with its loads. */
typedef struct {
    int number;
    real length, start;
    vec weight, tip_force, tip_moment;
    const link_load *load;
    int loads;
} element;

/* Resolves the loads of an element in some axes. */
static void resolve_loads(const element *e, const frame *axes, cantilever *c)
{
    const vec spread = resolve(axes, e->weight);
    int k;
    c->points = 0;
    for (k = 0; k < e->loads; ++k) {
        if (e->load[k].element == e->number) {
            station_load *p = &c->point[c->points];
            vec offset;
            p->at = station_of(&e->load[k], e->start, e->length, &offset);
            p->force = resolve(axes, e->load[k].force);
            p->moment = cross(offset, p->force);
            c->points += 1;
        }
    }
    c->point[c->points].at = e->length;
    c->point[c->points].force = resolve(axes, e->tip_force);
    c->point[c->points].moment = resolve(axes, e->tip_moment);
    c->points += 1;
    c->spread = vec_of(spread.x / e->length, spread.y / e->length, spread.z / e->length);
}

/* Returns the rotation from the root to the chord, with half the twist. */
static vec lean_of(const deflection *tip, real length)
{
    return vec_of(R(0.5) * tip->rotation.x, -tip->displacement.z / length, tip->displacement.y / length);
}

/* Passes through one element: records loads and moves the frame to its tip. */
static void pass_element(const real *number, const flexcal_pose *pose, const element *e, cantilever *c, int mode,
    int joint, frame *f, state *s)
{
    const frame root = *f;
    int k;
    (void)number;
    (void)pose;
    if (mode == FIRST_ORDER) {
        deflection tip;
        resolve_loads(e, &s->root[joint], c);
        tip = deflection_at(c, e->length);
        shift(f, 0, e->length);
        f->origin = point_in(f, tip.displacement);
        rotate(f, tip.rotation);
        return;
    }
    if (mode == RIGID) {
        record_load(s, add(root.origin, R(0.5) * e->length, root.axis[0]), e->weight);
        for (k = 0; k < e->loads; ++k) {
            if (e->load[k].element == e->number) {
                vec offset, at, force = e->load[k].force;
                const real station = station_of(&e->load[k], e->start, e->length, &offset);
                offset.x += station;
                at = point_in(&root, offset);
#if LEANING_ROPES
                if (e->load[k].is_rope) {
                    s->next[2 * s->hook] = at.x;
                    s->next[2 * s->hook + 1] = at.y;
                    force = rope_force(number, pose, s->hook, at.x, at.y);
                    s->hook += 1;
                }
#endif
                record_load(s, at, force);
            }
        }
        shift(f, 0, e->length);
    } else {
        frame chord = root;
        deflection tip;
        vec lean, along = vec_of(R(0.5) * e->length, R(0.0), R(0.0));
        resolve_loads(e, &root, c);
        tip = deflection_at(c, e->length);
        rotate(&chord, lean_of(&tip, e->length));
        resolve_loads(e, &chord, c);
        tip = deflection_at(c, e->length);
        lean = lean_of(&tip, e->length);
        chord = root;
        rotate(&chord, lean);
        record_load(s, point_in(&chord, add(add(along, R(1.0), mean_displacement(c)), R(-1.0), cross(lean, along))), e->weight);
        for (k = 0; k < e->loads; ++k) {
            if (e->load[k].element == e->number) {
                vec offset, at;
                const real station = station_of(&e->load[k], e->start, e->length, &offset);
                const deflection here = deflection_at(c, station);
                const frame turned = rotation(add(here.rotation, R(-1.0), lean));
                along = vec_of(station, R(0.0), R(0.0));
                at = add(add(along, R(1.0), here.displacement), R(-1.0), cross(lean, along));
                at = point_in(&chord, add(at, R(1.0), vector_in(&turned, offset)));
#if LEANING_ROPES
                if (e->load[k].is_rope) {
                    s->next[2 * s->hook] = at.x;
                    s->next[2 * s->hook + 1] = at.y;
                    s->hook += 1;
                }
#endif
                record_load(s, at, e->load[k].force);
            }
        }
        *f = chord;
        shift(f, 0, e->length + tip.displacement.x);
        rotate(f, add(tip.rotation, R(-1.0), lean));
    }
    record(s, TIP, s->unknown - 3, f->origin);
}

/* Passes along the beam of a joint. */
static void pass_beam(const real *number, const flexcal_pose *pose, const terms *term, int joint, int mode, frame *f, state *s)
{
    const int which = JOINT[joint].beam;
    const real *of = number + N_BEAM + which * B_SIZE;
    const real whole = number[N_JOINT + joint * J_SIZE + J_A];
    const real sign = whole < R(0.0) ? R(-1.0) : R(1.0);
    const vec gravity = vec_at(number + N_GRAVITY);
    link_load load[MAX_LOADS];
    cantilever c;
    element e;
    int k;
    e.length = whole / R(ELEMENTS);
    e.load = load;
    e.loads = 0;
    for (k = 0; k < BEAM[which].loads; ++k) {
        const real *mass = number + N_LOAD + (BEAM[which].first_load + k) * L_SIZE;
        load[e.loads].at = vec_at(mass + L_X);
        load[e.loads].force = add(vec_of(R(0.0), R(0.0), R(0.0)), mass[L_MASS], gravity);
        load[e.loads].is_rope = 0;
        e.loads += 1;
    }
#if HOISTS
    if (BEAM[which].hoist >= 0) {
        load[e.loads].at = vec_at(number + N_HOIST + BEAM[which].hoist * H_SIZE + H_X);
        load[e.loads].force = s->rope[joint];
        load[e.loads].is_rope = 1;
        e.loads += 1;
    }
#endif
    for (k = 0; k < e.loads; ++k) {
        const real part = load[k].at.x / e.length;
        load[k].element = part < R(0.0) ? 0 : (part > R(ELEMENTS - 1) ? ELEMENTS - 1 : (int)part);
    }
    c.length = e.length;
    c.axial = sign * of[B_AXIAL];
    c.about_y = sign * of[B_ABOUT_Y];
    c.about_z = sign * of[B_ABOUT_Z];
    c.twist = sign * of[B_TWIST];
    c.coupling_y = sign * of[B_COUPLING_Y];
    c.coupling_z = sign * of[B_COUPLING_Z];
    for (k = 0; k < 3; ++k) {
        c.strain[k] = BEAM[which].has_strain ? of[B_STRAIN + k] + term->strain[which][k] : R(0.0);
    }
    e.weight = add(vec_of(R(0.0), R(0.0), R(0.0)), of[B_MASS] / R(ELEMENTS), gravity);
    for (e.number = 0; e.number < ELEMENTS; ++e.number) {
        e.start = e.length * (real)e.number;
        e.tip_force = add(s->beyond[joint], (real)(ELEMENTS - 1 - e.number), e.weight);
        for (k = 0; k < e.loads; ++k) {
            if (load[k].element > e.number) {
                e.tip_force = add(e.tip_force, R(1.0), load[k].force);
            }
        }
        e.tip_moment = mode == RIGID ? vec_of(R(0.0), R(0.0), R(0.0)) : vec_at(&s->moment[s->unknown]);
        s->unknown += 3;
        pass_element(number, pose, &e, &c, mode, joint, f, s);
    }
}
#endif

#if SPRINGS
/* Returns the moment of a spring about a joint's axis [N m]. */
static real spring_moment(const real *joint, real sine, real cosine)
{
    const real px = cosine * joint[J_LEVER_X] - sine * joint[J_LEVER_Y];
    const real py = sine * joint[J_LEVER_X] + cosine * joint[J_LEVER_Y];
    const real x = px - joint[J_ANCHOR_X];
    const real y = py - joint[J_ANCHOR_Y];
    const real area = px * joint[J_ANCHOR_Y] - py * joint[J_ANCHOR_X];
    const real square = x * x + y * y;
    const real anchor = joint[J_ANCHOR_X] * joint[J_ANCHOR_X] + joint[J_ANCHOR_Y] * joint[J_ANCHOR_Y];
    const real lever = joint[J_LEVER_X] * joint[J_LEVER_X] + joint[J_LEVER_Y] * joint[J_LEVER_Y];
    if (square <= R(1e-18) * (anchor > lever ? anchor : lever)) {
        return joint[J_RATE] * area;
    }
    return (joint[J_RATE] + (joint[J_PRELOAD] - joint[J_RATE] * joint[J_FREE_LENGTH]) / SQRT(square)) * area;
}
#endif

/* Passes through all joints; frames behind each are kept. */
static void pass(const real *number, const flexcal_pose *pose, const terms *term, int mode, state *s)
{
    const vec gravity = vec_at(number + N_GRAVITY);
    frame f = identity();
    int i, k;
    s->unknown = FIRST_MOMENT;
    s->count = 0;
    s->hook = 0;
#if MOUNTING
    tilt(&f, number[N_MOUNTING], number[N_MOUNTING + 1], mode, s);
    if (mode != FIRST_ORDER) {
        record(s, END, -1, f.origin);
    }
#endif
    s->behind[0] = f;
    for (i = 0; i < JOINTS; ++i) {
        const real *joint = number + N_JOINT + i * J_SIZE;
        const joint_info *info = &JOINT[i];
        const real q = term->coordinate[i];
        real angle = joint[J_THETA] + (info->kind == REVOLUTE ? q : R(0.0));
        real offset = joint[J_D] + (info->kind == PRISMATIC ? q : R(0.0));
        f = s->behind[info->parent + 1];
        if (mode != FIRST_ORDER) {
            record(s, BEGIN, i, f.origin);
        }
        advance_to_link(&f, joint, info->is_placed);
        if (mode == RIGID) {
            s->root[i] = f;
        }
#if BEAMS
        if (info->beam >= 0) {
            pass_beam(number, pose, term, i, mode, &f, s);
        } else {
            shift(&f, 0, joint[J_A]);
        }
#else
        shift(&f, 0, joint[J_A]);
#endif
#if TILTS
        if (info->is_lateral) {
            tilt(&f, joint[J_LATERAL_X], joint[J_LATERAL_Y], mode, s);
        }
#endif
#if MOTIONS
        displace(&f, term->motion[i]);
#endif
        if (info->is_flexible) {
            if (pose->has_approach) {
                const real play = R(0.5) * joint[J_PLAY] * pose->approach[i];
                if (info->kind == PRISMATIC) {
                    offset += play;
                } else {
                    angle += play;
                }
            }
            if (mode != RIGID) {
                const real m = s->moment[s->unknown];
                angle += joint[J_FLEXIBILITY] * m + joint[J_CUBIC] * m * m * m;
                if (!pose->has_approach && info->kind != PRISMATIC) {
                    angle += R(0.5) * joint[J_PLAY] * TANH(m);
                }
            }
            if (mode != FIRST_ORDER) {
                event *e = record(s, AXIS, s->unknown, f.origin);
                e->force = f.axis[2];
#if SPRINGS
                if (info->has_spring) {
                    e->pull = spring_moment(joint, SIN(angle), COS(angle));
                }
#endif
            }
            s->unknown += 1;
        }
        turn(&f, 0, 1, SIN(angle), COS(angle));
#if TILTS
        if (info->is_slide) {
            /* Weightless cantilever: two tilts at the Gauss-Legendre points. */
            const real half = R(0.5) * joint[J_SLIDE] * FABS(offset);
            shift(&f, 2, R(0.2113248654051871) * offset);
            tilt(&f, half, half, mode, s);
            shift(&f, 2, R(0.5773502691896258) * offset);
            tilt(&f, half, half, mode, s);
            shift(&f, 2, R(0.2113248654051871) * offset);
        } else {
            shift(&f, 2, offset);
        }
#else
        shift(&f, 2, offset);
#endif
        turn(&f, 2, 0, joint[J_BETA_SIN], joint[J_BETA_COS]);
#if MOTIONS
        displace(&f, term->motion[i] + 6);
#endif
        s->behind[i + 1] = f;
        if (mode != FIRST_ORDER) {
            for (k = info->first_body; k < info->first_body + info->bodies; ++k) {
                const real *body = number + N_BODY + k * L_SIZE;
                record_load(s, point_in(&f, vec_at(body + L_X)), add(vec_of(R(0.0), R(0.0), R(0.0)), body[L_MASS], gravity));
            }
            if (i == PAYLOAD_JOINT) {
                record_load(s, point_in(&f, vec_at(number + N_PAYLOAD_AT)),
                    add(vec_of(R(0.0), R(0.0), R(0.0)), payload(number, pose), gravity));
            }
            record(s, END, i, f.origin);
        }
    }
}

/* Sums the loads of the last pass to the moments at its sections; returns the sum of the magnitudes
   of all moments about the base [N m]. */
static real sum_moments(state *s)
{
    vec force[JOINTS + 1], moment[JOINTS + 1];
    vec f = vec_of(R(0.0), R(0.0), R(0.0));
    vec m = f;
    real scale = R(0.0);
    int k;
    for (k = 0; k <= JOINTS; ++k) {
        force[k] = f;
        moment[k] = f;
    }
    for (k = s->count - 1; k >= 0; --k) {
        const event *e = &s->events[k];
        const vec here = add(m, R(-1.0), cross(e->at, f));
        if (e->kind == LOAD) {
            f = add(f, R(1.0), e->force);
            m = add(m, R(1.0), cross(e->at, e->force));
            scale += SQRT(dot(e->at, e->at) * dot(e->force, e->force));
        } else if (e->kind == TIP) {
            s->next[e->index] = here.x;
            s->next[e->index + 1] = here.y;
            s->next[e->index + 2] = here.z;
        } else if (e->kind == AXIS) {
            s->next[e->index] = dot(e->force, here) + e->pull;
            scale += FABS(e->pull);
        } else if (e->kind == TILT) {
            s->next[e->index] = dot(e->force, here);
            s->next[e->index + 1] = dot(e->second, here);
        } else if (e->kind == END) {
            f = force[e->index + 1];
            m = moment[e->index + 1];
        } else {
            const int parent = JOINT[e->index].parent + 1;
            force[parent] = add(force[parent], R(1.0), f);
            moment[parent] = add(moment[parent], R(1.0), m);
        }
    }
    return scale;
}

/* Computes the frame that carries a target, arm base frame, in equilibrium. */
static int arm_frame(const real *number, const flexcal_pose *pose, const terms *term, frame *out)
{
    state s;
    const int tip = TARGET_JOINT[pose->target] + 1;
    int k;
#if !UNDEFLECTED || MIXING
    int n;
#endif
#if UNDEFLECTED && MIXING
    frame first;
#endif
    gather_forces(number, pose, NULL, &s);
    pass(number, pose, term, RIGID, &s);
    (void)sum_moments(&s);
    for (k = 0; k < UNKNOWNS; ++k) {
        s.moment[k] = s.next[k];
    }
#if UNDEFLECTED
#if LEANING_ROPES
    gather_forces(number, pose, s.moment, &s);
#endif
    pass(number, pose, term, FIRST_ORDER, &s);
    *out = s.behind[tip];
#if MIXING
    first = *out;
#else
    return FLEXCAL_OK;
#endif
#endif
#if !UNDEFLECTED || MIXING
    for (n = 0; n < FLEXCAL_MAX_PASSES; ++n) {
        real largest = R(0.0), change = R(0.0), sum = R(0.0), scale;
#if LEANING_ROPES
        gather_forces(number, pose, s.moment, &s);
#endif
        pass(number, pose, term, BENT, &s);
        scale = sum_moments(&s);
        for (k = 0; k < UNKNOWNS; ++k) {
            const real step = FABS(s.next[k] - s.moment[k]);
            const real size = FABS(s.next[k]);
            sum += step;
            change = step > change ? step : change;
            largest = size > largest ? size : largest;
            s.moment[k] = s.next[k];
        }
        *out = s.behind[tip];
        /* Also true for NaN. */
        if (!(sum <= R(1e30))) {
            return FLEXCAL_NO_EQUILIBRIUM;
        }
        if (change <= TOLERANCE * largest || change <= R(10.0) * EPSILON * scale) {
#if UNDEFLECTED && MIXING
            for (k = 0; k < 3; ++k) {
                out->axis[k] = add(first.axis[k], number[N_MIXING], add(out->axis[k], R(-1.0), first.axis[k]));
            }
            out->origin = add(first.origin, number[N_MIXING], add(out->origin, R(-1.0), first.origin));
#endif
            return FLEXCAL_OK;
        }
    }
    return FLEXCAL_NO_EQUILIBRIUM;
#endif
}
