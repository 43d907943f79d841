#include "supple/pose_search.hpp"

#include "core.hpp"
#include "supple/error.hpp"

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using RowMat3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using supple::Points;
using supple::Similarity;

std::vector<Similarity> candidates(const Array& R, const Points& b, const Eigen::VectorXd& a,
                                   const Eigen::VectorXi& shape) {
  if (R.ndim() != 3 || R.shape(0) != a.size() || R.shape(1) != 3 || R.shape(2) != 3 ||
      b.rows() != a.size() || shape.size() != a.size())
    throw supple::ShapeError("R, b, a, shape must be (C, 3, 3), (C, 3), (C,), (C,)");
  std::vector<Similarity> all;
  for (Eigen::Index c = 0; c < a.size(); ++c) {
    Similarity one;
    one.R = Eigen::Map<const RowMat3>(R.data(c, 0, 0));
    one.b = b.row(c).transpose();
    one.a = a[c];
    one.shape = shape[c];
    all.push_back(one);
  }
  return all;
}

py::tuple arrays(const std::vector<Similarity>& all) {
  const py::ssize_t count = static_cast<py::ssize_t>(all.size());
  Array R({count, py::ssize_t{3}, py::ssize_t{3}});
  Points b(count, 3);
  Eigen::VectorXd a(count), score(count);
  for (py::ssize_t c = 0; c < count; ++c) {
    const Similarity& one = all[static_cast<std::size_t>(c)];
    Eigen::Map<RowMat3>(R.mutable_data(c, 0, 0)) = one.R;
    b.row(c) = one.b.transpose();
    a[c] = one.a;
    score[c] = one.score;
  }
  return py::make_tuple(R, b, a, score);
}

} // namespace

void bind_pose_search(py::module_& module) {
  using supple::PoseRound, supple::PoseShapes;
  py::class_<PoseShapes>(module, "PoseShapes")
      .def(py::init([](int vertices, const Points& points, const Points& normals,
                       const Eigen::VectorXi& nearest, const Eigen::Vector3d& origin,
                       const Eigen::Vector3i& counts, double size) {
        return PoseShapes{vertices, points, normals, nearest, origin, counts, size};
      }));
  module.def("descend",
             [](const PoseShapes& shapes, const Points& points, const Points& normals,
                bool oriented, int steps, double reach, double size_sd, const Array& R,
                const Points& b, const Eigen::VectorXd& a, const Eigen::VectorXi& shape) {
               std::vector<Similarity> all = candidates(R, b, a, shape);
               {
                 const py::gil_scoped_release release;
                 descend(shapes, points, normals, oriented, PoseRound{steps, reach, size_sd}, all);
               }
               return arrays(all);
             });
}
