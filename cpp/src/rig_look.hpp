/// What the neighbours of a thinned scan's points say of its surface; private to the runtime.
#pragma once

#include <array>
#include <vector>

#include "point_tree.hpp"

namespace supple {

/// Of each point, by those within a radius of it.
struct Around {
  Points normal;            ///< along their least spread; 0 of fewer than four
  Eigen::VectorXd share;    ///< m² of the surface: the disc over its points
  std::vector<char> border; ///< they lie to one side
  Eigen::VectorXd dip;      ///< m, along the normal: their mean against the point
  /// Pairs of points that are of one piece, by parts of the cloud.
  std::vector<std::vector<std::array<int, 2>>> links;
};

/// `held` (n): scan points that each stands for, by which they count for the normals; points closer
/// than `gap` m, at most `radius`, are linked. The mean of a half disc is 0.42 of its radius from
/// its centre: that tells a border, and how much of the disc is there. Bitwise the same for any
/// number of threads.
Around look_around(const Points& points, const Eigen::VectorXd& held, const PointTree& tree,
                   double radius, double gap);

/// Which of the points belong to pieces of a `share` of all at least; the largest does always.
/// Source: Tarjan (1975), J. ACM 22(2), union by number and path halving.
std::vector<char> main_pieces(const Around& around, double share);

/// Puts means of voxels of `size` back on a curved surface. The mean of a square of side h is
/// h²/12 · H off it, H the mean curvature; that of a disc of radius r, r²/4 · H: the difference is
/// what `dip` measures.
void uncurve(const Around& around, double size, double radius, Points& points);

} // namespace supple
