/// Unsymmetric LU by UMFPACK: METIS where the library has it, AMD else.
#include <umfpack.h>

#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "linear_backend.hpp"
#include "suitesparse.hpp"

namespace supple {
namespace {

/// A negative status is an error; a positive one (singular) is an answer.
void require_ok(int status, const char* stage) {
  if (status < 0)
    throw library_error("UMFPACK", stage, status, status == UMFPACK_ERROR_out_of_memory);
}

/// A symmetric matrix in full, from its lower triangle.
struct Mirror {
  CscPattern full;
  std::vector<std::int64_t> source; ///< of each entry, in the lower triangle
  std::vector<double> values;

  explicit Mirror(const CscPattern& lower) {
    std::vector<std::vector<std::pair<std::int64_t, std::int64_t>>> column(
        static_cast<std::size_t>(lower.size)); // rows ascend: those above come from earlier columns
    for (std::int64_t c = 0; c < lower.size; ++c)
      for (std::int64_t k = lower.start[static_cast<std::size_t>(c)];
           k < lower.start[static_cast<std::size_t>(c) + 1]; ++k) {
        const std::int64_t r = lower.row[static_cast<std::size_t>(k)];
        column[static_cast<std::size_t>(c)].emplace_back(r, k);
        if (r != c) column[static_cast<std::size_t>(r)].emplace_back(c, k);
      }
    full.size = lower.size;
    full.start.push_back(0);
    for (const auto& entries : column) {
      for (const auto& [row, k] : entries) {
        full.row.push_back(row);
        source.push_back(k);
      }
      full.start.push_back(full.nonzeros());
    }
    values.resize(source.size());
  }

  double* fill(const double* lower) {
    for (std::size_t k = 0; k < source.size(); ++k)
      values[k] = lower[source[k]];
    return values.data();
  }
};

class Umfpack final : public Backend {
 public:
  Umfpack() {
    umfpack_dl_defaults(control_.data());
    control_[UMFPACK_PRL] = 0;
    control_[UMFPACK_IRSTEP] = 0; // Factor refines
  }
  ~Umfpack() override { release(); }
  Umfpack(const Umfpack&) = delete;
  Umfpack& operator=(const Umfpack&) = delete;

  void analyse(const CscPattern& pattern) override {
    release();
    mirror_ = pattern.lower ? std::make_unique<Mirror>(pattern) : nullptr;
    pattern_ = mirror_ ? &mirror_->full : &pattern;
    const auto n = static_cast<std::size_t>(pattern.size);
    work_int_.resize(n);
    work_.resize(5 * n);
    if (analyse_with(UMFPACK_ORDERING_METIS) < 0)
      require_ok(analyse_with(UMFPACK_ORDERING_AMD), "analysis");
    // Exact unless pivots leave the diagonal; the other estimates of UMFPACK are bounds far above.
    flops_ = info_[UMFPACK_SYMMETRIC_FLOPS];
    nonzeros_ = info_[UMFPACK_SYMMETRIC_LUNZ];
  }

  FactorStatus factorise(double* values) override {
    umfpack_dl_free_numeric(&numeric_);
    values_ = mirror_ ? mirror_->fill(values) : values;
    const auto status =
        umfpack_dl_numeric(as_long(pattern_->start), as_long(pattern_->row), values_, symbolic_,
                           &numeric_, control_.data(), info_.data());
    require_ok(static_cast<int>(status), "factorisation");
    flops_ = info_[UMFPACK_FLOPS];
    nonzeros_ = info_[UMFPACK_LNZ] + info_[UMFPACK_UNZ];
    if (status == UMFPACK_WARNING_singular_matrix)
      return {FactorStatus::Cause::Singular, failed_column()};
    return {};
  }

  void solve(const double* rhs, double* x) override {
    const auto status = umfpack_dl_wsolve(
        UMFPACK_A, as_long(pattern_->start), as_long(pattern_->row), values_, x, rhs, numeric_,
        control_.data(), info_.data(), work_int_.data(), work_.data());
    require_ok(static_cast<int>(status), "solve");
  }

  Inertia inertia() const override { return {}; }
  double flops() const override { return flops_; }
  double nonzeros() const override { return nonzeros_; }
  const char* ordering() const override {
    return info_[UMFPACK_ORDERING_USED] == UMFPACK_ORDERING_METIS ? "METIS" : "AMD";
  }

 private:
  int analyse_with(int ordering) {
    // Without values UMFPACK takes the diagonal for zero and gives the symmetric strategy up, which
    // doubles the flops; ones say that it is not, and mean nothing else here.
    const std::vector<double> ones(pattern_->row.size(), 1.0);
    control_[UMFPACK_ORDERING] = ordering;
    const auto n = static_cast<Long>(pattern_->size);
    return static_cast<int>(umfpack_dl_symbolic(n, n, as_long(pattern_->start),
                                                as_long(pattern_->row), ones.data(), &symbolic_,
                                                control_.data(), info_.data()));
  }

  /// Column of the first pivot that is zero.
  std::int64_t failed_column() const {
    const auto n = static_cast<std::size_t>(pattern_->size);
    std::vector<Long> q(n);
    std::vector<double> pivots(n);
    Long reciprocal = 0;
    umfpack_dl_get_numeric(nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, q.data(),
                           pivots.data(), &reciprocal, nullptr, numeric_);
    for (std::size_t k = 0; k < n; ++k)
      if (!(std::abs(pivots[k]) > 0.0)) return q[k];
    return -1;
  }

  void release() {
    umfpack_dl_free_numeric(&numeric_);
    umfpack_dl_free_symbolic(&symbolic_);
  }

  std::array<double, UMFPACK_CONTROL> control_{};
  std::array<double, UMFPACK_INFO> info_{};
  std::unique_ptr<Mirror> mirror_; // where the pattern given is a lower triangle
  const CscPattern* pattern_ = nullptr;
  const double* values_ = nullptr;
  void* symbolic_ = nullptr;
  void* numeric_ = nullptr;
  std::vector<Long> work_int_;
  std::vector<double> work_;
  double flops_ = 0.0, nonzeros_ = 0.0;
};

} // namespace

std::unique_ptr<Backend> make_umfpack() {
  return std::make_unique<Umfpack>();
}

} // namespace supple
