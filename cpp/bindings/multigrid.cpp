#include "supple/multigrid.hpp"

#include "aggregate.hpp"
#include "core.hpp"

namespace {

using supple::Vector;

/// A multigrid with the pattern that its matrices have.
struct Bound {
  supple::CscPattern pattern;
  std::unique_ptr<supple::Multigrid> grid;
};

} // namespace

supple::Aggregate python_aggregate(const py::function& callback) {
  // Held by what may be destroyed without the GIL.
  const std::shared_ptr<py::function> shared(new py::function(callback), [](py::function* f) {
    const py::gil_scoped_acquire gil;
    delete f;
  });
  return [shared](const supple::BlockMatrix<double>& A, const supple::Modes& modes) {
    const py::gil_scoped_acquire gil;
    const py::array_t<std::int64_t> start(static_cast<py::ssize_t>(A.start.size()), A.start.data());
    const py::array_t<supple::Index> column(static_cast<py::ssize_t>(A.column.size()),
                                            A.column.data());
    const auto found = (*shared)(start, column, modes)
                           .cast<std::tuple<supple::Index, std::vector<supple::Index>,
                                            supple::Modes, supple::Modes>>();
    return supple::Aggregates{std::get<0>(found), std::get<1>(found), std::get<2>(found),
                              std::get<3>(found)};
  };
}

void bind_multigrid(py::module_& module) {
  py::class_<Bound>(module, "Multigrid")
      .def(py::init([](const std::vector<std::int64_t>& start, const std::vector<std::int64_t>& row,
                       const std::vector<supple::Index>& dof, const Vector& points,
                       const std::vector<supple::Index>& corner_start,
                       const std::vector<supple::Index>& corner, const py::function& aggregate) {
        supple::CscPattern pattern;
        pattern.size = static_cast<std::int64_t>(dof.size());
        pattern.start = start;
        pattern.row = row;
        pattern.lower = true;
        return std::make_unique<Bound>(
            Bound{std::move(pattern),
                  std::make_unique<supple::Multigrid>(
                      dof, [points] { return points; }, supple::Corners{corner_start, corner},
                      python_aggregate(aggregate))});
      }))
      .def("update", [](Bound& b, const Vector& v) { return b.grid->update(b.pattern, v).ok(); })
      .def("apply",
           [](Bound& b, const Vector& r) {
             Vector z(r.size());
             const py::gil_scoped_release release;
             b.grid->apply(r, z);
             return z;
           })
      .def("multiply",
           [](Bound& b, const Vector& x) {
             Vector y(x.size());
             b.grid->multiply(x, y);
             return y;
           })
      .def("prolongation",
           [](const Bound& b, std::size_t level) {
             const supple::BlockMatrix<float>& P = b.grid->prolongation(level);
             const py::array_t<float> values({static_cast<py::ssize_t>(P.blocks()),
                                              static_cast<py::ssize_t>(P.width),
                                              static_cast<py::ssize_t>(P.height)},
                                             P.value.data());
             return py::make_tuple(P.start, P.column, values);
           })
      .def_property_readonly("rows", [](const Bound& b) { return b.grid->rows(); })
      .def_property_readonly("complexity", [](const Bound& b) { return b.grid->complexity(); });
}
