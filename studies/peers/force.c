/* The pair law of agglo's near field, for REBOUND: force on i along n_ij, (a1 s^-b1 - a2 s^-b2) w_ij, w_ij = 1 or m_i m_j. */
#include <math.h>

static long at_n, at_particles, size, at_mass;
static double strength[2];
static int exponent[2], mass_product;
static long evaluations;

void set_layout(long n, long particles, long particle_size, long mass) {
    at_n = n, at_particles = particles, size = particle_size, at_mass = mass;
}

void set_law(double a1, int b1, double a2, int b2, int product) {
    strength[0] = a1, strength[1] = a2, exponent[0] = b1, exponent[1] = b2, mass_product = product;
}

long get_evaluations(void) { return evaluations; }
void reset_evaluations(void) { evaluations = 0; }

static inline double power(double inverse, int n) {
    double p = 1.0;
    while (n-- > 0) p *= inverse;
    return p;
}

/* A particle begins with x y z vx vy vz ax ay az. */
void add_forces(char *sim) {
    const int n = *(int *)(sim + at_n);
    char *particles = *(char **)(sim + at_particles);
    evaluations++;
    for (int i = 0; i < n; i++) {
        double *p = (double *)(particles + i * size);
        const double mi = *(double *)(particles + i * size + at_mass);
        for (int j = i + 1; j < n; j++) {
            double *q = (double *)(particles + j * size);
            const double mj = *(double *)(particles + j * size + at_mass);
            const double dx = q[0] - p[0], dy = q[1] - p[1], dz = q[2] - p[2];
            const double inverse = 1.0 / sqrt(dx * dx + dy * dy + dz * dz);
            double f = (strength[0] * power(inverse, exponent[0]) - strength[1] * power(inverse, exponent[1])) * inverse;
            if (mass_product) f *= mi * mj;
            p[6] += f / mi * dx, p[7] += f / mi * dy, p[8] += f / mi * dz;
            q[6] -= f / mj * dx, q[7] -= f / mj * dy, q[8] -= f / mj * dz;
        }
    }
}
