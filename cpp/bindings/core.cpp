#include "core.hpp"

#include "supple/error.hpp"

PYBIND11_MODULE(_core, module) {
  py::register_exception<supple::Error>(module, "Error", PyExc_RuntimeError);
  bind_system(module);
  bind_closest_point(module);
  bind_blas(module);
  bind_multigrid(module);
  bind_linear(module);
  bind_rig(module);
}
