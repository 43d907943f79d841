/// Symmetric factorisations by CHOLMOD: supernodal LLᵀ and simplicial LDLᵀ.
#include <cholmod.h>
#include <omp.h>

#include <algorithm>
#include <cmath>

#include "group_graph.hpp"
#include "linear_backend.hpp"
#include "suitesparse.hpp"

namespace supple {
namespace {

/// Keeps CHOLMOD from opening OpenMP threads of its own, which would fight for the cores with ours.
/// Before CHOLMOD 5 their number (4) is compiled in and only the nesting limit holds it; from
/// CHOLMOD 5 on Common.nthreads_max does.
struct SerialOpenMp {
#if CHOLMOD_MAIN_VERSION < 5
  int levels = omp_get_max_active_levels();
  SerialOpenMp() { omp_set_max_active_levels(0); }
  ~SerialOpenMp() { omp_set_max_active_levels(levels); }
#else
  SerialOpenMp() {}
  ~SerialOpenMp() {}
#endif
  SerialOpenMp(const SerialOpenMp&) = delete;
  SerialOpenMp& operator=(const SerialOpenMp&) = delete;
};

/// CHOLMOD's settings, work space and results, freed in the right order.
struct Library {
  cholmod_common common;
  cholmod_factor* factor = nullptr;
  cholmod_dense* x = nullptr;
  cholmod_dense* y = nullptr;
  cholmod_dense* e = nullptr;

  explicit Library(Kind kind) {
    cholmod_l_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    common.supernodal = kind == Kind::Cholesky ? CHOLMOD_SUPERNODAL : CHOLMOD_SIMPLICIAL;
    common.final_ll = 0;
    common.quick_return_if_not_posdef = 1;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_GIVEN;
    common.postorder = 1;
#if CHOLMOD_MAIN_VERSION >= 5
    common.nthreads_max = 1;
#endif
  }
  ~Library() {
    release();
    cholmod_l_finish(&common);
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  void release() {
    cholmod_l_free_factor(&factor, &common);
    for (cholmod_dense** d : {&x, &y, &e})
      cholmod_l_free_dense(d, &common);
  }

  /// A negative status is an error; a positive one (not positive definite) is an answer.
  void require_ok(const char* stage) const {
    if (common.status >= CHOLMOD_OK) return;
    const bool memory =
        common.status == CHOLMOD_OUT_OF_MEMORY || common.status == CHOLMOD_TOO_LARGE;
    throw library_error("CHOLMOD", stage, common.status, memory);
  }
};

/// CHOLMOD's header on a lower triangle of ours; CHOLMOD does not write through it.
cholmod_sparse lower_view(const std::vector<std::int64_t>& start,
                          const std::vector<std::int64_t>& row) {
  cholmod_sparse a{};
  a.nrow = a.ncol = start.size() - 1;
  a.nzmax = row.size();
  a.p = const_cast<std::int64_t*>(start.data());
  a.i = const_cast<std::int64_t*>(row.data());
  a.stype = -1;
  a.itype = CHOLMOD_LONG;
  a.xtype = CHOLMOD_PATTERN;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = a.packed = 1;
  return a;
}

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
  explicit Cholmod(Kind kind) : kind_(kind), lib_(kind) {}

  void analyse(const CscPattern& pattern) override {
    const SerialOpenMp serial;
    lib_.release();
    matrix_ = lower_view(pattern.start, pattern.row);
    const GroupGraph graph(pattern);
    cholmod_sparse nodes = lower_view(graph.start, graph.row);
    std::vector<std::int64_t> order(nodes.nrow);
    if (cholmod_l_amd(&nodes, nullptr, 0, as_long(order), &lib_.common) != 0)
      keep_if_better(graph.expand(order), "AMD");
#ifndef NPARTITION
    if (cholmod_l_metis(&nodes, nullptr, 0, 1, as_long(order), &lib_.common) != 0)
      keep_if_better(graph.expand(order), "METIS");
#endif
    if (lib_.factor == nullptr) lib_.require_ok("analysis");
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

  double flops() const override { return flops_; }
  double nonzeros() const override { return nonzeros_; }
  const char* ordering() const override { return ordering_; }

 private:
  void keep_if_better(std::vector<std::int64_t> order, const char* name) {
    cholmod_factor* factor =
        cholmod_l_analyze_p(&matrix_, as_long(order), nullptr, 0, &lib_.common);
    if (factor != nullptr && (lib_.factor == nullptr || lib_.common.fl < flops_)) {
      std::swap(factor, lib_.factor);
      flops_ = lib_.common.fl;
      nonzeros_ = lib_.common.lnz;
      ordering_ = name;
    }
    cholmod_l_free_factor(&factor, &lib_.common);
  }

  Kind kind_;
  Library lib_;
  cholmod_sparse matrix_{};
  double flops_ = 0.0, nonzeros_ = 0.0;
  const char* ordering_ = "none";
};

} // namespace

std::unique_ptr<Backend> make_cholmod(Kind kind) {
  return std::make_unique<Cholmod>(kind);
}

} // namespace supple
