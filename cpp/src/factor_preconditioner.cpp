#include <algorithm>

#include "supple/preconditioner.hpp"

namespace supple {
namespace {

constexpr double kFactorRate = 0.05; // times flops over entries of L: measured at 10,000 dofs
constexpr int kLeastSaved = 8, kMostSaved = 40; // small ones cost calls, large ones run faster

class FactorPreconditioner final : public Preconditioner {
 public:
  FactorStatus update(const CscPattern& pattern, const Vector& values) override {
    if (factor_.size() == 0) factor_.analyse(pattern);
    return factor_.factorise(values);
  }

  void apply(const Vector& r, Vector& z) override { factor_.apply_inverse(r, z); }

  int break_even() const override {
    const double count = kFactorRate * factor_.flops() / std::max(factor_.nonzeros(), 1.0);
    return std::clamp(static_cast<int>(count), kLeastSaved, kMostSaved);
  }

  double bytes() const override { return sizeof(double) * factor_.nonzeros(); }

 private:
  Factor factor_{Kind::Cholesky};
};

} // namespace

std::unique_ptr<Preconditioner> make_factor_preconditioner() {
  return std::make_unique<FactorPreconditioner>();
}

} // namespace supple
