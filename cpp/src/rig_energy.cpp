#include "rig_energy.hpp"

#include <Eigen/Geometry>
#include <limits>
#include <string>

#include "supple/error.hpp"

namespace supple {
namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Index = Eigen::Index;
/// Columns that a residual of a joint moves: its bone's and its parent's.
using JointRows = Eigen::Matrix<double, 3, 18>;

std::size_t at(int k) {
  return static_cast<std::size_t>(k);
}

/// T_k(j_k) − T_parent(j_k), m.
Vec3 joint_gap(const Rig& rig, const RigPosture& posture, int k) {
  const int p = rig.parent(k);
  const Vec3 arm = rig.joint(k) - rig.joint(p);
  const Vec3 of_parent = posture.rotations[at(p)] * posture.scales[at(p)].cwiseProduct(arm) +
                         rig.joint(p) + posture.translations[at(p)];
  return rig.joint(k) + posture.translations[at(k)] - of_parent;
}

/// Its derivative: columns 0–8 of bone k, 9–17 of its parent.
JointRows joint_rows(const Rig& rig, const RigPosture& posture, int k) {
  const int p = rig.parent(k);
  const Vec3 arm = rig.joint(k) - rig.joint(p);
  const Mat3& R = posture.rotations[at(p)];
  const Vec3 lever = R * posture.scales[at(p)].cwiseProduct(arm);
  JointRows rows = JointRows::Zero();
  rows.block<3, 3>(0, 3).setIdentity();
  rows.block<3, 3>(0, 9) = skew<double>(lever);
  rows.block<3, 3>(0, 12) = -Mat3::Identity();
  rows.block<3, 3>(0, 15) = -R * arm.asDiagonal();
  return rows;
}

/// The inverse of the left Jacobian of the rotations at φ: d log(exp(ω) exp(φ)) = J⁻¹ ω.
/// Source: Barfoot (2017), State Estimation for Robotics, eq. 7.76.
Mat3 inverse_left(const Vec3& phi) {
  const double angle2 = phi.squaredNorm(), angle = std::sqrt(angle2);
  const Mat3 cross = skew<double>(phi);
  const double c = angle2 < 1e-6 ? 1.0 / 12.0 + angle2 / 720.0
                                 : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / angle2;
  return Mat3::Identity() - 0.5 * cross + c * cross * cross;
}

/// Its derivative, seen from axes that do not turn with the parent.
JointRows turn_rows(const Mat3& parent, const Vec3& turn) {
  JointRows rows = JointRows::Zero();
  const Mat3 inverse = inverse_left(parent * turn);
  rows.block<3, 3>(0, 0) = parent.transpose() * inverse;
  rows.block<3, 3>(0, 9) = -(inverse * parent).transpose();
  return rows;
}

/// Adds rowsᵀ Λ rows and rowsᵀ Λ residual, Λ = diag(weight), for bone k and its parent.
void add_pair(const Rig& rig, int k, const JointRows& rows, const Vec3& residual,
              const Vec3& weight, Normal& normal) {
  const Eigen::Matrix<double, 18, 18> product = rows.transpose() * weight.asDiagonal() * rows;
  const Eigen::Matrix<double, 18, 1> pull = rows.transpose() * weight.cwiseProduct(residual);
  const Index first[2] = {9 * k, 9 * rig.parent(k)};
  for (int a = 0; a < 2; ++a) {
    normal.gradient.segment<9>(first[a]) += pull.segment<9>(9 * a);
    normal.matrix.block<9, 9>(first[a], first[a]) += product.block<9, 9>(9 * a, 9 * a);
  }
  normal.matrix.block<9, 9>(first[0], first[1]) += product.block<9, 9>(0, 9); // k > parent: lower
}

/// What bone k is scaled more than its parent, and more than bodies are on average.
Vec3 scale_gap(const Rig& rig, const RigPosture& posture, const RigPriors& priors, int k) {
  const Vec3 reference = rig.parent(k) < 0 ? Vec3(Vec3::Ones()) : posture.scales[at(rig.parent(k))];
  return posture.scales[at(k)] - reference - priors.scale_mean.segment<3>(3 * k);
}

/// log(R_parentᵀ R_k), which is R_parentᵀ log(R_k R_parentᵀ), rad.
Vec3 turn_gap(const Rig& rig, const RigPosture& posture, int k) {
  const Mat3& R = posture.rotations[at(rig.parent(k))];
  return R.transpose() * turn_of(posture.rotations[at(k)] * R.transpose());
}

double inverse_square(double sd) {
  return 1.0 / (sd * sd);
}

/// 1/sd² of bone k's three.
Vec3 precision(const Eigen::VectorXd& sd, int k) {
  return sd.segment<3>(3 * k).array().square().inverse();
}

void need(const char* what, bool good, const char* expected) {
  if (!good) throw ShapeError(std::string(what) + " must " + expected + "; correct the settings");
}

void fill(Eigen::VectorXd& values, Index size, double value, const char* what) {
  if (values.size() == 0) values = Eigen::VectorXd::Constant(size, value);
  require_size(what, values.size(), size, "or leave it empty");
}

/// One value a bone stands for all three axes.
void fill_axes(Eigen::VectorXd& values, Index bones, double value, const char* what) {
  if (values.size() != 3 * bones) {
    fill(values, bones, value, what);
    values = values.transpose().replicate(3, 1).reshaped().eval();
  }
}

} // namespace

RigPriors complete(const Rig& rig, RigPriors p) {
  const double inf = std::numeric_limits<double>::infinity();
  fill_axes(p.scale, rig.bones(), 0.1, "the scales' sd");
  fill(p.scale_mean, 3 * rig.bones(), 0.0, "the scales' mean");
  fill(p.joint, rig.bones(), 1e-3, "the joints' sd");
  fill_axes(p.rotation, rig.bones(), 0.5, "the rotations' sd");
  fill(p.rotation_mean, 3 * rig.bones(), 0.0, "the rotations' mean");
  fill(p.blend_mean, rig.shapes(), 0.0, "blend_mean");
  fill(p.blend_lower, rig.shapes(), -inf, "blend_lower");
  fill(p.blend_upper, rig.shapes(), inf, "blend_upper");
  if (p.blend_precision.size() == 0)
    p.blend_precision = RowMatrix::Identity(rig.shapes(), rig.shapes());
  require_size("blend_precision's rows", p.blend_precision.rows(), rig.shapes(),
               "or leave it empty");
  require_size("blend_precision's columns", p.blend_precision.cols(), rig.shapes(),
               "or leave it empty");
  need("standard deviations",
       p.scale.minCoeff() > 0.0 && p.joint.minCoeff() > 0.0 && p.rotation.minCoeff() > 0.0 &&
           p.noise > 0.0 && p.patch > 0.0,
       "be above 0");
  need("bounds",
       p.scale_lower > 0.0 && p.scale_lower < p.scale_upper &&
           (p.blend_lower.array() <= p.blend_upper.array()).all(),
       "hold a range");
  if (p.convex) p.blend_lower = p.blend_lower.cwiseMax(0.0);
  return p;
}

RigTerms prior_terms(const Rig& rig, const RigPosture& posture, const RigWeights& weights,
                     const RigPriors& priors) {
  RigTerms terms;
  for (int k = 0; k < rig.bones(); ++k) {
    terms.scale +=
        0.5 * scale_gap(rig, posture, priors, k).cwiseAbs2().dot(precision(priors.scale, k));
    if (rig.parent(k) < 0) continue;
    const Vec3 turn = turn_gap(rig, posture, k) - priors.rotation_mean.segment<3>(3 * k);
    terms.rotation += 0.5 * turn.cwiseAbs2().dot(precision(priors.rotation, k));
    if (!priors.stiff_joints)
      terms.joint +=
          0.5 * joint_gap(rig, posture, k).squaredNorm() * inverse_square(priors.joint[k]);
  }
  const Eigen::VectorXd offset = posture.blend - priors.blend_mean;
  terms.blendshape = 0.5 * weights.blendshape * offset.dot(priors.blend_precision * offset);
  terms.scale *= weights.scale;
  terms.joint *= weights.joint;
  terms.rotation *= weights.joint;
  return terms;
}

void add_priors(const Rig& rig, const RigPosture& posture, const RigWeights& weights,
                const RigPriors& priors, Normal& normal) {
  for (int k = 0; k < rig.bones(); ++k) {
    const int p = rig.parent(k);
    JointRows rows = JointRows::Zero();
    rows.block<3, 3>(0, 6).setIdentity();
    rows.block<3, 3>(0, 15) = -Mat3::Identity();
    const Vec3 scale = weights.scale * precision(priors.scale, k);
    const Vec3 gap = scale_gap(rig, posture, priors, k);
    if (p < 0) {
      normal.matrix.diagonal().segment<3>(9 * k + 6) += scale;
      normal.gradient.segment<3>(9 * k + 6) += scale.cwiseProduct(gap);
      continue;
    }
    add_pair(rig, k, rows, gap, scale, normal);
    const Vec3 turn = turn_gap(rig, posture, k);
    const Mat3& R = posture.rotations[at(p)];
    const Vec3 rare = turn - priors.rotation_mean.segment<3>(3 * k);
    const Vec3 stiff = weights.joint * precision(priors.rotation, k);
    add_pair(rig, k, turn_rows(R, turn), rare, stiff, normal);
    // The axes do turn with it: nothing where they are alike, and in the gradient alone.
    normal.gradient.segment<3>(9 * p) += R * stiff.cwiseProduct(rare).cross(turn);
    if (!priors.stiff_joints)
      add_pair(rig, k, joint_rows(rig, posture, k), joint_gap(rig, posture, k),
               Vec3::Constant(weights.joint * inverse_square(priors.joint[k])), normal);
  }
  const Index shapes = rig.shapes();
  normal.matrix.bottomRightCorner(shapes, shapes) += weights.blendshape * priors.blend_precision;
  normal.gradient.tail(shapes) +=
      weights.blendshape * (priors.blend_precision * (posture.blend - priors.blend_mean));
}

Conditions conditions(const Rig& rig, const RigPosture& posture, const RigPriors& priors) {
  const Index joints = priors.stiff_joints ? 3 * (rig.bones() - 1) : 0;
  const bool convex = priors.convex && rig.shapes() > 0;
  Conditions result{Eigen::MatrixXd::Zero(joints + convex, rig.unknowns()),
                    Eigen::VectorXd::Zero(joints + convex)};
  for (int k = 1; k < rig.bones() && joints > 0; ++k) {
    const JointRows rows = joint_rows(rig, posture, k);
    result.matrix.block<3, 9>(3 * (k - 1), 9 * k) = rows.leftCols<9>();
    result.matrix.block<3, 9>(3 * (k - 1), 9 * rig.parent(k)) = rows.rightCols<9>();
    result.value.segment<3>(3 * (k - 1)) = joint_gap(rig, posture, k);
  }
  if (convex) {
    result.matrix.row(joints).tail(rig.shapes()).setOnes();
    result.value[joints] = posture.blend.sum() - 1.0;
  }
  return result;
}

std::vector<Row> landmark_rows(const Rig& rig, const RigLandmarks& l, double weight) {
  const Index count = l.triangle.size();
  const char* const remedy = "give one a landmark";
  require_size("barycentric", l.barycentric.rows(), count, remedy);
  require_size("target", l.target.rows(), count, remedy);
  require_size("sd", l.sd.size(), count, remedy);
  std::vector<Row> rows;
  for (Index i = 0; i < count; ++i) {
    if (l.triangle[i] < 0 || l.triangle[i] >= rig.triangles().rows() || !(l.sd[i] > 0.0))
      throw ShapeError("landmarks must lie on the template's triangles and have an sd above 0 m; "
                       "correct landmark " +
                       std::to_string(i));
    for (int d = 0; d < 3; ++d) {
      Row row;
      for (std::size_t c = 0; c < 3; ++c) {
        row.vertex[c] = rig.triangles()(l.triangle[i], static_cast<Index>(c));
        row.share[c] = l.barycentric(i, static_cast<Index>(c));
      }
      row.direction = Vec3::Unit(d);
      row.target = l.target.row(i).transpose();
      row.weight = weight * inverse_square(l.sd[i]);
      rows.push_back(row);
    }
  }
  return rows;
}

Vec3 turn_of(const Mat3& R) {
  const Eigen::Quaterniond q(R);
  const double sign = q.w() < 0.0 ? -1.0 : 1.0, length = q.vec().norm();
  if (length < 1e-9) return 2.0 * sign * q.vec();
  return 2.0 * std::atan2(length, sign * q.w()) * sign / length * q.vec();
}

} // namespace supple
