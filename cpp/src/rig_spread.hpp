/// How residuals spread; private to the runtime.
#pragma once

#include <vector>

#include "rig_rows.hpp"

namespace supple {

/// Median of the absolute values × 1.4826: the standard deviation of normal values, deaf to
/// outliers.
double robust_sd(std::vector<double> values);

/// Mean residual of the rows in each cube of `size` m.
std::vector<double> patch_means(const std::vector<Row>& rows, const Points& vertices, double size);

} // namespace supple
