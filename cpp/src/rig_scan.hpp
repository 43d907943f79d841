/// A scan made ready for a fit: thinned, with normals, areas and borders; private to the runtime.
#pragma once

#include "supple/rig_fit.hpp"

namespace supple {

/// One point a voxel (the mean), or every point as it is; in an order that is local in space.
///
/// Normals are `normals`, else the direction in which the neighbours spread least, which noise
/// disturbs less than the triangles' own; those tell its sign, which stays open without them. A
/// point stands for its share of the disc around it, so the density of the scan does not count.
ScanCloud prepared(const GivenPoints& points, const GivenTriangles& triangles,
                   const GivenPoints& normals, const ScanSettings& settings);

} // namespace supple
