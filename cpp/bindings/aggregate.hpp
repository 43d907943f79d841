/// Aggregation by a function of Python.
#pragma once

#include "core.hpp"
#include "supple/multigrid.hpp"

/// Calls `callback(start, column, modes) -> (count, aggregate, basis, coarse modes)` with the block
/// rows' columns, whether or not the GIL is held.
supple::Aggregate python_aggregate(const py::function& callback);
