/* Kernels by hand for the tests: six springs along the edges of a tetrahedron, LANES cells a call.
 *
 * Energy of a spring k/2 e², e = (|d|² − |D|²)/2, d and D its vectors now and at rest; its force is
 * k e d, its tangent k (d dᵀ + e I). The tangent gives the lower triangle only and spoils the rest.
 */
#include "supple/kernel.h"

#define EACH_EDGE(a, b)                                                                            \
  for (int b = 1; b < 4; ++b)                                                                      \
    for (int a = 0; a < b; ++a)

static double elongation(const double* w, const double* x, int a, int b, int lane, double* d) {
  double e = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double rest = x[(3 * b + i) * LANES + lane] - x[(3 * a + i) * LANES + lane];
    d[i] = rest + w[(3 * b + i) * LANES + lane] - w[(3 * a + i) * LANES + lane];
    e += 0.5 * (d[i] * d[i] - rest * rest);
  }
  return e;
}

static void energy(double* A, const double* w, const double* x) {
  double d[3];
  for (int lane = 0; lane < LANES; ++lane)
    EACH_EDGE(a, b) {
      const double e = elongation(w, x, a, b, lane, d);
      A[lane] += 0.5 * w[12 * LANES + lane] * e * e;
    }
}

static void residual(double* A, const double* w, const double* x) {
  double d[3];
  for (int lane = 0; lane < LANES; ++lane)
    EACH_EDGE(a, b) {
      const double e = elongation(w, x, a, b, lane, d);
      for (int i = 0; i < 3; ++i) {
        A[(3 * b + i) * LANES + lane] += w[12 * LANES + lane] * e * d[i];
        A[(3 * a + i) * LANES + lane] -= w[12 * LANES + lane] * e * d[i];
      }
    }
}

static void tangent(double* A, const double* w, const double* x) {
  double d[3];
  for (int lane = 0; lane < LANES; ++lane) {
    EACH_EDGE(a, b) {
      const double e = elongation(w, x, a, b, lane, d), k = w[12 * LANES + lane];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const double stiffness = k * (d[i] * d[j] + (i == j ? e : 0.0));
          A[((3 * a + i) * 12 + 3 * a + j) * LANES + lane] += stiffness;
          A[((3 * b + i) * 12 + 3 * b + j) * LANES + lane] += stiffness;
          A[((3 * b + i) * 12 + 3 * a + j) * LANES + lane] -= stiffness;
        }
    }
    for (int r = 0; r < 12; ++r)
      for (int c = r + 1; c < 12; ++c)
        A[(r * 12 + c) * LANES + lane] = 1e30;
  }
}

/* 1 + e of the edge 0–1. */
static void volume_ratio(double* A, const double* w, const double* x) {
  double d[3];
  for (int lane = 0; lane < LANES; ++lane)
    A[lane] += 1.0 + elongation(w, x, 0, 1, lane, d);
}

static const double points[3] = {0.25, 0.25, 0.25}, weights[1] = {1.0 / 6.0};
static const supple_field fields[2] = {{"u", 12}, {"stiffness", 1}};
static const int both[2] = {0, 1};
static const supple_kernel kernels[4] = {{"energy", 1, 1, 0, 2, both, energy},
                                         {"residual", 12, 1, 0, 2, both, residual},
                                         {"tangent", 12, 12, 1, 2, both, tangent},
                                         {"volume_ratio", 1, 1, 0, 1, both, volume_ratio}};
static const supple_library table = {
    SUPPLE_KERNEL_ABI, "springs", "",     "P1", 4,      0, LANES, 0, 1, 3, points,
    weights,           2,         fields, 4,    kernels};

const supple_library* supple_kernels(void) {
  return &table;
}
