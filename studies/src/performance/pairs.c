/* The pair sum of (2) for beta = 1, 2 with cut-off 1, each pair once: prints the median seconds of an evaluation.
   Built without contraction it uses only exact operations; with UNRESTRICTED it may use whatever is fastest. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double cpu(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double *column(int n) {
    double *c = aligned_alloc(64, ((size_t)n * sizeof(double) + 63) / 64 * 64);
    if (!c) exit(1);
    return c;
}

static void forces(int n, const double *restrict x, const double *restrict y, const double *restrict z,
                   double *restrict fx, double *restrict fy, double *restrict fz) {
    const double attraction = 0.5, repulsion = -0.25;
    for (int i = 0; i < n; i++) fx[i] = fy[i] = fz[i] = 0.0;
    for (int i = 0; i < n; i++) {
        double sx = 0.0, sy = 0.0, sz = 0.0;
#pragma omp simd reduction(+ : sx, sy, sz)
        for (int j = i + 1; j < n; j++) {
            double dx = x[j] - x[i], dy = y[j] - y[i], dz = z[j] - z[i];
            double square = dx * dx + dy * dy + dz * dz;
#ifdef UNRESTRICTED
            double inverse = 1.0f / sqrtf((float)square);
            inverse = inverse * (1.5 - 0.5 * square * inverse * inverse);
#else
            double inverse = 1.0 / sqrt(square);
#endif
            double pull = (attraction + repulsion * inverse) * (inverse * inverse);
            pull = square <= 1.0 ? pull : 0.0;
            double px = pull * dx, py = pull * dy, pz = pull * dz;
            sx += px;
            sy += py;
            sz += pz;
            fx[j] -= px;
            fy[j] -= py;
            fz[j] -= pz;
        }
        fx[i] += sx;
        fy[i] += sy;
        fz[i] += sz;
    }
}

int main(int count, char **arguments) {
    FILE *file = count == 2 ? fopen(arguments[1], "r") : NULL;
    int n, repetitions;
    if (!file || fscanf(file, "%d %d", &n, &repetitions) != 2) return 1;
    double *x = column(n), *y = column(n), *z = column(n), *fx = column(n), *fy = column(n), *fz = column(n);
    for (int i = 0; i < n; i++)
        if (fscanf(file, "%lf %lf %lf", x + i, y + i, z + i) != 3) return 1;
    double each[3];
    for (int k = 0; k < 3; k++) {
        double start = cpu();
        for (int r = 0; r < repetitions; r++) forces(n, x, y, z, fx, fy, fz);
        each[k] = (cpu() - start) / repetitions;
    }
    qsort(each, 3, sizeof(double), ascending);
    /* The force keeps the loop from being left out. */
    if (fx[0] == 42.0) puts("");
    printf("%.9e\n", each[1]);
    return 0;
}
