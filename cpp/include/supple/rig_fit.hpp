/// Fitting a rig to a scan: Levenberg–Marquardt steps on closest points, coarse to fine.
///
///     E = λ_d E_data + λ_s E_scale + λ_b E_blendshape + λ_j E_joint + λ_l E_landmark
///
/// Each E is ½ Σ (residual / sd)², so that E is a negative log-likelihood and all λ are 1 by
/// default. Source: Mazier (2022), eqs. 26–31.
#pragma once

#include <cstdint>
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "supple/rig.hpp"

namespace supple {

struct RigWeights {
  double data = 1.0, scale = 1.0, blendshape = 1.0, joint = 1.0, landmark = 1.0;
};

/// Standard deviations that make the terms dimensionless.
struct RigPriors {
  /// m of the mean residual of a patch: what noise, thinning and the template's shape leave.
  double noise = 2e-3;
  /// m: data within patch × patch are one observation, however many points it holds: residuals of
  /// neighbours share their cause (sensor drift, a shape that the template lacks).
  double patch = 15e-3;
  Eigen::VectorXd scale;      ///< (K) or (3K) of s_k − s_parent; of the root, of s − 1
  Eigen::VectorXd scale_mean; ///< (3K) of the same; 0
  Eigen::VectorXd joint;      ///< (K) m of T_k(j_k) − T_parent(j_k); the root's is not used
  /// (K) or (3K) rad of log(R_parentᵀ R_k), along the parent's axes; the root's is not used
  Eigen::VectorXd rotation;
  Eigen::VectorXd rotation_mean; ///< (3K) of the same; 0
  Eigen::VectorXd blend_mean;    ///< (A)
  RowMatrix blend_precision;     ///< (A, A) inverse covariance of the blend
  Eigen::VectorXd blend_lower;   ///< (A)
  Eigen::VectorXd blend_upper;   ///< (A)
  double scale_lower = 0.5, scale_upper = 2.0;
  bool stiff_joints = false; ///< joints hold exactly, by Lagrange multipliers
  bool convex = false;       ///< Σ α = 1, α ≥ 0 (the thesis' blend)
};

/// What may move in a stage: everything as one body (turn, shift, size); the bones' turns and
/// shifts; their scales too; the blend too.
enum class Moves { Rigid, Bones, Scales, All };

struct RigStage {
  Moves moves = Moves::All;
  int iterations = 10;
  double tolerance = 5e-5;     ///< m: the stage ends when no vertex moves further
  double reach = 30e-3;        ///< m: pairs further apart are none
  double loss = 8e-3;          ///< m: residual at which Geman–McClure's weight is 1/4
  double angle = 60.0;         ///< degrees between normals, at most
  double template_share = 0.3; ///< of the data that looks from the template to the scan
  double point_share = 0.0;    ///< of point-to-point in it
  int every_vertex = 1;        ///< every so many vertices are used
  int every_point = 1;         ///< every so many points of the thinned scan
  double flat = 5e-3; ///< the stage ends, too, when the energy falls by less than this share
};

/// Named points that are known on the scan.
struct RigLandmarks {
  Eigen::VectorXi triangle; ///< (l) of the template
  Points barycentric;       ///< (l, 3)
  Points target;            ///< (l, 3) m
  Eigen::VectorXd sd;       ///< (l) m
};

/// A scan as it comes, which is large: read where it is.
using Dense = Eigen::Stride<0, 0>;
using GivenPoints = Eigen::Ref<const Points, 0, Dense>;
using GivenTriangles =
    Eigen::Ref<const Eigen::Matrix<std::int64_t, Eigen::Dynamic, 3, Eigen::RowMajor>, 0, Dense>;

struct ScanSettings {
  double voxel = 12e-3; ///< m: points within a voxel become one, their mean
  bool thin = true;     ///< false: every point is used as it is
  double gap = 0.0;     ///< m: thinned points closer than this are of one piece; 0: no pieces
  double share = 0.04;  ///< of the points that a piece must have to stay; the largest does always
};

/// The scan as it is used, in an order of its own.
struct ScanCloud {
  Points points;            ///< (c, 3) m
  Points normals;           ///< (c, 3) unit; 0 where unknown
  Eigen::VectorXd area;     ///< (c) m² of the surface that each stands for
  std::vector<char> border; ///< (c) at the edge of what was seen
  bool oriented = false;    ///< normals point outward, not only along
};

struct RigTerms {
  double data = 0.0, scale = 0.0, blendshape = 0.0, joint = 0.0, landmark = 0.0, rotation = 0.0;
  double total() const { return data + scale + blendshape + joint + landmark + rotation; }
};

/// What a fit says at its end: a `Lead` to another fit, pairs of the points that its last stage
/// used; `Pairs`, those of all points, with what they spread; the `Whole`, matrices too.
enum class RigReport { Lead, Pairs, Whole };

struct RigFitResult {
  RigPosture posture;
  Points points;               ///< (n, 3) m: the template's vertices there
  int every_point = 1;         ///< so many of the thinned scan's were looked at
  bool converged = false;      ///< the last stage ended by tolerance, or flat
  double last_step = 0.0;      ///< m: largest movement of a vertex in the last iteration
  std::vector<int> iterations; ///< of each stage
  std::vector<double> history; ///< energy at the start of each iteration, of its own pairs
  std::vector<double> stage_seconds;
  RigTerms terms;               ///< at the end
  Eigen::MatrixXd data_matrix;  ///< (9K+A)² Jᵀ W J of the data at the last step, λ and sd included
  Eigen::MatrixXd prior_matrix; ///< that of all other terms
  double residual_sd = 0.0;     ///< m: robust sd of the data's residuals
  double patch_sd = 0.0;        ///< m: robust sd of the mean residual of a patch
  double observations = 0.0;    ///< patches that were seen
  Eigen::VectorXi triangle;     ///< (c) where each point of the thinned scan lands; −1 nowhere
  Points barycentric;           ///< (c, 3)
  Eigen::VectorXd distance;     ///< (c) m, NaN where it lands nowhere
  Eigen::VectorXd used;         ///< (c) robust weight, 0 of a point that was left out
  Eigen::VectorXd vertex_used;  ///< (n) robust weight of each vertex' pair, 0 where it has none
};

/// The energy and its gradient at a posture, for pairs that were found at another; for tests.
struct RigEvaluation {
  RigTerms terms;
  Eigen::VectorXd gradient; ///< (9K+A)
  Eigen::MatrixXd matrix;   ///< (9K+A)² of Gauss–Newton
  /// The rows of data, then those of landmarks, residual = direction·(Σ share v − target).
  Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor> vertex;
  Points share, direction, target; ///< (rows, 3)
  Eigen::VectorXd weight, loss;    ///< (rows) 1/m² and m
};

/// Points on a skin.
struct RigLanding {
  Eigen::VectorXi triangle; ///< (m) of the template
  Points barycentric;       ///< (m, 3)
  Eigen::VectorXd distance; ///< (m) m
};

/// Lengths in m.
struct RigOffsetSettings {
  double prior = 1e-3;   ///< standard deviation of the displacement
  double length = 0.08;  ///< over which it is correlated
  double per_area = 1.0; ///< 1/m⁴: weight of a scan point for each m² of the skin
  double reach = 25e-3;  ///< partners further away are none
  double aside = 3e-3;   ///< nor are those that lie beside the skin by more
  int rounds = 3;        ///< of new partners
};

/// A displacement of the skin along its normals.
struct RigOffset {
  Eigen::VectorXd height;     ///< (n) m
  Points along;               ///< (n, 3) unit normals
  Eigen::VectorXi start, row; ///< (n + 1), (nonzeros): its precision by columns, rows ascending
  Eigen::VectorXd values;     ///< (nonzeros) 1/m²
};

/// Fits a rig; keeps the scan and its trees. Not to be used by two threads at once.
class RigFit {
 public:
  explicit RigFit(std::shared_ptr<const Rig> rig);
  RigFit(RigFit&&) noexcept;
  ~RigFit();

  /// `points` (m, 3) m; `triangles` (t, 3) or none; `normals` (m, 3) outward or none.
  /// @throws ShapeError, NumericalError for arrays that do not fit or are not finite.
  void set_scan(const GivenPoints& points, const GivenTriangles& triangles,
                const GivenPoints& normals, const ScanSettings& settings);
  const ScanCloud& scan() const;

  /// Where `points` (m, 3) m land on the skin of a posture, however far.
  RigLanding land(const RigPosture& posture, const Points& points);

  /// What the scan is off `skin` (n, 3) m, smoothly. Bitwise the same for any number of threads.
  /// @throws StateError without a scan; ShapeError.
  RigOffset offset(const Points& skin, const RigOffsetSettings& settings);

  /// From `start` through all stages. Bitwise the same for any number of threads.
  /// @throws StateError without a scan; ShapeError; NumericalError when no pair is within reach.
  RigFitResult run(const RigPosture& start, const RigWeights& weights, const RigPriors& priors,
                   const std::vector<RigStage>& stages, const RigLandmarks& landmarks,
                   RigReport report = RigReport::Whole);

  /// One evaluation with the pairs of `pairs_at`.
  RigEvaluation evaluate(const RigPosture& pairs_at, const RigPosture& at,
                         const RigWeights& weights, const RigPriors& priors, const RigStage& stage,
                         const RigLandmarks& landmarks);

 private:
  void check_ready(const RigPosture& start) const;
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace supple
