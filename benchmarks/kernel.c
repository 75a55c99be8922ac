/* Net rotation of a serial four-link robot after manoeuvre A, written by hand for SIMD: eight designs side by side.

   What reojax is measured against. Fourth-order Magnus method, two Gauss nodes a step, base frame; momenta are gathered
   from the tip to the base as in reojax.mechanics._fast/omega.py. From node to node the sines and cosines move by angle addition.
   Two forms: `net_rotation` for any axes and anchors, given as data, and `net_rotation_prototype` with the structure of
   one robot put in by hand: twist joints about -z, bend joint about x, anchors on z. */

#include <math.h>

#ifdef __AVX512F__
enum { LANES = 8 };
#else
enum { LANES = 4 };
#endif
typedef double V __attribute__((vector_size(8 * LANES), aligned(8), may_alias));
typedef struct { V x, y, z; } Vec;
typedef struct { V xx, yy, zz, xy, xz, yz; } Sym;
typedef struct { V s, c; } Turn;
typedef struct { V w, x, y, z; } Quat;
/* What hangs on a frame, about its origin: mass, first moment, linear and angular momentum at rest, inertia. */
typedef struct { double m; Vec f, p, h; Sym J; } Body;
/* `rotor` is signed by the link that carries it; links 0 and 3 in second moments of mass, which a longer foot scales. */
typedef struct { double mass[4], first[4][3], end[2][6], middle[2][6], axis[3][3], anchor[3][3], rotor[3], end_inertia; } Robot;

static const double GAUSS[2] = {0.21132486540518711775, 0.78867513459481288225}, ROOT3_12 = 0.14433756729740644113;

static inline Turn add(Turn a, Turn b) { return (Turn){a.s * b.c + a.c * b.s, a.c * b.c - a.s * b.s}; }

static inline Turn turn(V angle) { /* power series at an eighth of the angle, doubled three times */
    V x = angle / 8, z = x * x;
    V s = x * (1 - z / 6 * (1 - z / 20 * (1 - z / 42 * (1 - z / 72 * (1 - z / 110 * (1 - z / 156))))));
    V c = 1 - z / 2 * (1 - z / 12 * (1 - z / 30 * (1 - z / 56 * (1 - z / 90 * (1 - z / 132 * (1 - z / 182))))));
    Turn t = {s, c};
    for (int i = 0; i < 3; i++) t = add(t, t);
    return t;
}

static inline Body about_z(Body b, Turn t, V rate, V rotor) {
    V s = t.s, c = t.c, px = b.p.x - rate * b.f.y, py = b.p.y + rate * b.f.x;
    V hx = b.h.x + rate * b.J.xz, hy = b.h.y + rate * b.J.yz;
    V less = s * (s * (b.J.xx - b.J.yy) + 2 * c * b.J.xy);
    return (Body){b.m,
                  {c * b.f.x - s * b.f.y, s * b.f.x + c * b.f.y, b.f.z},
                  {c * px - s * py, s * px + c * py, b.p.z},
                  {c * hx - s * hy, s * hx + c * hy, b.h.z + rate * b.J.zz + rotor},
                  {b.J.xx - less, b.J.yy + less, b.J.zz, c * s * (b.J.xx - b.J.yy) + (c * c - s * s) * b.J.xy,
                   c * b.J.xz - s * b.J.yz, s * b.J.xz + c * b.J.yz}};
}

static inline Body x_to_z(Body b) {
    return (Body){b.m, {b.f.y, b.f.z, b.f.x}, {b.p.y, b.p.z, b.p.x}, {b.h.y, b.h.z, b.h.x},
                  {b.J.yy, b.J.zz, b.J.xx, b.J.yz, b.J.xy, b.J.xz}};
}

static inline Body along_z(Body b, double a) {
    V level = 2 * a * b.f.z + b.m * a * a;
    return (Body){b.m, {b.f.x, b.f.y, b.f.z + b.m * a}, b.p, {b.h.x - a * b.p.y, b.h.y + a * b.p.x, b.h.z},
                  {b.J.xx + level, b.J.yy + level, b.J.zz, b.J.xy, b.J.xz - a * b.f.x, b.J.yz - a * b.f.y}};
}

static inline Body join(Body a, Body rest) { /* `rest` has no momentum of its own */
    Vec f = rest.f;
    Sym J = rest.J;
    return (Body){a.m + rest.m, {a.f.x + f.x, a.f.y + f.y, a.f.z + f.z}, a.p, a.h,
                  {a.J.xx + J.xx, a.J.yy + J.yy, a.J.zz + J.zz, a.J.xy + J.xy, a.J.xz + J.xz, a.J.yz + J.yz}};
}

static inline Body on_base_of_prototype(const Robot *r, const Body link[4], const Turn t[3], const V rate[3], V ratio) {
    Body b = link[3];
    for (int j = 2; j >= 0; j--) {
        V rotor = r->rotor[j] * ratio * rate[j];
        if (j == 1)
            b = x_to_z(x_to_z(about_z(x_to_z(b), t[j], rate[j], rotor)));
        else
            b = about_z(b, (Turn){-t[j].s, t[j].c}, -rate[j], -rotor);
        b = join(along_z(b, r->anchor[j][2]), link[j]);
    }
    return b;
}

static inline Vec combine(V a, Vec u, V b, Vec v) { return (Vec){a * u.x + b * v.x, a * u.y + b * v.y, a * u.z + b * v.z}; }
static inline V dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline Vec cross(Vec a, Vec b) { return (Vec){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
static inline Vec apply(const Vec E[3], Vec v) { return (Vec){dot(E[0], v), dot(E[1], v), dot(E[2], v)}; }
static inline Vec same(const double v[3]) { return (Vec){(V){} + v[0], (V){} + v[1], (V){} + v[2]}; }

static inline Body on_base(const Robot *r, const Body link[4], const Turn t[3], const V rate[3], V ratio) {
    Body b = link[3];
    V one = (V){} + 1;
    for (int j = 2; j >= 0; j--) {
        Vec e = same(r->axis[j]), a = same(r->anchor[j]);
        V s = t[j].s, c = t[j].c, v = 1 - c, m = one * b.m;
        Vec E[3] = {{c + v * e.x * e.x, v * e.x * e.y - s * e.z, v * e.x * e.z + s * e.y},
                    {v * e.x * e.y + s * e.z, c + v * e.y * e.y, v * e.y * e.z - s * e.x},
                    {v * e.x * e.z - s * e.y, v * e.y * e.z + s * e.x, c + v * e.z * e.z}};
        Vec J[3] = {{b.J.xx, b.J.xy, b.J.xz}, {b.J.xy, b.J.yy, b.J.yz}, {b.J.xz, b.J.yz, b.J.zz}};
        Vec p = apply(E, combine(one, b.p, rate[j], cross(e, b.f)));
        Vec h = apply(E, combine(one, b.h, rate[j], apply(J, e)));
        h = combine(one, combine(one, h, r->rotor[j] * ratio * rate[j], e), one, cross(a, p));
        Vec f = apply(E, b.f), g = combine(one, f, 0.5 * m, a), K[3];
        for (int i = 0; i < 3; i++) K[i] = apply(J, E[i]);
        V x = a.x * g.x, y = a.y * g.y, z = a.z * g.z;
        Sym moved = {dot(K[0], E[0]) + 2 * (y + z), dot(K[1], E[1]) + 2 * (x + z), dot(K[2], E[2]) + 2 * (x + y),
                     dot(K[0], E[1]) - a.x * g.y - a.y * g.x, dot(K[0], E[2]) - a.x * g.z - a.z * g.x,
                     dot(K[1], E[2]) - a.y * g.z - a.z * g.y};
        b = join((Body){b.m, combine(one, f, m, a), p, h, moved}, link[j]);
    }
    return b;
}

static inline Vec omega(Body b) {
    double m = 1 / b.m;
    V cx = m * b.f.x, cy = m * b.f.y, cz = m * b.f.z;
    V xx = b.J.xx - (cy * b.f.y + cz * b.f.z), yy = b.J.yy - (cx * b.f.x + cz * b.f.z);
    V zz = b.J.zz - (cx * b.f.x + cy * b.f.y);
    V xy = b.J.xy + cx * b.f.y, xz = b.J.xz + cx * b.f.z, yz = b.J.yz + cy * b.f.z;
    V lx = b.h.x - (cy * b.p.z - cz * b.p.y), ly = b.h.y - (cz * b.p.x - cx * b.p.z), lz = b.h.z - (cx * b.p.y - cy * b.p.x);
    V a = yy * zz - yz * yz, d = xz * yz - xy * zz, e = xy * yz - xz * yy, f = xy * xz - xx * yz;
    V k = -1 / (xx * a + xy * d + xz * e);
    return (Vec){k * (a * lx + d * ly + e * lz), k * (d * lx + (xx * zz - xz * xz) * ly + f * lz),
                 k * (e * lx + f * ly + (xx * yy - xy * xy) * lz)};
}

static inline Quat step(Quat q, Vec a, Vec b) { /* q exp((a + b) / 2 + sqrt(3) / 12 a x b) */
    V x = (a.x + b.x) / 2 + ROOT3_12 * (a.y * b.z - a.z * b.y), y = (a.y + b.y) / 2 + ROOT3_12 * (a.z * b.x - a.x * b.z);
    V z = (a.z + b.z) / 2 + ROOT3_12 * (a.x * b.y - a.y * b.x), h = (x * x + y * y + z * z) / 4;
    V s = (1 - h / 6 * (1 - h / 20 * (1 - h / 42 * (1 - h / 72 * (1 - h / 110))))) / 2;
    V w = 1 - h / 2 * (1 - h / 12 * (1 - h / 30 * (1 - h / 56 * (1 - h / 90 * (1 - h / 132)))));
    x *= s, y *= s, z *= s;
    return (Quat){q.w * w - q.x * x - q.y * y - q.z * z, q.w * x + q.x * w + q.y * z - q.z * y,
                  q.w * y - q.x * z + q.y * w + q.z * x, q.w * z + q.x * y - q.y * x + q.z * w};
}

static inline Body end_link(const Robot *r, int link, V k) { /* its foot `k` times as long */
    const double *f = r->first[link], *P = r->end[link == 3];
    V xx = k * k * P[0], yy = k * k * P[1], zz = (V){} + P[2];
    return (Body){r->mass[link], {k * f[0], k * f[1], (V){} + f[2]}, {}, {},
                  {yy + zz, xx + zz, xx + yy, -k * k * P[3], -k * P[4], -k * P[5]}};
}

static inline Body middle_link(const Robot *r, int link) {
    const double *f = r->first[link], *J = r->middle[link - 1];
    V zero = {};
    return (Body){r->mass[link], {zero + f[0], zero + f[1], zero + f[2]}, {}, {},
                  {zero + J[0], zero + J[1], zero + J[2], zero + J[3], zero + J[4], zero + J[5]}};
}

static inline __attribute__((always_inline)) void run(int general, const Robot *r, int steps, int n, const double *twist,
                                                     const double *bend, const double *inertia, const double *ratio,
                                                     double *quaternion) {
    for (int i = 0; i < n; i += LANES) {
        V t = *(const V *)(twist + i), b = *(const V *)(bend + i), N = *(const V *)(ratio + i), zero = {}, k;
        for (int j = 0; j < LANES; j++) k[j] = sqrt(inertia[i + j] / r->end_inertia);
        const Body link[4] = {end_link(r, 0, k), middle_link(r, 1), middle_link(r, 2), end_link(r, 3, k)};
        const V edge[4][3] = {{zero, b, zero}, {t, zero, -t}, {zero, -b, zero}, {-t, zero, t}};
        Turn at[3] = {{zero, zero + 1}, {zero, zero + 1}, {zero, zero + 1}};
        Quat q = {zero + 1, zero, zero, zero};
        for (int e = 0; e < 4; e++) {
            V rate[3];
            Turn to[2][3], over[3];
            for (int j = 0; j < 3; j++) {
                rate[j] = edge[e][j] / steps;
                for (int g = 0; g < 2; g++) to[g][j] = turn(GAUSS[g] * rate[j]);
                over[j] = add(to[0][j], to[1][j]);
            }
            for (int s = 0; s < steps; s++) {
                Vec w[2];
                for (int g = 0; g < 2; g++) {
                    Turn node[3] = {add(at[0], to[g][0]), add(at[1], to[g][1]), add(at[2], to[g][2])};
                    w[g] = omega((general ? on_base : on_base_of_prototype)(r, link, node, rate, N));
                }
                q = step(q, w[0], w[1]);
                for (int j = 0; j < 3; j++) at[j] = add(at[j], over[j]);
            }
        }
        *(V *)(quaternion + i) = q.w, *(V *)(quaternion + n + i) = q.x;
        *(V *)(quaternion + 2 * n + i) = q.y, *(V *)(quaternion + 3 * n + i) = q.z;
    }
}

/* n designs, n a multiple of LANES; angles [rad]; quaternion (4, n). */
void net_rotation(const Robot *r, int steps, int n, const double *twist, const double *bend, const double *inertia,
                  const double *ratio, double *quaternion) {
    run(1, r, steps, n, twist, bend, inertia, ratio, quaternion);
}

void net_rotation_prototype(const Robot *r, int steps, int n, const double *twist, const double *bend,
                            const double *inertia, const double *ratio, double *quaternion) {
    run(0, r, steps, n, twist, bend, inertia, ratio, quaternion);
}
