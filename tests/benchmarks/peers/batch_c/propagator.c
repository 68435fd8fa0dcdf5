/* The largest |Fy| and |Fz| of each carriage in scenes that differ in the body and the carriages: as many scenes side by
 * side as a vector register has lanes, each by the exact propagator of the first-order hold. Written by hand for one shape
 * of scene: DOFS free ones and CARRIAGES, both told to the compiler. Units are SI. */

#if defined(__AVX512F__)
#define LANES 8
#elif defined(__AVX__)
#define LANES 4
#else
#define LANES 2
#endif

#define STATES (2 * DOFS) /* position and, to be of the same size, velocity times the sample interval */
#define LOADS (2 * CARRIAGES)
#define WIDTH (STATES + 2) /* with the input and its rise over the interval */
#define TERMS 12          /* of the exponential's series; with a norm of 1/4 the next is below rounding */

typedef double lanes __attribute__((vector_size(8 * LANES)));
typedef lanes square[WIDTH][WIDTH];

/* Compilers give it as one instruction each. */
static inline lanes smaller(lanes a, lanes b) {
    lanes out;
    for (int l = 0; l < LANES; l++) out[l] = a[l] < b[l] ? a[l] : b[l];
    return out;
}

static inline lanes larger(lanes a, lanes b) {
    lanes out;
    for (int l = 0; l < LANES; l++) out[l] = a[l] > b[l] ? a[l] : b[l];
    return out;
}

/* A symmetric matrix becomes L D below its diagonal, and D on it. */
static void factor(lanes a[DOFS][DOFS]) {
    for (int j = 0; j < DOFS; j++)
        for (int i = j; i < DOFS; i++)
            for (int k = 0; k < j; k++) a[i][j] -= a[i][k] * a[j][k] / a[k][k];
}

static void solve(lanes a[DOFS][DOFS], lanes x[DOFS]) {
    for (int i = 0; i < DOFS; i++)
        for (int k = 0; k < i; k++) x[i] -= a[i][k] / a[k][k] * x[k];
    for (int i = DOFS - 1; i >= 0; i--) {
        x[i] /= a[i][i];
        for (int k = i + 1; k < DOFS; k++) x[i] -= a[k][i] / a[i][i] * x[k];
    }
}

static void multiply(square a, square b, square out) {
    for (int i = 0; i < WIDTH; i++) {
        lanes row[WIDTH] = {0};
        for (int k = 0; k < WIDTH; k++)
            for (int j = 0; j < WIDTH; j++) row[j] += a[i][k] * b[k][j];
        for (int j = 0; j < WIDTH; j++) out[i][j] = row[j];
    }
}

/* e = exp(z), by its series and squarings; z is lost. */
static void exponential(square z, square e) {
    static _Thread_local square other;
    double norm = 0.0;
    for (int l = 0; l < LANES; l++)
        for (int i = 0; i < WIDTH; i++) {
            double sum = 0.0;
            for (int j = 0; j < WIDTH; j++) sum += z[i][j][l] < 0.0 ? -z[i][j][l] : z[i][j][l];
            norm = sum > norm ? sum : norm;
        }
    int squarings = 0;
    double scale = 1.0;
    for (; norm * scale > 0.25; scale *= 0.5) squarings++;
    for (int i = 0; i < WIDTH; i++)
        for (int j = 0; j < WIDTH; j++) {
            z[i][j] *= scale;
            e[i][j] = (lanes){0} + (i == j);
        }
    for (int term = TERMS; term > 0; term--) {
        multiply(z, e, other);
        for (int i = 0; i < WIDTH; i++)
            for (int j = 0; j < WIDTH; j++) e[i][j] = other[i][j] / (double)term + (i == j);
    }
    for (; squarings > 0; squarings--) {
        multiply(e, e, other);
        for (int i = 0; i < WIDTH; i++)
            for (int j = 0; j < WIDTH; j++) e[i][j] = other[i][j];
    }
}

typedef struct {
    lanes p[STATES][STATES], g0[STATES], g1[STATES]; /* matrices by columns */
    lanes c[STATES][LOADS], rest[LOADS];
} System;

/* What all scenes have in common. */
typedef struct {
    const int *free;            /* (DOFS) of x y z rx ry rz */
    const double *inertia;      /* (3, 3) about the centre of mass */
    const double *gravity;      /* (3) */
    const double *stiff, *damp; /* (CARRIAGES, DOFS, DOFS) */
    const double *elastic, *damped; /* (LOADS, DOFS) */
    double step;
} Known;

static void set_up(const Known *known, lanes mass, const lanes r[3], const lanes k[CARRIAGES], const lanes b[CARRIAGES],
                   System *to) {
    static _Thread_local square z, e;
    const lanes none = {0};
    const double h = known->step;
    lanes s[3][3] = {{none, -r[2], r[1]}, {r[2], none, -r[0]}, {-r[1], r[0], none}};
    lanes inertia[6][6];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            lanes square = none;
            for (int l = 0; l < 3; l++) square += s[i][l] * s[l][j];
            inertia[i][j] = i == j ? mass : none;
            inertia[i][3 + j] = -mass * s[i][j];
            inertia[3 + i][j] = mass * s[i][j];
            inertia[3 + i][3 + j] = known->inertia[3 * i + j] - mass * square;
        }
    lanes m[DOFS][DOFS], stiffness[DOFS][DOFS], elastic[DOFS][DOFS], damping[DOFS][DOFS], drive[DOFS], sag[DOFS];
    for (int i = 0; i < DOFS; i++) {
        const lanes *row = inertia[known->free[i]];
        drive[i] = -row[0];
        sag[i] = none;
        for (int l = 0; l < 3; l++) sag[i] += row[l] * known->gravity[l];
        for (int j = 0; j < DOFS; j++) {
            m[i][j] = row[known->free[j]];
            stiffness[i][j] = damping[i][j] = none;
            for (int of = 0; of < CARRIAGES; of++) {
                stiffness[i][j] += k[of] * known->stiff[(of * DOFS + i) * DOFS + j];
                damping[i][j] += b[of] * known->damp[(of * DOFS + i) * DOFS + j];
            }
            elastic[i][j] = stiffness[i][j];
        }
    }
    factor(m);
    solve(m, drive);
    factor(elastic);
    solve(elastic, sag);
    for (int i = 0; i < WIDTH; i++)
        for (int j = 0; j < WIDTH; j++) z[i][j] = none;
    for (int j = 0; j < DOFS; j++) {
        /* Column j; both matrices are symmetric. */
        solve(m, stiffness[j]);
        solve(m, damping[j]);
        for (int i = 0; i < DOFS; i++) {
            z[DOFS + i][j] = -h * h * stiffness[j][i];
            z[DOFS + i][DOFS + j] = -h * damping[j][i];
        }
        z[j][DOFS + j] += 1.0;
        z[DOFS + j][STATES] = h * h * drive[j];
    }
    z[STATES][STATES + 1] += 1.0;
    exponential(z, e);
    for (int i = 0; i < STATES; i++) {
        for (int j = 0; j < STATES; j++) to->p[j][i] = e[i][j];
        to->g0[i] = e[i][STATES] - e[i][STATES + 1];
        to->g1[i] = e[i][STATES + 1];
    }
    for (int o = 0; o < LOADS; o++) {
        to->rest[o] = none;
        for (int j = 0; j < DOFS; j++) {
            to->c[j][o] = k[o / 2] * known->elastic[o * DOFS + j];
            to->c[DOFS + j][o] = b[o / 2] * known->damped[o * DOFS + j] / h;
            to->rest[o] += to->c[j][o] * sag[j];
        }
    }
}

static void march(const System *of, const double *u, long samples, lanes peak[LOADS]) {
    lanes x[STATES] = {0}, low[LOADS], high[LOADS];
    for (int o = 0; o < LOADS; o++) low[o] = high[o] = of->rest[o];
    for (long k = 0; k + 1 < samples; k++) {
        lanes next[STATES], load[LOADS];
        for (int i = 0; i < STATES; i++) next[i] = of->g0[i] * u[k] + of->g1[i] * u[k + 1];
#pragma GCC unroll 16
        for (int j = 0; j < STATES; j++)
            for (int i = 0; i < STATES; i++) next[i] += of->p[j][i] * x[j];
        for (int o = 0; o < LOADS; o++) load[o] = of->rest[o];
#pragma GCC unroll 16
        for (int j = 0; j < STATES; j++)
            for (int o = 0; o < LOADS; o++) load[o] += of->c[j][o] * next[j];
        for (int o = 0; o < LOADS; o++) low[o] = smaller(low[o], load[o]);
        for (int o = 0; o < LOADS; o++) high[o] = larger(high[o], load[o]);
        for (int i = 0; i < STATES; i++) x[i] = next[i];
    }
    for (int o = 0; o < LOADS; o++) peak[o] = larger(high[o], -low[o]);
}

/* mass (scenes), center (scenes, 3), stiffness and damping (scenes, CARRIAGES) times those of `known`, u (samples), peaks
 * (scenes, LOADS). */
void peaks(const Known *known, long scenes, const double *mass, const double *center, const double *stiffness,
           const double *damping, long samples, const double *u, double *peaks) {
    for (long first = 0; first < scenes; first += LANES) {
        lanes m, r[3], k[CARRIAGES], b[CARRIAGES], peak[LOADS];
        System system;
        for (int l = 0; l < LANES; l++) {
            /* Lanes without a scene of their own repeat the last one. */
            const long scene = first + l < scenes ? first + l : scenes - 1;
            m[l] = mass[scene];
            for (int i = 0; i < 3; i++) r[i][l] = center[3 * scene + i];
            for (int of = 0; of < CARRIAGES; of++) {
                k[of][l] = stiffness[CARRIAGES * scene + of];
                b[of][l] = damping[CARRIAGES * scene + of];
            }
        }
        set_up(known, m, r, k, b, &system);
        march(&system, u, samples, peak);
        for (int l = 0; l < LANES && first + l < scenes; l++)
            for (int o = 0; o < LOADS; o++) peaks[LOADS * (first + l) + o] = peak[o][l];
    }
}
