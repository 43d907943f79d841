#include "supple/closest_point.hpp"

#include "core.hpp"

void bind_closest_point(py::module_& module) {
  using supple::Projection;
  py::class_<Projection>(module, "Projection")
      .def_readonly("point", &Projection::point)
      .def_readonly("triangle", &Projection::triangle)
      .def_readonly("distance", &Projection::distance)
      .def_readonly("feature", &Projection::feature)
      .def_readonly("normal", &Projection::normal)
      .def_readonly("barycentric", &Projection::barycentric);
  py::class_<supple::SurfaceTree>(module, "SurfaceTree")
      .def(py::init<const supple::Points&, const supple::Triangles&>(), Unlocked())
      .def("closest", &supple::SurfaceTree::closest, Unlocked());
}
