/// A contribution to the equilibrium R(u) = 0: internal forces, loads, skin, supports.
#pragma once

#include <limits>
#include <string>

#include "supple/sparse.hpp"

namespace supple {

/// Smallest volume ratio of a term's cells and where it is.
struct VolumeRatio {
  double value = std::numeric_limits<double>::infinity();
  Index cell = -1; ///< of its term
  Index term = -1; ///< of the system, in the order of System::add
};

/// What a term does with u: node-major displacements of all nodes (3n), then the scalars.
///
/// Signs: residual = internal − external force. Thread counts do not change a bit of a result: sums
/// run over batches of cells in a fixed order.
class Term {
 public:
  virtual ~Term() = default;

  /// (cells, nodes per cell) nodes, then scalars, that its tangent couples, in the order of the
  /// maps that it takes; no rows where it has none.
  virtual const Connectivity& cells() const = 0;
  /// Whether energy() is the potential of residual().
  virtual bool has_energy() const = 0;
  /// Whether the tangent is symmetric.
  virtual bool symmetric() const = 0;
  virtual double energy(const ConstVector& u) const = 0;
  /// r += scale · residual.
  virtual void residual(const ConstVector& u, double scale, MutableVector r) const = 0;
  /// values += scale · tangent, at the places that `map` gives.
  virtual void tangent(const ConstVector& u, double scale, const Scatter& map,
                       MutableVector values) const = 0;
  /// The same of a symmetric tangent on the lower triangle of the free dofs.
  virtual void tangent(const ConstVector& u, double scale, const LowerScatter& map,
                       MutableVector values) const = 0;
  /// values += the tangents of this term and of another, where the two can be added up cell by
  /// cell; else false, and nothing is done.
  virtual bool tangent_with(const Term&, const ConstVector&, const Scatter&, MutableVector) const {
    return false;
  }
  /// Smallest J over the points of the cells; infinity for a term without volume.
  virtual VolumeRatio volume_ratio(const ConstVector& u) const = 0;

  /// Whether the load factor scales this term.
  bool is_load = false;
  /// It is zero whatever the displacement, as gravity is where there is none: not evaluated.
  bool is_silent = false;
};

/// Forces on nodes that depend on nothing.
class NodalForce final : public Term {
 public:
  /// @param forces (3n) N, node-major.
  explicit NodalForce(Vector forces) : forces_(std::move(forces)) { is_load = true; }
  void set_forces(Vector forces) { forces_ = std::move(forces); }

  const Connectivity& cells() const override { return cells_; }
  bool has_energy() const override { return true; }
  bool symmetric() const override { return true; }
  double energy(const ConstVector& u) const override {
    return -forces_.dot(u.head(forces_.size()));
  }
  void residual(const ConstVector&, double scale, MutableVector r) const override {
    r.head(forces_.size()) -= scale * forces_;
  }
  void tangent(const ConstVector&, double, const Scatter&, MutableVector) const override {}
  void tangent(const ConstVector&, double, const LowerScatter&, MutableVector) const override {}
  VolumeRatio volume_ratio(const ConstVector&) const override { return {}; }

 private:
  Vector forces_;
  Connectivity cells_;
};

} // namespace supple
