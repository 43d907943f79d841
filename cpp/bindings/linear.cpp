#include "supple/linear.hpp"

#include "core.hpp"

namespace {

using supple::CscPattern;
using supple::Factor;
using supple::Vector;

/// Lower triangle by columns, rows ascending; `group` is the node of each unknown.
CscPattern lower_pattern(std::vector<std::int64_t> start, std::vector<std::int64_t> row,
                         std::vector<supple::Index> group) {
  CscPattern pattern;
  pattern.size = static_cast<std::int64_t>(start.size()) - 1;
  pattern.start = std::move(start);
  pattern.row = std::move(row);
  pattern.group = std::move(group);
  pattern.lower = true;
  return pattern;
}

Vector solve(Factor& factor, const Vector& rhs) {
  Vector x(rhs.size());
  factor.apply_inverse(rhs, x);
  return x;
}

} // namespace

void bind_linear(py::module_& module) {
  py::class_<CscPattern>(module, "LowerPattern").def(py::init(&lower_pattern));
  py::class_<Factor>(module, "Cholesky")
      .def(py::init([] { return Factor(supple::Kind::Cholesky); }))
      .def("analyse", &Factor::analyse, py::call_guard<py::gil_scoped_release>())
      .def(
          "factorise",
          [](Factor& factor, const Vector& values) { return factor.factorise(values).ok(); },
          py::call_guard<py::gil_scoped_release>())
      .def("solve", &solve, py::call_guard<py::gil_scoped_release>())
      .def_property_readonly("size", &Factor::size)
      .def_property_readonly("flops", &Factor::flops)
      .def_property_readonly("nonzeros", &Factor::nonzeros)
      .def_property_readonly("ordering", &Factor::ordering);
}
