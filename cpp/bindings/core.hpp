/// What the binding files share.
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "supple/sparse.hpp"

namespace py = pybind11;

/// Other Python threads run while C++ works: on every call that may take longer than a glance.
using Unlocked = py::call_guard<py::gil_scoped_release>;

/// A (k, m) int32 array, row-major.
using CellArray = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;

/// The array as the runtime's connectivity.
inline supple::Connectivity connectivity(const CellArray& cells) {
  return Eigen::Map<const supple::Connectivity>(cells.data(), cells.shape(0), cells.shape(1));
}

void bind_system(py::module_& module);
void bind_closest_point(py::module_& module);
void bind_blas(py::module_& module);
void bind_multigrid(py::module_& module);
void bind_linear(py::module_& module);
void bind_rig(py::module_& module);
void bind_pose_search(py::module_& module);
