#include "chebyshev.hpp"

#include <cmath>
#include <Eigen/Eigenvalues>

namespace supple {
namespace {

constexpr double kRange = 10.0; // largest over smallest eigenvalue that is smoothed
constexpr double kMargin = 1.1; // over what Lanczos' method has found
constexpr int kLanczosSteps = 12;
constexpr Index kWorthThreads = 2000;

/// out = D⁻¹ in of block row i.
template <int Size, class Real>
inline void solve_block(const Real* inverse, Index i, const Real* in, Real* out) {
  const Real* block = inverse + std::ptrdiff_t{Size} * Size * i;
  for (int r = 0; r < Size; ++r)
    out[r] = Real{};
  for (int c = 0; c < Size; ++c)
    for (int r = 0; r < Size; ++r)
      out[r] += block[Size * c + r] * in[c];
}

Vector solve_blocks(const BlockMatrix<double>& A, const std::vector<double>& inverse,
                    const Vector& r) {
  Vector z(r.size());
#pragma omp parallel for schedule(static) if (A.rows > kWorthThreads)
  for (Index i = 0; i < A.rows; ++i) {
    const std::ptrdiff_t at = std::ptrdiff_t{A.height} * i;
    if (A.height == 3)
      solve_block<3>(inverse.data(), i, r.data() + at, z.data() + at);
    else
      solve_block<6>(inverse.data(), i, r.data() + at, z.data() + at);
  }
  return z;
}

} // namespace

void Chebyshev::update(const std::vector<double>& inverse, double largest) {
  inverse_.assign(inverse.begin(), inverse.end());
  // Saad (2003), algorithm 12.1, two steps.
  const double theta = 0.5 * largest * (1.0 + 1.0 / kRange);
  const double delta = 0.5 * largest * (1.0 - 1.0 / kRange);
  const double sigma = theta / delta, rho = 1.0 / (2.0 * sigma - 1.0 / sigma);
  scale_ = static_cast<float>(1.0 / theta);
  old_part_ = static_cast<float>(rho / sigma);
  part_ = static_cast<float>(2.0 * rho / delta);
}

void Chebyshev::first(const BlockMatrix<float>& A, const std::vector<float>& r,
                      std::vector<float>& x, bool add) {
  step_.resize(r.size());
  new_step_.resize(r.size());
  const auto work = [&](auto size) {
    constexpr int n = decltype(size)::value;
#pragma omp parallel for schedule(static) if (A.rows > kWorthThreads)
    for (Index i = 0; i < A.rows; ++i) {
      const std::ptrdiff_t at = std::ptrdiff_t{n} * i;
      float* d = step_.data() + at;
      solve_block<n>(inverse_.data(), i, r.data() + at, d);
      for (int c = 0; c < n; ++c) {
        d[c] *= scale_;
        x[static_cast<std::size_t>(at + c)] =
            (add ? x[static_cast<std::size_t>(at + c)] : 0.0F) + d[c];
      }
    }
  };
  A.height == 3 ? work(std::integral_constant<int, 3>()) : work(std::integral_constant<int, 6>());
}

void Chebyshev::next(const BlockMatrix<float>& A, std::vector<float>& r, std::vector<float>& x) {
  subtract_product(A, step_.data(), r.data());
  const auto work = [&](auto size) {
    constexpr int n = decltype(size)::value;
#pragma omp parallel for schedule(static) if (A.rows > kWorthThreads)
    for (Index i = 0; i < A.rows; ++i) {
      const std::ptrdiff_t at = std::ptrdiff_t{n} * i;
      float z[n];
      solve_block<n>(inverse_.data(), i, r.data() + at, z);
      for (int c = 0; c < n; ++c) {
        float& d = step_[static_cast<std::size_t>(at + c)];
        d = old_part_ * d + part_ * z[c];
        x[static_cast<std::size_t>(at + c)] += d;
      }
    }
  };
  A.height == 3 ? work(std::integral_constant<int, 3>()) : work(std::integral_constant<int, 6>());
}

void Chebyshev::start(const BlockMatrix<float>& A, std::vector<float>& r, std::vector<float>& x) {
  first(A, r, x, false);
  next(A, r, x);
  subtract_product(A, step_.data(), r.data());
}

void Chebyshev::correct(const BlockMatrix<float>& A, const BlockMatrix<float>& P,
                        const std::vector<float>& e, std::vector<float>& r, std::vector<float>& x) {
  multiply(P, e.data(), step_.data());
  for (std::size_t k = 0; k < x.size(); ++k)
    x[k] += step_[k];
  subtract_product(A, step_.data(), r.data());
}

void Chebyshev::improve(const BlockMatrix<float>& A, std::vector<float>& r, std::vector<float>& x) {
  first(A, r, x, true);
  next(A, r, x);
}

double largest_eigenvalue(const BlockMatrix<double>& A, const std::vector<double>& inverse) {
  const Eigen::Index size = Eigen::Index{A.rows} * A.height;
  Vector v(size), before = Vector::Zero(size), w(size);
  for (Eigen::Index i = 0; i < size; ++i)
    v[i] = std::sin(static_cast<double>(i % 7919) + 1.0); // rough, and the same each time
  Vector z = solve_blocks(A, inverse, v);
  Vector diagonal = Vector::Zero(kLanczosSteps), beside = Vector::Zero(kLanczosSteps - 1);
  double beta = std::sqrt(dot(v, z));
  int steps = 0;
  // Lanczos in the inner product of D⁻¹: v = D z, ‖v‖² = v·z = 1.
  for (; steps < kLanczosSteps && beta > 0.0; ++steps) {
    v /= beta;
    z /= beta;
    multiply(A, z.data(), w.data());
    if (steps > 0) w -= beta * before;
    const double alpha = dot(w, z);
    diagonal[steps] = alpha;
    w -= alpha * v;
    before.swap(v);
    v.swap(w);
    z = solve_blocks(A, inverse, v);
    const double square = dot(v, z);
    beta = square > 1e-24 * alpha * alpha ? std::sqrt(square) : 0.0;
    if (steps + 1 < kLanczosSteps) beside[steps] = beta;
  }
  if (steps == 0) return 1.0;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal.head(steps), beside.head(steps - 1),
                                Eigen::EigenvaluesOnly);
  return kMargin * solver.eigenvalues().maxCoeff();
}

} // namespace supple
