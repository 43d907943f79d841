#include "supple/blas.hpp"

#include "core.hpp"
#include "supple/pardiso.hpp"

void bind_blas(py::module_& module) {
  using supple::BlasReport;
  py::class_<BlasReport>(module, "BlasReport")
      .def_readonly("core", &BlasReport::core)
      .def_readonly("config", &BlasReport::config)
      .def_readonly("threads", &BlasReport::threads)
      .def_readonly("gflops", &BlasReport::gflops);
  module.def("blas_report", &supple::blas_report, Unlocked());
  module.def("set_blas_threads", &supple::set_blas_threads);
  module.def("load_pardiso", &supple::load_pardiso);
  module.def("pardiso_loaded", &supple::pardiso_loaded);
}
