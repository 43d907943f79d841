#include "supple/rig_fit.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>

#include "rig_energy.hpp"
#include "rig_match.hpp"
#include "rig_moves.hpp"
#include "rig_offset.hpp"
#include "rig_scan.hpp"
#include "rig_spread.hpp"
#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Index = Eigen::Index;

double now() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(since).count();
}

/// One fit under way.
class Run {
 public:
  Run(const Rig& rig, Matcher& matcher, NormalSum& sums, const RigWeights& weights,
      const RigPriors& priors, const RigLandmarks& landmarks, const RigPosture& start)
      : rig_(rig), matcher_(matcher), sums_(sums), weights_(weights),
        priors_(complete(rig, priors)), marks_(landmark_rows(rig, landmarks, weights.landmark)),
        state_(std::make_unique<SkinState>(rig, start)) {}

  RigFitResult through(const std::vector<RigStage>& stages, RigReport what) {
    for (const RigStage& stage : stages) {
      const double begun = now();
      result_.iterations.push_back(settle(stage));
      result_.stage_seconds.push_back(now() - begun);
    }
    report(stages.back(), what);
    return std::move(result_);
  }

  RigEvaluation evaluate(const RigPosture& at, const RigStage& stage) {
    matcher_.match(*state_, stage, weights_, priors_, pairs_);
    state_ = std::make_unique<SkinState>(rig_, at);
    assemble();
    std::vector<Row> rows = pairs_.rows;
    rows.insert(rows.end(), marks_.begin(), marks_.end());
    const Index n = static_cast<Index>(rows.size());
    RigEvaluation e{
        terms(),      normal_.gradient,   normal_.matrix.selfadjointView<Eigen::Lower>(),
        {},           Points(n, 3),       Points(n, 3),
        Points(n, 3), Eigen::VectorXd(n), Eigen::VectorXd(n)};
    e.vertex.resize(n, 3);
    for (Index i = 0; i < n; ++i) {
      const Row& row = rows[static_cast<std::size_t>(i)];
      e.vertex.row(i) << row.vertex[0], row.vertex[1], row.vertex[2];
      e.share.row(i) << row.share[0], row.share[1], row.share[2];
      e.direction.row(i) = row.direction.transpose();
      e.target.row(i) = row.target.transpose();
      e.weight[i] = row.weight;
      e.loss[i] = row.loss;
    }
    return e;
  }

 private:
  /// Iterations of a stage.
  int settle(const RigStage& stage) {
    double damping = 1e-6, before = std::numeric_limits<double>::infinity();
    result_.converged = false;
    for (int i = 0; i < stage.iterations; ++i) {
      matcher_.match(*state_, stage, weights_, priors_, pairs_);
      need_pairs(stage);
      const double energy = energy_at(*state_);
      result_.history.push_back(energy);
      assemble(stage.moves == Moves::All ? Unknowns::All : Unknowns::Bones);
      if (!improve(stage.moves, energy, damping)) return i + 1;
      const bool flat = std::abs(before - energy) < stage.flat * energy;
      before = energy;
      if (!flat && result_.last_step > stage.tolerance) continue;
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

  void assemble(Unknowns of = Unknowns::All) {
    const Index n = rig_.unknowns();
    normal_.matrix.setZero(n, n);
    normal_.gradient.setZero(n);
    sums_.add(pairs_.rows, *state_, normal_, of);
    whole_ = of == Unknowns::All;
    if (whole_) data_ = normal_.matrix;
    if (!marks_.empty()) sums_.add(marks_, *state_, normal_, of);
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
    if (moves == Moves::Rigid) return rigid_step(rig_, *state_, normal_, damping, step);
    return free_step(rig_, *state_, priors_, moves, normal_, damping, step);
  }

  /// Matrices are those that the last step was taken from; pairs and what they say are of all
  /// points, unless only a lead to the next fit is wanted.
  void report(RigStage stage, RigReport what) {
    if (what == RigReport::Whole) report_matrices();
    if (what != RigReport::Lead) stage.every_point = stage.every_vertex = 1;
    matcher_.match(*state_, stage, weights_, priors_, pairs_);
    need_pairs(stage);
    result_.every_point = std::max(1, stage.every_point);
    result_.posture = state_->posture;
    result_.points = state_->points;
    result_.terms = terms();
    if (what != RigReport::Lead) report_spread();
    report_pairs();
  }

  RigTerms terms() const {
    RigTerms terms = prior_terms(rig_, state_->posture, weights_, priors_);
    terms.data = energy_of(pairs_.rows, state_->points);
    terms.landmark = energy_of(marks_, state_->points);
    return terms;
  }

  void report_matrices() {
    if (!whole_) assemble(); // of bones alone
    result_.data_matrix = data_.selfadjointView<Eigen::Lower>();
    normal_.matrix -= data_;
    result_.prior_matrix = normal_.matrix.selfadjointView<Eigen::Lower>();
  }

  void report_spread() {
    std::vector<double> residuals;
    residuals.reserve(pairs_.rows.size());
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
  Eigen::MatrixXd data_; ///< the data's part of the last `normal_`
  bool whole_ = false;   ///< that was by all unknowns
  RigFitResult result_;
};

} // namespace

struct RigFit::State {
  std::shared_ptr<const Rig> rig;
  Matcher matcher;
  NormalSum sums;
  ScanCloud scan;
  std::unique_ptr<OffsetSolver> offsets;

  explicit State(std::shared_ptr<const Rig> of) : rig(std::move(of)), matcher(*rig) {}
};

RigFit::RigFit(std::shared_ptr<const Rig> rig) : state_(std::make_unique<State>(std::move(rig))) {}
RigFit::RigFit(RigFit&&) noexcept = default;
RigFit::~RigFit() = default;

void RigFit::set_scan(const GivenPoints& points, const GivenTriangles& triangles,
                      const GivenPoints& normals, const ScanSettings& settings) {
  state_->scan = prepared(points, triangles, normals, settings);
  state_->matcher.set_scan(state_->scan);
}

const ScanCloud& RigFit::scan() const {
  return state_->scan;
}

void RigFit::check_ready(const RigPosture& start) const {
  if (state_->scan.points.rows() == 0)
    throw StateError("a fit must have a scan; call set_scan first");
  state_->rig->check(start);
}

RigEvaluation RigFit::evaluate(const RigPosture& pairs_at, const RigPosture& at,
                               const RigWeights& weights, const RigPriors& priors,
                               const RigStage& stage, const RigLandmarks& landmarks) {
  check_ready(pairs_at);
  check_ready(at);
  Run run(*state_->rig, state_->matcher, state_->sums, weights, priors, landmarks, pairs_at);
  return run.evaluate(at, stage);
}

RigLanding RigFit::land(const RigPosture& posture, const Points& points) {
  if (!points.allFinite())
    throw NumericalError("points must be finite, got NaN or infinity; look at the points given");
  const std::vector<Landing> landed = state_->matcher.land(state_->rig->posed(posture), points);
  const Eigen::Index n = points.rows();
  RigLanding result{Eigen::VectorXi(n), Points(n, 3), Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Landing& at = landed[static_cast<std::size_t>(i)];
    result.triangle[i] = at.triangle;
    result.barycentric.row(i) = at.barycentric.transpose();
    result.distance[i] = std::sqrt(at.squared);
  }
  return result;
}

RigOffset RigFit::offset(const Points& skin, const RigOffsetSettings& settings) {
  if (state_->scan.points.rows() == 0)
    throw StateError("an offset must have a scan; call set_scan first");
  require_size("skin", skin.rows(), state_->rig->vertices(), "give the template's vertices");
  if (!state_->offsets) state_->offsets = std::make_unique<OffsetSolver>(*state_->rig);
  return state_->offsets->solve(skin, state_->scan, state_->matcher, settings);
}

RigFitResult RigFit::run(const RigPosture& start, const RigWeights& weights,
                         const RigPriors& priors, const std::vector<RigStage>& stages,
                         const RigLandmarks& landmarks, RigReport report) {
  check_ready(start);
  for (const RigStage& stage : stages)
    if (stage.iterations < 1)
      throw ShapeError("a stage must have an iteration at least, got " +
                       std::to_string(stage.iterations) + "; leave the stage out");
  if (stages.empty()) throw ShapeError("stages must be one at least, got none; give a schedule");
  Run run(*state_->rig, state_->matcher, state_->sums, weights, priors, landmarks, start);
  return run.through(stages, report);
}

} // namespace supple
