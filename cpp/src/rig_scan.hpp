/// A scan made ready for a fit: thinned, with normals, areas and borders; private to the runtime.
#pragma once

#include "supple/rig_fit.hpp"

namespace supple {

/// One point a voxel (the mean), or every point as it is; in an order that is local in space.
///
/// Normals come from `normals`, else from the triangles, else from the spread of the neighbours,
/// which leaves their sign open. A point stands for its share of its voxel's surface,
/// h²/(|n_x| + |n_y| + |n_z|), so the density of the scan does not count.
ScanCloud prepared(const Points& points, const Triangles& triangles, const Points& normals,
                   const ScanSettings& settings);

} // namespace supple
