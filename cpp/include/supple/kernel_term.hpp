/// A term whose cells are computed by generated kernels.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "supple/library.hpp"
#include "supple/term.hpp"

namespace supple {

class KernelTerm final : public Term {
 public:
  /// @param points (3n) coordinates of the mesh that the kernels live on, m, node-major.
  /// @param cells (cells, m + s) nodes in kernel order, then the cell's scalars as n + number.
  /// @param scalars how many there are in all.
  /// @throws ShapeError if the kernels have another number of nodes or scalars, or a number is out
  /// of range.
  KernelTerm(std::shared_ptr<const KernelLibrary> library, std::shared_ptr<const Vector> points,
             Connectivity cells, Index scalars = 0);

  /// The unit of the scalar unknowns, Pa/m: a pressure is this times its unknown, so that unknowns
  /// are metres and residuals newtons throughout.
  void set_scalar_unit(double unit) { scalar_unit_ = unit; }

  /// Values of a per-cell field, (cells · size) cell-major.
  /// @throws ShapeError for an unknown field or a wrong size.
  void set_field(const std::string& name, Vector values);

  const Connectivity& cells() const override { return cells_; }
  bool has_energy() const override { return energy_ != nullptr || tangent_ == nullptr; }
  bool symmetric() const override { return has_energy(); }
  double energy(const ConstVector& u) const override;
  void residual(const ConstVector& u, double scale, MutableVector r) const override;
  void tangent(const ConstVector& u, double scale, const Scatter& map,
               MutableVector values) const override;
  VolumeRatio volume_ratio(const ConstVector& u) const override;

  /// Output of the kernel `name` for each cell, (cells, rows).
  /// @throws Error if the library has no such kernel.
  Eigen::MatrixXd tabulate(const std::string& name, const ConstVector& u) const;

  const KernelLibrary& library() const { return *library_; }

 private:
  struct Buffers;
  void require_fields() const;
  /// Dof of entry `i` of the kernel's vectors, for the cell whose row of cells_ begins at `node`.
  Index dof(const Index* node, Index i) const {
    return i < 3 * nodes_ ? 3 * node[i / 3] + i % 3 : node[i - 2 * nodes_] + scalar_offset_;
  }
  double unit(Index i) const { return i < 3 * nodes_ ? 1.0 : scalar_unit_; }
  void add_residual(const ConstVector& u, double scale, MutableVector r) const;
  /// The residual of a load that does not depend on u (3n); computed once for the fields' values.
  const Vector& constant() const;
  /// Gather w and x of the batch of cells [first, first + lanes) and call the kernel on a zeroed A.
  void call(const supple_kernel& kernel, Index first, const ConstVector& u, Buffers& b) const;
  /// For each batch: call the kernel, then consume(first cell, cells in the batch, A, batch
  /// number).
  template <class Consume>
  void each(const supple_kernel& kernel, const ConstVector& u, Consume consume) const;

  std::shared_ptr<const KernelLibrary> library_;
  std::shared_ptr<const Vector> points_;
  Connectivity cells_;
  Index nodes_, scalars_;    // of a cell
  Index scalar_offset_;      // from a scalar's number in cells_ to its dof
  double scalar_unit_ = 1.0; // Pa/m
  Index group_ = 1;          // cells of a batch of colouring_
  Colouring colouring_;
  std::vector<Vector> fields_; // by field number; "u" stays empty
  mutable Vector constant_;
  const supple_kernel *energy_, *tangent_, *volume_ratio_;
};

} // namespace supple
