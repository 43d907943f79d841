#include "supple/rig.hpp"

#include "core.hpp"
#include "supple/error.hpp"
#include "supple/rig_fit.hpp"
#include "supple/rig_uncertainty.hpp"

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Eigen::VectorXd;
using supple::Points;
using supple::Rig;
using supple::RigFit;
using supple::RigFitResult;
using supple::RigPosture;
using supple::RowMatrix;

RigPosture posture(const Array& rotations, const Points& translations, const Points& scales,
                   const VectorXd& blend) {
  if (rotations.ndim() != 3 || rotations.shape(1) != 3 || rotations.shape(2) != 3)
    throw supple::ShapeError("rotations must be (K, 3, 3); give one a bone");
  RigPosture result;
  for (py::ssize_t k = 0; k < rotations.shape(0); ++k)
    result.rotations.emplace_back(
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotations.data(k, 0, 0)));
  for (Eigen::Index k = 0; k < translations.rows(); ++k)
    result.translations.emplace_back(translations.row(k).transpose());
  for (Eigen::Index k = 0; k < scales.rows(); ++k)
    result.scales.emplace_back(scales.row(k).transpose());
  result.blend = blend;
  return result;
}

py::tuple arrays(const RigPosture& posture) {
  const py::ssize_t bones = static_cast<py::ssize_t>(posture.rotations.size());
  Array rotations({bones, py::ssize_t{3}, py::ssize_t{3}});
  Points translations(bones, 3), scales(bones, 3);
  for (py::ssize_t k = 0; k < bones; ++k) {
    const std::size_t s = static_cast<std::size_t>(k);
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotations.mutable_data(k, 0, 0)) =
        posture.rotations[s];
    translations.row(k) = posture.translations[s].transpose();
    scales.row(k) = posture.scales[s].transpose();
  }
  return py::make_tuple(rotations, translations, scales, posture.blend);
}

template <class Result, class Use>
Result unlocked(const Use& use) {
  const py::gil_scoped_release release;
  return use();
}

void bind_settings(py::module_& module) {
  using supple::Moves, supple::RigPriors, supple::RigStage, supple::RigWeights;
  py::class_<RigWeights>(module, "RigWeights")
      .def(py::init<>())
      .def_readwrite("data", &RigWeights::data)
      .def_readwrite("scale", &RigWeights::scale)
      .def_readwrite("blendshape", &RigWeights::blendshape)
      .def_readwrite("joint", &RigWeights::joint)
      .def_readwrite("landmark", &RigWeights::landmark);
  py::class_<RigPriors>(module, "RigPriors")
      .def(py::init<>())
      .def_readwrite("noise", &RigPriors::noise)
      .def_readwrite("patch", &RigPriors::patch)
      .def_readwrite("scale", &RigPriors::scale)
      .def_readwrite("scale_mean", &RigPriors::scale_mean)
      .def_readwrite("joint", &RigPriors::joint)
      .def_readwrite("rotation", &RigPriors::rotation)
      .def_readwrite("rotation_mean", &RigPriors::rotation_mean)
      .def_readwrite("blend_mean", &RigPriors::blend_mean)
      .def_readwrite("blend_precision", &RigPriors::blend_precision)
      .def_readwrite("blend_lower", &RigPriors::blend_lower)
      .def_readwrite("blend_upper", &RigPriors::blend_upper)
      .def_readwrite("scale_lower", &RigPriors::scale_lower)
      .def_readwrite("scale_upper", &RigPriors::scale_upper)
      .def_readwrite("stiff_joints", &RigPriors::stiff_joints)
      .def_readwrite("convex", &RigPriors::convex);
  py::class_<RigStage>(module, "RigStage")
      .def(py::init<>())
      .def_property(
          "moves", [](const RigStage& stage) { return static_cast<int>(stage.moves); },
          [](RigStage& stage, int moves) { stage.moves = static_cast<Moves>(moves); })
      .def_readwrite("iterations", &RigStage::iterations)
      .def_readwrite("tolerance", &RigStage::tolerance)
      .def_readwrite("flat", &RigStage::flat)
      .def_readwrite("reach", &RigStage::reach)
      .def_readwrite("loss", &RigStage::loss)
      .def_readwrite("angle", &RigStage::angle)
      .def_readwrite("template_share", &RigStage::template_share)
      .def_readwrite("point_share", &RigStage::point_share)
      .def_readwrite("every_vertex", &RigStage::every_vertex)
      .def_readwrite("every_point", &RigStage::every_point);
}

void bind_result(py::module_& module) {
  using supple::RigTerms, supple::ScanCloud;
  py::class_<RigTerms>(module, "RigTerms")
      .def_readonly("data", &RigTerms::data)
      .def_readonly("scale", &RigTerms::scale)
      .def_readonly("blendshape", &RigTerms::blendshape)
      .def_readonly("joint", &RigTerms::joint)
      .def_readonly("landmark", &RigTerms::landmark)
      .def_readonly("rotation", &RigTerms::rotation);
  py::class_<ScanCloud>(module, "ScanCloud")
      .def_readonly("points", &ScanCloud::points)
      .def_readonly("normals", &ScanCloud::normals)
      .def_readonly("area", &ScanCloud::area)
      .def_property_readonly("border",
                             [](const ScanCloud& cloud) {
                               py::array_t<bool> border(
                                   static_cast<py::ssize_t>(cloud.border.size()));
                               for (std::size_t i = 0; i < cloud.border.size(); ++i)
                                 border.mutable_at(i) = cloud.border[i] != 0;
                               return border;
                             })
      .def_readonly("oriented", &ScanCloud::oriented);
  using supple::RigOffset, supple::RigOffsetSettings;
  py::class_<RigOffsetSettings>(module, "RigOffsetSettings")
      .def(py::init<>())
      .def_readwrite("prior", &RigOffsetSettings::prior)
      .def_readwrite("length", &RigOffsetSettings::length)
      .def_readwrite("per_area", &RigOffsetSettings::per_area)
      .def_readwrite("reach", &RigOffsetSettings::reach)
      .def_readwrite("aside", &RigOffsetSettings::aside)
      .def_readwrite("rounds", &RigOffsetSettings::rounds);
  py::class_<RigOffset>(module, "RigOffset")
      .def_readonly("height", &RigOffset::height)
      .def_readonly("along", &RigOffset::along)
      .def_readonly("start", &RigOffset::start)
      .def_readonly("row", &RigOffset::row)
      .def_readonly("values", &RigOffset::values);
  using supple::RigEvaluation;
  py::class_<RigEvaluation>(module, "RigEvaluation")
      .def_readonly("terms", &RigEvaluation::terms)
      .def_readonly("gradient", &RigEvaluation::gradient)
      .def_readonly("matrix", &RigEvaluation::matrix)
      .def_readonly("vertex", &RigEvaluation::vertex)
      .def_readonly("share", &RigEvaluation::share)
      .def_readonly("direction", &RigEvaluation::direction)
      .def_readonly("target", &RigEvaluation::target)
      .def_readonly("weight", &RigEvaluation::weight)
      .def_readonly("loss", &RigEvaluation::loss);
  py::class_<RigFitResult>(module, "RigFitResult")
      .def_property_readonly("posture",
                             [](const RigFitResult& result) { return arrays(result.posture); })
      .def_readonly("points", &RigFitResult::points)
      .def_readonly("every_point", &RigFitResult::every_point)
      .def_readonly("converged", &RigFitResult::converged)
      .def_readonly("last_step", &RigFitResult::last_step)
      .def_readonly("iterations", &RigFitResult::iterations)
      .def_readonly("history", &RigFitResult::history)
      .def_readonly("stage_seconds", &RigFitResult::stage_seconds)
      .def_readonly("terms", &RigFitResult::terms)
      .def_readonly("data_matrix", &RigFitResult::data_matrix)
      .def_readonly("prior_matrix", &RigFitResult::prior_matrix)
      .def_readonly("residual_sd", &RigFitResult::residual_sd)
      .def_readonly("patch_sd", &RigFitResult::patch_sd)
      .def_readonly("observations", &RigFitResult::observations)
      .def_readonly("triangle", &RigFitResult::triangle)
      .def_readonly("barycentric", &RigFitResult::barycentric)
      .def_readonly("distance", &RigFitResult::distance)
      .def_readonly("used", &RigFitResult::used)
      .def_readonly("vertex_used", &RigFitResult::vertex_used);
}

void bind_uncertainty(py::module_& module) {
  using supple::ResidualRings;
  py::class_<ResidualRings>(module, "ResidualRings")
      .def_readonly("count", &ResidualRings::count)
      .def_readonly("sum", &ResidualRings::sum);
  module.def("residual_rings", &supple::residual_rings, Unlocked());
  module.def("inverse_sum", &supple::inverse_sum, Unlocked());
  module.def("inflated", &supple::inflated, Unlocked());
}

void bind_rig_itself(py::module_& module) {
  py::class_<Rig, std::shared_ptr<Rig>>(module, "Rig")
      .def(py::init([](const Points& points, const supple::Triangles& triangles,
                       const Points& joints, const Eigen::VectorXi& parents,
                       const RowMatrix& weights, const RowMatrix& blendshapes, bool dual) {
        return std::make_shared<Rig>(
            supple::RigArrays{points, triangles, joints, parents, weights, blendshapes},
            dual ? supple::Skinning::DualQuaternion : supple::Skinning::Linear);
      }))
      .def_property_readonly("unknowns", &Rig::unknowns)
      .def("vertices",
           [](const Rig& rig, const Array& R, const Points& t, const Points& s, const VectorXd& b) {
             const RigPosture at = posture(R, t, s, b);
             return unlocked<Points>([&] { return rig.posed(at); });
           })
      .def("jacobian",
           [](const Rig& rig, const Array& R, const Points& t, const Points& s, const VectorXd& b) {
             const RigPosture at = posture(R, t, s, b);
             return unlocked<RowMatrix>([&] { return rig.jacobian(at); });
           })
      .def("vertex_sd",
           [](const Rig& rig, const Array& R, const Points& t, const Points& s, const VectorXd& b,
              const Eigen::Ref<const Eigen::MatrixXd>& covariance, const Eigen::VectorXi& of) {
             const RigPosture at = posture(R, t, s, b);
             return unlocked<VectorXd>([&] { return rig.vertex_sd(at, covariance, of); });
           });
}

} // namespace

void bind_rig(py::module_& module) {
  bind_pose_search(module);
  bind_settings(module);
  bind_result(module);
  bind_rig_itself(module);
  bind_uncertainty(module);
  py::class_<RigFit>(module, "RigFit")
      .def(py::init([](std::shared_ptr<Rig> rig) { return std::make_unique<RigFit>(rig); }))
      .def(
          "set_scan",
          [](RigFit& fit, const supple::GivenPoints& points,
             const supple::GivenTriangles& triangles, const supple::GivenPoints& normals,
             double voxel, bool thin, double gap) {
            supple::ScanSettings settings{voxel, thin};
            settings.gap = gap;
            fit.set_scan(points, triangles, normals, settings);
          },
          Unlocked())
      .def_property_readonly("scan", &RigFit::scan, py::return_value_policy::copy)
      .def("evaluate",
           [](RigFit& fit, const py::tuple& pairs_at, const py::tuple& at,
              const supple::RigWeights& weights, const supple::RigPriors& priors,
              const supple::RigStage& stage, const Eigen::VectorXi& triangle,
              const Points& barycentric, const Points& target, const VectorXd& sd) {
             const auto from = [](const py::tuple& parts) {
               return posture(parts[0].cast<Array>(), parts[1].cast<Points>(),
                              parts[2].cast<Points>(), parts[3].cast<VectorXd>());
             };
             const RigPosture one = from(pairs_at), other = from(at);
             const supple::RigLandmarks landmarks{triangle, barycentric, target, sd};
             return unlocked<supple::RigEvaluation>(
                 [&] { return fit.evaluate(one, other, weights, priors, stage, landmarks); });
           })
      .def("land",
           [](RigFit& fit, const Array& R, const Points& t, const Points& s, const VectorXd& b,
              const Points& points) {
             const RigPosture at = posture(R, t, s, b);
             const auto landed = unlocked<supple::RigLanding>([&] { return fit.land(at, points); });
             return py::make_tuple(landed.triangle, landed.barycentric, landed.distance);
           })
      .def("offset",
           [](RigFit& fit, const Points& skin, const supple::RigOffsetSettings& settings) {
             return unlocked<supple::RigOffset>([&] { return fit.offset(skin, settings); });
           })
      .def("run",
           [](RigFit& fit, const Array& R, const Points& t, const Points& s, const VectorXd& b,
              const supple::RigWeights& weights, const supple::RigPriors& priors,
              const std::vector<supple::RigStage>& stages, const Eigen::VectorXi& triangle,
              const Points& barycentric, const Points& target, const VectorXd& sd, int report) {
             const RigPosture start = posture(R, t, s, b);
             const supple::RigLandmarks landmarks{triangle, barycentric, target, sd};
             return unlocked<RigFitResult>([&] {
               return fit.run(start, weights, priors, stages, landmarks,
                              static_cast<supple::RigReport>(report));
             });
           });
}
