/// Factorisations by MKL's Pardiso, whose library is loaded while the program runs.
#include <dlfcn.h>
#include <omp.h>

#include <array>
#include <vector>

#include "linear_backend.hpp"
#include "supple/error.hpp"
#include "supple/pardiso.hpp"

namespace supple {
namespace {

using Long = std::int64_t;
using PardisoCall = void(void* const* handle, const Long* max_factors, const Long* factor,
                         const Long* type, const Long* phase, const Long* size, const void* values,
                         const Long* start, const Long* index, Long* permutation,
                         const Long* right_hand_sides, Long* settings, const Long* verbosity,
                         void* rhs, void* x, Long* error);

/// What is used of MKL; null until it is loaded.
struct Mkl {
  PardisoCall* pardiso = nullptr;
  int (*set_threads)(int) = nullptr; ///< of the calling thread; the number before
};
Mkl& mkl() {
  static Mkl loaded;
  return loaded;
}

/// MKL may use the threads of the OpenMP that we share, not more, for as long as this lives.
class MklThreads {
 public:
  MklThreads() : before_(mkl().set_threads(omp_get_max_threads())) {}
  ~MklThreads() { mkl().set_threads(before_); }
  MklThreads(const MklThreads&) = delete;
  MklThreads& operator=(const MklThreads&) = delete;

 private:
  int before_;
};

// Numbers of Pardiso's interface: phases, and places in its array of settings, counted from zero.
enum Phase : Long { kAnalyse = 11, kFactorise = 22, kSolve = 33, kRelease = -1 };
enum Setting {
  kOwnSettings = 0,
  kOrdering = 1,
  kPerturbation = 9,
  kScaling = 10,
  kTransposed = 11,
  kMatching = 12,
  kRaisedPivots = 13,
  kNonzeros = 17,
  kFlops = 18,
  kPositive = 21,
  kNegative = 22,
  kFailedAt = 29,
  kZeroBased = 34
};

class Pardiso final : public Backend {
 public:
  explicit Pardiso(Kind kind) : kind_(kind) {}
  ~Pardiso() override { release(); }

  void analyse(const CscPattern& pattern) override {
    release();
    pattern_ = &pattern;
    settings_.fill(0);
    settings_[kOwnSettings] = settings_[kZeroBased] = 1;
    settings_[kOrdering] = 2; // METIS
    settings_[kPerturbation] = kind_ == Kind::Unsymmetric ? 13 : 8;
    settings_[kNonzeros] = settings_[kFlops] = -1; // to be counted
    // Columns as rows: the lower triangle is the upper one that it wants, and A is Aᵀ.
    settings_[kTransposed] = kind_ == Kind::Unsymmetric ? 2 : 0;
    const std::vector<double> none(pattern.row.size(), 1.0);
    require(call(kAnalyse, none.data(), nullptr, nullptr), "analysis");
    flops_ = 1e6 * static_cast<double>(settings_[kFlops]);
    nonzeros_ = static_cast<double>(settings_[kNonzeros]);
  }

  FactorStatus factorise(double* values) override {
    values_ = values;
    const Long error = call(kFactorise, values, nullptr, nullptr);
    if (error == -4 || error == -7)
      return {kind_ == Kind::Cholesky ? FactorStatus::Cause::NotPositiveDefinite
                                      : FactorStatus::Cause::Singular,
              settings_[kFailedAt] - 1};
    require(error, "factorisation");
    return {};
  }

  void solve(const double* rhs, double* x) override {
    require(call(kSolve, values_, const_cast<double*>(rhs), x), "solve");
  }

  /// Pardiso does not give the pivots, so growth is not known: the signs are as good as it is.
  Inertia inertia() const override {
    return {settings_[kNegative], pattern_->size - settings_[kNegative] - settings_[kPositive],
            settings_[kPositive], 1.0};
  }
  std::int64_t raised_pivots() const override {
    return kind_ == Kind::Cholesky ? 0 : settings_[kRaisedPivots];
  }
  double flops() const override { return flops_; }
  double nonzeros() const override { return nonzeros_; }
  const char* ordering() const override { return "Pardiso METIS"; }

 private:
  Long call(Phase phase, const double* values, double* rhs, double* x) {
    const MklThreads threads;
    const Long one = 1, silent = 0, type = matrix_type(), step = phase, size = pattern_->size;
    Long error = 0;
    mkl().pardiso(handle_.data(), &one, &one, &type, &step, &size, values, pattern_->start.data(),
                  pattern_->row.data(), nullptr, &one, settings_.data(), &silent, rhs, x, &error);
    return error;
  }

  Long matrix_type() const {
    return kind_ == Kind::Cholesky ? 2 : kind_ == Kind::QuasiDefinite ? -2 : 11;
  }

  void release() {
    if (pattern_ != nullptr) call(kRelease, nullptr, nullptr, nullptr);
    pattern_ = nullptr;
    handle_.fill(nullptr);
  }

  static void require(Long error, const char* stage) {
    if (error == 0) return;
    const bool memory = error == -2;
    throw NumericalError(std::string("Pardiso's ") + stage +
                         (memory ? " ran out of memory; use a coarser mesh or a lower order"
                                 : " failed; use another solver") +
                         " (error " + std::to_string(error) + ")");
  }

  Kind kind_;
  const CscPattern* pattern_ = nullptr;
  const double* values_ = nullptr;
  std::array<void*, 64> handle_{};
  std::array<Long, 64> settings_{};
  double flops_ = 0.0, nonzeros_ = 0.0;
};

} // namespace

void load_pardiso(const std::string& path) {
  if (pardiso_loaded()) return;
  // Local: MKL's BLAS must not take the place of the one that the runtime is linked to.
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr)
    throw NumericalError(std::string("MKL could not be loaded (") + dlerror() +
                         "); give the path of libmkl_rt.so");
  const auto find = [&](const char* name) { return dlsym(library, name); };
  auto* const call = reinterpret_cast<PardisoCall*>(find("pardiso_64"));
  auto* const threads = reinterpret_cast<int (*)(int)>(find("MKL_Set_Num_Threads_Local"));
  auto* const layer = reinterpret_cast<int (*)(int)>(find("MKL_Set_Threading_Layer"));
  if (call == nullptr || threads == nullptr || layer == nullptr)
    throw NumericalError("pardiso_64 is not in " + path + "; give the path of MKL's libmkl_rt.so");
  constexpr int gnu_openmp = 3; // the runtime's own, so that both share one set of threads
  layer(gnu_openmp);
  mkl() = {call, threads};
}

bool pardiso_loaded() {
  return mkl().pardiso != nullptr;
}

std::unique_ptr<Backend> make_pardiso(Kind kind) {
  if (!pardiso_loaded())
    throw StateError("Pardiso is not loaded; call load_pardiso with the path of libmkl_rt.so");
  return std::make_unique<Pardiso>(kind);
}

} // namespace supple
