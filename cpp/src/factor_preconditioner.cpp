#include <algorithm>

#include "supple/preconditioner.hpp"

namespace supple {
namespace {

constexpr double kFactorRate = 0.03; // times flops over entries of L: measured at 10,000 dofs
constexpr int kLeastSaved = 8, kMostSaved = 40; // small ones cost calls, large ones run faster

class FactorPreconditioner final : public Preconditioner {
 public:
  FactorStatus update(const CscPattern& pattern, const Vector& values) override {
    if (factor_.precision() != precision_) factor_ = Factor(Kind::Cholesky, precision_);
    if (factor_.size() == 0) factor_.analyse(pattern);
    const FactorStatus status = factor_.factorise(values);
    // A matrix beyond the reach of single precision: those after it will be so, too.
    if (status.ok() && factor_.fell_back()) precision_ = Precision::Double;
    return status;
  }

  void apply(const Vector& r, Vector& z) override { factor_.apply_inverse(r, z); }

  int break_even() const override {
    const double count = kFactorRate * factor_.flops() / std::max(factor_.nonzeros(), 1.0);
    return std::clamp(static_cast<int>(count), kLeastSaved, kMostSaved);
  }

  bool proves() const override {
    return factor_.precision() == Precision::Double || factor_.fell_back();
  }

  bool sharpen() override {
    if (proves()) return false;
    precision_ = Precision::Double;
    return true;
  }

  double bytes() const override {
    return (proves() ? sizeof(double) : sizeof(float)) * factor_.nonzeros();
  }

 private:
  Precision precision_ = Precision::Single; // of the next update
  Factor factor_{Kind::Cholesky, precision_};
};

} // namespace

std::unique_ptr<Preconditioner> make_factor_preconditioner() {
  return std::make_unique<FactorPreconditioner>();
}

} // namespace supple
