/// Pairs of a posed template and a scan, both ways; private to the runtime.
#pragma once

#include "point_tree.hpp"
#include "rig_rows.hpp"
#include "rig_tree.hpp"
#include "supple/rig_fit.hpp"

namespace supple {

/// Where the scan lands on the template, and the rows that follow.
struct Pairs {
  std::vector<Row> rows;       ///< point to plane, from the scan and from the template
  Eigen::VectorXi triangle;    ///< (c) of the thinned scan; −1 left out
  Points barycentric;          ///< (c, 3)
  Eigen::VectorXd distance;    ///< (c) m
  std::vector<int> row_of;     ///< (c) row of each point, −1
  std::vector<int> vertex_row; ///< (n) row of each vertex, −1
  double area = 0.0;           ///< m² of scan that found a partner
};

/// Finds pairs; keeps the trees, and where points landed last.
class Matcher {
 public:
  explicit Matcher(const Rig& rig);
  void set_scan(const ScanCloud& scan);
  /// Each of `points` (m, 3) on the skin at `vertices`, however far.
  std::vector<Landing> land(const Points& vertices, const Points& points);

  /// Each of the scan's points on the skin at `vertices`, within `reach` m.
  std::vector<Landing> land_scan(const Points& vertices, double reach);

  /// Rows' weights are areas/(patch² noise²) × the data's weight, so that a patch counts as one
  /// observation, however many points it holds.
  void match(const SkinState& state, const RigStage& stage, const RigWeights& weights,
             const RigPriors& priors, Pairs& pairs);

 private:
  void from_scan(const Points& vertices, const RigStage& stage, double weight, Pairs& pairs);
  void land_each(double reach, std::size_t every);
  Row row_at(const RigStage& stage, double weight, Eigen::Index p, const Landing& at) const;
  void add_landing(Eigen::Index p, const Landing& at, const Row& row, Pairs& pairs) const;
  void from_template(const SkinState& state, const RigStage& stage, double weight, Pairs& pairs);
  void turn_normals(const Points& points);

  const Rig& rig_;
  const ScanCloud* scan_ = nullptr;
  SkinTree skin_;
  PointTree tree_;
  std::vector<int> vertex_order_; ///< neighbours near each other
  Points normals_;                ///< (n, 3) of the posed template, unit
  Eigen::VectorXd areas_;         ///< (n) m², a third of the triangles around
  std::vector<Landing> landed_;   ///< where each of the scan's points landed last, within
  double landed_reach_ = 0.0;     ///< that many m,
  Points landed_at_;              ///< (n, 3) on this skin; empty: not all of them
  std::vector<int> hint_;         ///< (c) leaf of the skin's tree where each point landed last
};

} // namespace supple
