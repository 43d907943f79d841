#include "supple/rig_fit.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include "rig_energy.hpp"
#include "rig_match.hpp"
#include "rig_scan.hpp"
#include "rig_step.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Index = Eigen::Index;

double now() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

/// Columns: all bones turned about `centre`, shifted, scaled, as one body.
Eigen::MatrixXd as_one_body(const Rig& rig, const RigPosture& posture, const Vec3& centre) {
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(rig.unknowns(), 7);
  for (int k = 0; k < rig.bones(); ++k) {
    const std::size_t s = static_cast<std::size_t>(k);
    const Vec3 arm = rig.joint(k) + posture.translations[s] - centre;
    M.block<3, 3>(9 * k, 0).setIdentity();
    M.block<3, 3>(9 * k + 3, 0) = -skew<double>(arm);
    M.block<3, 3>(9 * k + 3, 3).setIdentity();
    M.block<3, 1>(9 * k + 3, 6) = arm;
    M.block<3, 1>(9 * k + 6, 6) = posture.scales[s];
  }
  return M;
}

std::vector<char> free_unknowns(const Rig& rig, Moves moves) {
  std::vector<char> free(static_cast<std::size_t>(rig.unknowns()), moves == Moves::All);
  for (int k = 0; k < rig.bones(); ++k)
    for (int c = 0; c < 9; ++c)
      free[static_cast<std::size_t>(9 * k + c)] = c < 6 || moves != Moves::Bones;
  return free;
}

/// Median of the absolute values × 1.4826: the standard deviation of normal values, deaf to
/// outliers.
double robust_sd(std::vector<double> values) {
  if (values.empty()) return 0.0;
  for (double& value : values)
    value = std::abs(value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return 1.4826 * *middle;
}

/// Mean residual of the rows in each cube of `size` m.
std::vector<double> patch_means(const std::vector<Row>& rows, const Points& vertices, double size) {
  struct Entry {
    std::array<long, 3> cube;
    double weight, residual;
  };
  std::vector<Entry> entries;
  for (const Row& row : rows) {
    const double residual = row.residual(vertices);
    const double weight = row.weight * loss_weight(residual, row.loss);
    const Vec3 cube = (row.target / size).array().floor();
    entries.push_back(
        {{std::lround(cube[0]), std::lround(cube[1]), std::lround(cube[2])}, weight, residual});
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const Entry& a, const Entry& b) { return a.cube < b.cube; });
  std::vector<double> means;
  for (std::size_t i = 0; i < entries.size();) {
    double sum = 0.0, weight = 0.0;
    const auto cube = entries[i].cube;
    for (; i < entries.size() && entries[i].cube == cube; ++i) {
      sum += entries[i].weight * entries[i].residual;
      weight += entries[i].weight;
    }
    if (weight > 0.0) means.push_back(sum / weight);
  }
  return means;
}

/// One fit under way.
class Run {
 public:
  Run(const Rig& rig, Matcher& matcher, NormalSum& sums, const RigWeights& weights,
      const RigPriors& priors, const RigLandmarks& landmarks, const RigPosture& start)
      : rig_(rig), matcher_(matcher), sums_(sums), weights_(weights),
        priors_(complete(rig, priors)), marks_(landmark_rows(rig, landmarks, weights.landmark)),
        state_(std::make_unique<SkinState>(rig, start)) {}

  RigFitResult through(const std::vector<RigStage>& stages) {
    for (const RigStage& stage : stages) {
      const double begun = now();
      result_.iterations.push_back(settle(stage));
      result_.stage_seconds.push_back(now() - begun);
    }
    report(stages.back());
    return std::move(result_);
  }

 private:
  /// Iterations of a stage.
  int settle(const RigStage& stage) {
    double damping = 1e-6;
    result_.converged = false;
    for (int i = 0; i < stage.iterations; ++i) {
      matcher_.match(*state_, stage, weights_, priors_, pairs_);
      need_pairs(stage);
      const double energy = energy_at(*state_);
      result_.history.push_back(energy);
      assemble();
      if (!improve(stage.moves, energy, damping)) return i + 1;
      if (result_.last_step > stage.tolerance) continue;
      result_.converged = true;
      return i + 1;
    }
    return stage.iterations;
  }

  void need_pairs(const RigStage& stage) const {
    if (pairs_.rows.size() + marks_.size() >= 12) return;
    throw NumericalError("the template must start near the scan, got " +
                         std::to_string(pairs_.rows.size()) + " pairs within " +
                         std::to_string(1e3 * stage.reach) +
                         " mm; start from a better posture, or with landmarks");
  }

  double energy_at(const SkinState& state) const {
    return energy_of(pairs_.rows, state.points) + energy_of(marks_, state.points) +
           prior_terms(rig_, state.posture, weights_, priors_).total();
  }

  void assemble() {
    const Index n = rig_.unknowns();
    normal_.matrix.setZero(n, n);
    normal_.gradient.setZero(n);
    sums_.add(pairs_.rows, *state_, normal_);
    if (!marks_.empty()) sums_.add(marks_, *state_, normal_);
    add_priors(rig_, state_->posture, weights_, priors_, normal_);
  }

  /// A step that lowers the energy of these pairs; false if there is none.
  bool improve(Moves moves, double energy, double& damping) {
    for (int attempt = 0; attempt < 8; ++attempt) {
      Eigen::VectorXd step;
      if (propose(moves, damping, step)) {
        auto next = std::make_unique<SkinState>(rig_, stepped(state_->posture, step));
        if (energy_at(*next) <= energy + 1e-12 * std::abs(energy)) {
          result_.last_step = (next->points - state_->points).rowwise().norm().maxCoeff();
          state_ = std::move(next);
          damping = std::max(damping / 10.0, 1e-9);
          return true;
        }
      }
      damping = std::max(10.0 * damping, 1e-4);
    }
    return false;
  }

  bool propose(Moves moves, double damping, Eigen::VectorXd& step) const {
    if (moves == Moves::Rigid) return propose_rigid(damping, step);
    const Conditions hold = conditions(rig_, state_->posture, priors_);
    Eigen::VectorXd lower, upper;
    bounds(lower, upper);
    return solve_step({normal_.matrix, normal_.gradient, hold.matrix, hold.value, lower, upper,
                       free_unknowns(rig_, moves), damping},
                      step);
  }

  bool propose_rigid(double damping, Eigen::VectorXd& step) const {
    const Vec3 centre = state_->points.colwise().mean().transpose();
    const Eigen::MatrixXd M = as_one_body(rig_, state_->posture, centre);
    Eigen::MatrixXd small = M.transpose() * (normal_.matrix.selfadjointView<Eigen::Lower>() * M);
    small.diagonal() *= 1.0 + damping;
    const Eigen::LLT<Eigen::MatrixXd> factor(small);
    if (factor.info() != Eigen::Success) return false;
    step = -(M * factor.solve(M.transpose() * normal_.gradient));
    return step.allFinite();
  }

  /// What a step may be so that scales and blend stay in their ranges; the start may be outside.
  void bounds(Eigen::VectorXd& lower, Eigen::VectorXd& upper) const {
    const double inf = std::numeric_limits<double>::infinity();
    lower = Eigen::VectorXd::Constant(rig_.unknowns(), -inf);
    upper = Eigen::VectorXd::Constant(rig_.unknowns(), inf);
    for (int k = 0; k < rig_.bones(); ++k) {
      const Vec3& scale = state_->posture.scales[static_cast<std::size_t>(k)];
      lower.segment<3>(9 * k + 6) = (priors_.scale_lower - scale.array()).min(0.0);
      upper.segment<3>(9 * k + 6) = (priors_.scale_upper - scale.array()).max(0.0);
    }
    lower.tail(rig_.shapes()) = (priors_.blend_lower - state_->posture.blend).cwiseMin(0.0);
    upper.tail(rig_.shapes()) = (priors_.blend_upper - state_->posture.blend).cwiseMax(0.0);
  }

  void report(RigStage stage) {
    stage.every_point = stage.every_vertex = 1;
    matcher_.match(*state_, stage, weights_, priors_, pairs_);
    need_pairs(stage);
    result_.posture = state_->posture;
    result_.terms = prior_terms(rig_, state_->posture, weights_, priors_);
    result_.terms.data = energy_of(pairs_.rows, state_->points);
    result_.terms.landmark = energy_of(marks_, state_->points);
    report_matrices();
    report_spread();
    report_pairs();
  }

  void report_matrices() {
    const Index n = rig_.unknowns();
    Normal data{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
    Normal prior = data;
    sums_.add(pairs_.rows, *state_, data);
    sums_.add(marks_, *state_, prior);
    add_priors(rig_, state_->posture, weights_, priors_, prior);
    result_.data_matrix = data.matrix.selfadjointView<Eigen::Lower>();
    result_.prior_matrix = prior.matrix.selfadjointView<Eigen::Lower>();
  }

  void report_spread() {
    std::vector<double> residuals;
    for (const Row& row : pairs_.rows)
      residuals.push_back(row.residual(state_->points));
    result_.residual_sd = robust_sd(std::move(residuals));
    result_.patch_sd = robust_sd(patch_means(pairs_.rows, state_->points, priors_.patch));
    result_.observations = pairs_.area / (priors_.patch * priors_.patch);
  }

  void report_pairs() {
    const auto used = [&](const std::vector<int>& rows, Eigen::VectorXd& weight) {
      weight.setZero(static_cast<Index>(rows.size()));
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (rows[i] < 0) continue;
        const Row& row = pairs_.rows[static_cast<std::size_t>(rows[i])];
        weight[static_cast<Index>(i)] = loss_weight(row.residual(state_->points), row.loss);
      }
    };
    used(pairs_.row_of, result_.used);
    used(pairs_.vertex_row, result_.vertex_used);
    result_.triangle = pairs_.triangle;
    result_.barycentric = pairs_.barycentric;
    result_.distance = pairs_.distance;
  }

  const Rig& rig_;
  Matcher& matcher_;
  NormalSum& sums_;
  const RigWeights weights_;
  const RigPriors priors_;
  const std::vector<Row> marks_;
  std::unique_ptr<SkinState> state_;
  Pairs pairs_;
  Normal normal_;
  RigFitResult result_;
};

} // namespace

struct RigFit::State {
  std::shared_ptr<const Rig> rig;
  Matcher matcher;
  NormalSum sums;
  ScanCloud scan;

  explicit State(std::shared_ptr<const Rig> of) : rig(std::move(of)), matcher(*rig) {}
};

RigFit::RigFit(std::shared_ptr<const Rig> rig) : state_(std::make_unique<State>(std::move(rig))) {}
RigFit::RigFit(RigFit&&) noexcept = default;
RigFit::~RigFit() = default;

void RigFit::set_scan(const Points& points, const Triangles& triangles, const Points& normals,
                      const ScanSettings& settings) {
  state_->scan = prepared(points, triangles, normals, settings);
  state_->matcher.set_scan(state_->scan);
}

const ScanCloud& RigFit::scan() const {
  return state_->scan;
}

RigFitResult RigFit::run(const RigPosture& start, const RigWeights& weights,
                         const RigPriors& priors, const std::vector<RigStage>& stages,
                         const RigLandmarks& landmarks) {
  if (state_->scan.points.rows() == 0)
    throw StateError("a fit must have a scan; call set_scan first");
  if (stages.empty()) throw ShapeError("stages must be one at least, got none; give a schedule");
  state_->rig->check(start);
  Run run(*state_->rig, state_->matcher, state_->sums, weights, priors, landmarks, start);
  return run.through(stages);
}

} // namespace supple
