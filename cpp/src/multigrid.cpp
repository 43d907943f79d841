#include "supple/multigrid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "chebyshev.hpp"
#include "prolongation.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

constexpr Index kCoarsest = 400;      // block rows that a direct factor takes
constexpr int kUpdate = 13;           // iterations that cost as much as an update: measured
constexpr double kLeastShrink = 0.75; // of the block rows from level to level, else it is coarsest

struct Level {
  BlockMatrix<float> A, P, R; // P from the next level to this one, R = Pᵀ; empty on the coarsest
  Chebyshev smoother;
  std::vector<float> r, x;

  bool is_coarsest() const { return P.rows == 0; }
};

/// Motions that an aggregate does not have (a single node does not turn) get a stiffness, so that
/// their rows, which are zero, can be divided by.
void fill_zero_diagonal(BlockMatrix<double>& A) {
  for (Index i = 0; i < A.rows; ++i) {
    const std::int64_t k = A.find(i, i);
    if (k < 0) continue;
    for (int c = 0; c < A.height; ++c)
      if (double& d = A.block(k)[c * (A.height + 1)]; d == 0.0) d = 1.0;
  }
}

/// The lower triangle by columns, which are rows of the upper one.
CscPattern lower_pattern(const BlockMatrix<double>& A, std::vector<std::ptrdiff_t>& source) {
  CscPattern csc;
  csc.size = std::int64_t{A.rows} * A.height;
  csc.lower = true;
  csc.start.push_back(0);
  const int n = A.height;
  std::vector<std::int64_t> order;
  for (Index i = 0; i < A.rows; ++i) {
    order.clear();
    for (std::int64_t k = A.start[static_cast<std::size_t>(i)];
         k < A.start[static_cast<std::size_t>(i) + 1]; ++k)
      if (A.column[static_cast<std::size_t>(k)] >= i) order.push_back(k);
    std::sort(order.begin(), order.end(), [&](std::int64_t a, std::int64_t b) {
      return A.column[static_cast<std::size_t>(a)] < A.column[static_cast<std::size_t>(b)];
    });
    for (int c = 0; c < n; ++c) {
      for (const std::int64_t k : order) {
        const Index j = A.column[static_cast<std::size_t>(k)];
        for (int r = j == i ? c : 0; r < n; ++r) {
          csc.row.push_back(std::int64_t{n} * j + r);
          source.push_back(k * A.area() + std::ptrdiff_t{n} * r + c);
        }
      }
      csc.start.push_back(csc.nonzeros());
      csc.group.push_back(i);
    }
  }
  return csc;
}

} // namespace

struct Multigrid::State {
  State(std::vector<Index> dof_, Places places_, Corners corners_, Aggregate aggregate_)
      : dof(std::move(dof_)), places(std::move(places_)), corners(std::move(corners_)),
        aggregate(std::move(aggregate_)) {}

  FactorStatus update(const CscPattern& pattern, const Vector& values);
  void take(const CscPattern& pattern, const Vector& values);
  FactorStatus smooth(std::size_t number, const BlockMatrix<double>& A);
  FactorStatus factorise(const BlockMatrix<double>& A);
  bool prolong(std::size_t number, const BlockMatrix<double>& A);
  void cycle(std::size_t number);

  std::vector<Index> dof;
  Places places;
  Vector points;
  Corners corners;
  Aggregate aggregate;

  std::unique_ptr<NodeBlocks> blocks;
  std::vector<Level> levels;
  bool anew = true;            // the prolongations
  Modes modes;                 // of the level being made
  std::vector<double> inverse; // of its diagonal
  double largest = 1.0;        // eigenvalue of it
  Factor coarsest{Kind::Cholesky};
  bool good = false;
  Vector rhs, solution; // of the coarsest level
  Vector in, out;       // of multiply
};

Multigrid::Multigrid(std::vector<Index> dof, Places places, Corners corners, Aggregate aggregate)
    : state_(std::make_unique<State>(std::move(dof), std::move(places), std::move(corners),
                                     std::move(aggregate))) {}

Multigrid::~Multigrid() = default;

void Multigrid::start_over() {
  state_->anew = true;
}

FactorStatus Multigrid::update(const CscPattern& pattern, const Vector& values) {
  return state_->update(pattern, values);
}

FactorStatus Multigrid::State::update(const CscPattern& pattern, const Vector& values) {
  good = false;
  if (!std::isfinite(values.sum())) return {FactorStatus::Cause::NotFinite, -1};
  take(pattern, values);
  if (anew) {
    levels.clear();
    points = places();
    modes = rigid_motions(points, blocks->node(), blocks->free());
  }
  BlockMatrix<double> coarse;
  const BlockMatrix<double>* A = &blocks->matrix();
  for (std::size_t k = 0;; ++k) {
    if (anew) levels.emplace_back();
    if (const FactorStatus status = smooth(k, *A); !status.ok()) return status;
    if (anew ? !prolong(k, *A) : levels[k].is_coarsest()) break;
    coarse = product(levels[k].R, product(*A, levels[k].P));
    fill_zero_diagonal(coarse);
    A = &coarse;
  }
  const FactorStatus status = factorise(*A);
  anew = false;
  good = status.ok();
  return status;
}

void Multigrid::State::take(const CscPattern& pattern, const Vector& values) {
  if (!blocks) blocks = std::make_unique<NodeBlocks>(pattern, dof);
  blocks->fill(pattern, values);
}

/// The level's matrix and what smooths it.
FactorStatus Multigrid::State::smooth(std::size_t number, const BlockMatrix<double>& A) {
  Level& level = levels[number];
  Index lost = -1;
  inverse = inverse_diagonal(A, lost);
  if (lost >= 0) return {FactorStatus::Cause::NotPositiveDefinite, -1};
  largest = largest_eigenvalue(A, inverse);
  level.smoother.update(inverse, largest);
  level.A = rounded(A);
  const auto size = static_cast<std::size_t>(A.rows) * static_cast<std::size_t>(A.height);
  level.r.resize(size);
  level.x.resize(size);
  return {};
}

/// Make the prolongation to a level; false where this one is the coarsest.
bool Multigrid::State::prolong(std::size_t number, const BlockMatrix<double>& A) {
  BlockMatrix<double> P;
  if (number == 0 && !corners.start.empty()) {
    std::vector<Index> corner;
    std::vector<char> free;
    P = from_corners(*blocks, corners, corner, free);
    modes = rigid_motions(points, corner, free);
  } else {
    if (A.rows <= kCoarsest) return false;
    const Aggregates found = aggregate(A, modes);
    if (found.count > kLeastShrink * A.rows) return false;
    P = smoothed(A, inverse, largest, found);
    modes = found.modes;
  }
  levels[number].P = rounded(P);
  levels[number].R = transpose(levels[number].P);
  return true;
}

FactorStatus Multigrid::State::factorise(const BlockMatrix<double>& A) {
  std::vector<std::ptrdiff_t> source;
  const CscPattern pattern = lower_pattern(A, source);
  Vector values(pattern.nonzeros());
  for (std::size_t k = 0; k < source.size(); ++k)
    values[static_cast<Eigen::Index>(k)] = A.value[static_cast<std::size_t>(source[k])];
  coarsest = Factor(Kind::Cholesky);
  coarsest.analyse(pattern);
  rhs.resize(pattern.size);
  solution.resize(pattern.size);
  FactorStatus status = coarsest.factorise(values);
  status.unknown = -1;
  return status;
}

/// levels[number].x = one V-cycle on its r.
void Multigrid::State::cycle(std::size_t number) {
  Level& level = levels[number];
  if (level.is_coarsest()) {
    std::copy(level.r.begin(), level.r.end(), rhs.data());
    coarsest.apply_inverse(rhs, solution);
    std::transform(solution.begin(), solution.end(), level.x.begin(),
                   [](double v) { return static_cast<float>(v); });
    return;
  }
  Level& next = levels[number + 1];
  level.smoother.start(level.A, level.r, level.x);
  supple::multiply(level.R, level.r.data(), next.r.data());
  cycle(number + 1);
  level.smoother.correct(level.A, level.P, next.x, level.r, level.x);
  level.smoother.improve(level.A, level.r, level.x);
}

void Multigrid::apply(const Vector& r, Vector& z) {
  State& s = *state_;
  if (!s.good) throw StateError("apply wants a matrix that was taken over; call update first");
  const std::vector<Index>& place = s.blocks->place();
  require_size("r", r.size(), static_cast<long long>(place.size()), "one entry an unknown");
  z.resize(r.size());
  Level& finest = s.levels.front();
  const double scale = r.cwiseAbs().maxCoeff(); // single precision has few exponents
  if (scale == 0.0) {
    z.setZero();
    return;
  }
  std::fill(finest.r.begin(), finest.r.end(), 0.0F);
  for (std::size_t k = 0; k < place.size(); ++k)
    finest.r[static_cast<std::size_t>(place[k])] =
        static_cast<float>(r[static_cast<Eigen::Index>(k)] / scale);
  s.cycle(0);
  for (std::size_t k = 0; k < place.size(); ++k)
    z[static_cast<Eigen::Index>(k)] = scale * finest.x[static_cast<std::size_t>(place[k])];
}

void Multigrid::take(const CscPattern& pattern, const Vector& values) {
  state_->take(pattern, values);
}

bool Multigrid::multiply(const Vector& x, Vector& y) {
  State& s = *state_;
  const std::vector<Index>& place = s.blocks->place();
  const BlockMatrix<double>& A = s.blocks->matrix();
  y.resize(x.size());
  s.in.setZero(Eigen::Index{3} * A.columns);
  s.out.resize(s.in.size());
  for (std::size_t k = 0; k < place.size(); ++k)
    s.in[place[k]] = x[static_cast<Eigen::Index>(k)];
  supple::multiply(A, s.in.data(), s.out.data());
  for (std::size_t k = 0; k < place.size(); ++k)
    y[static_cast<Eigen::Index>(k)] = s.out[place[k]];
  return true;
}

int Multigrid::break_even() const {
  return kUpdate;
}

double Multigrid::bytes() const {
  double bytes = 8.0 * static_cast<double>(state_->blocks->matrix().value.size());
  for (const Level& level : state_->levels)
    bytes += 4.0 * static_cast<double>(level.A.value.size() + 2 * level.P.value.size());
  return bytes;
}

const BlockMatrix<float>& Multigrid::prolongation(std::size_t level) const {
  return state_->levels.at(level).P;
}

std::vector<Index> Multigrid::rows() const {
  std::vector<Index> rows;
  for (const Level& level : state_->levels)
    rows.push_back(level.A.rows);
  return rows;
}

double Multigrid::complexity() const {
  double entries = 0.0;
  for (const Level& level : state_->levels)
    entries += static_cast<double>(level.A.value.size());
  return entries / static_cast<double>(state_->levels.front().A.value.size());
}

} // namespace supple
