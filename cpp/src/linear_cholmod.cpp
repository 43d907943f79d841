/// Symmetric factorisations by CHOLMOD: supernodal LLᵀ, and simplicial LDLᵀ as a reference for
/// tests: it is right and slow.
#include <algorithm>
#include <cmath>

#include "cholmod_library.hpp"
#include "linear_backend.hpp"
#include "suitesparse.hpp"

namespace supple {
namespace {

/// CHOLMOD's header on a vector of ours; CHOLMOD does not write through it.
cholmod_dense vector_view(const double* values, std::size_t size) {
  cholmod_dense b{};
  b.nrow = b.nzmax = b.d = size;
  b.ncol = 1;
  b.x = const_cast<double*>(values);
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  return b;
}

class Cholmod final : public Backend {
 public:
  explicit Cholmod(Kind kind)
      : kind_(kind), lib_(kind == Kind::Cholesky ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL) {}

  void analyse(const CscPattern& pattern) override {
    matrix_ = lower_view(pattern.start, pattern.row);
    lib_.analyse(pattern);
  }

  FactorStatus factorise(double* values) override {
    const SerialOpenMp serial;
    matrix_.x = values;
    matrix_.xtype = CHOLMOD_REAL;
    cholmod_l_factorize(&matrix_, lib_.factor, &lib_.common);
    lib_.require_ok("factorisation");
    const std::size_t failed = lib_.factor->minor;
    if (failed >= lib_.factor->n) return {};
    return {kind_ == Kind::Cholesky ? FactorStatus::Cause::NotPositiveDefinite
                                    : FactorStatus::Cause::Singular,
            static_cast<const Long*>(lib_.factor->Perm)[failed]};
  }

  void solve(const double* rhs, double* x) override {
    const SerialOpenMp serial;
    cholmod_dense b = vector_view(rhs, lib_.factor->n);
    cholmod_l_solve2(CHOLMOD_A, lib_.factor, &b, nullptr, &lib_.x, nullptr, &lib_.y, &lib_.e,
                     &lib_.common);
    lib_.require_ok("solve");
    std::copy_n(static_cast<const double*>(lib_.x->x), lib_.factor->n, x);
  }

  Inertia inertia() const override {
    const cholmod_factor& f = *lib_.factor;
    const auto* start = static_cast<const Long*>(f.p);
    const auto* count = static_cast<const Long*>(f.nz);
    const auto* row = static_cast<const Long*>(f.i);
    const auto* value = static_cast<const double*>(f.x);
    Inertia result;
    std::vector<double> diagonal(f.n, 0.0); // of |L||D||Lᵀ|
    for (std::size_t k = 0; k < f.n; ++k) {
      const double pivot = value[start[k]];
      ++(pivot < 0.0 ? result.negative : pivot > 0.0 ? result.positive : result.zero);
      diagonal[k] += std::abs(pivot);
      for (Long p = start[k] + 1; p < start[k] + count[k]; ++p)
        diagonal[static_cast<std::size_t>(row[p])] += value[p] * value[p] * std::abs(pivot);
    }
    const auto* a = static_cast<const double*>(matrix_.x);
    const double scale = std::abs(*std::max_element(
        a, a + matrix_.nzmax, [](double l, double r) { return std::abs(l) < std::abs(r); }));
    result.growth = *std::max_element(diagonal.begin(), diagonal.end()) / scale;
    return result;
  }

  double flops() const override { return lib_.flops; }
  double nonzeros() const override { return lib_.nonzeros; }
  const char* ordering() const override { return lib_.ordering; }

 private:
  Kind kind_;
  CholmodLibrary lib_;
  cholmod_sparse matrix_{};
};

} // namespace

std::unique_ptr<Backend> make_cholmod(Kind kind) {
  return std::make_unique<Cholmod>(kind);
}

} // namespace supple
