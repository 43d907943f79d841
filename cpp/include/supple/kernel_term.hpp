/// A term whose cells are computed by generated kernels.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "supple/library.hpp"
#include "supple/term.hpp"

namespace supple {

/// Not to be used by two threads at once: it keeps its working memory, so that nothing is allocated
/// in a Newton step.
class KernelTerm final : public Term {
 public:
  /// @param points (3n) coordinates of the mesh that the kernels live on, m, node-major.
  /// @param cells (cells, m + s) nodes in kernel order, then the cell's scalars as n + number.
  /// @param scalars how many there are in all.
  /// @throws ShapeError if the kernels have another number of nodes or scalars, or a number is out
  /// of range.
  KernelTerm(std::shared_ptr<const KernelLibrary> library, std::shared_ptr<const Vector> points,
             const Connectivity& cells, Index scalars = 0);
  ~KernelTerm() override;

  /// The unit of the scalar unknowns, Pa/m: a pressure is this times its unknown, so that unknowns
  /// are metres and residuals newtons throughout.
  void set_scalar_unit(double unit) { scalar_unit_ = unit; }

  /// Values of a per-cell field, (cells · size) cell-major, the cells as they were given.
  /// @throws ShapeError for an unknown field or a wrong size.
  void set_field(const std::string& name, const ConstVector& values);

  /// In the order of the batches, along a curve through the body.
  const Connectivity& cells() const override { return tangent_ == nullptr ? none_ : cells_; }
  /// As they were given.
  Connectivity given_cells() const;
  bool has_energy() const override { return energy_ != nullptr || tangent_ == nullptr; }
  bool symmetric() const override { return has_energy(); }
  double energy(const ConstVector& u) const override;
  void residual(const ConstVector& u, double scale, MutableVector r) const override;
  void tangent(const ConstVector& u, double scale, const Scatter& map,
               MutableVector values) const override;
  void tangent(const ConstVector& u, double scale, const LowerScatter& map,
               MutableVector values) const override;
  /// Of terms on the same cells, without scalars, whose kernels give whole matrices.
  bool tangent_with(const Term& other, const ConstVector& u, const Scatter& map,
                    MutableVector values) const override;
  /// The cell's number is that of the cells as they were given.
  VolumeRatio volume_ratio(const ConstVector& u) const override;

  /// Output of the kernel `name` for each cell as it was given, (cells, rows · cols).
  /// @throws Error if the library has no such kernel.
  Eigen::MatrixXd tabulate(const std::string& name, const ConstVector& u) const;

  const KernelLibrary& library() const { return *library_; }

 private:
  struct Buffers;
  struct Workspace;
  /// A field's values, [batch][entry][lane], or [entry][lane] alike in all batches.
  struct Field {
    Vector values;
    std::ptrdiff_t stride = 0; // from batch to batch
  };

  void require_fields() const;
  void add_residual(const ConstVector& u, double scale, MutableVector r) const;
  /// The residual of a load that does not depend on u (3n); computed once for the fields' values.
  const Vector& constant() const;
  bool matches(const KernelTerm& other) const;
  /// The entries of w that are alike in all batches.
  void fill_constants(const supple_kernel& kernel, Buffers& b) const;
  /// Gather w and x of the batch of cells [first, first + lanes) and let the kernel add to A.
  template <int L>
  void add(const supple_kernel& kernel, Index first, const double* u, Buffers& b, double* A) const;
  /// For each batch: call the kernel, then consume(lanes, first cell, cells in the batch, A, group
  /// number); lanes is an integral constant.
  template <class Consume>
  void each(const supple_kernel& kernel, const ConstVector& u, Consume consume) const;
  template <int L, class Consume>
  void each_of(const supple_kernel& kernel, const double* u, Consume consume) const;
  /// What the scale and the unit of the scalars make of the tangent's entries.
  void scale_tangent(double scale, double* A) const;

  std::shared_ptr<const KernelLibrary> library_;
  std::shared_ptr<const Vector> points_;
  Index nodes_, scalars_;    // of a cell
  Index scalar_offset_;      // from a scalar's number in cells_ to its dof
  std::vector<Index> order_; // (cells) given number of each
  Connectivity cells_, none_;
  double scalar_unit_ = 1.0; // Pa/m
  Index group_ = 1;          // cells of a batch of colouring_
  Colouring colouring_;
  std::vector<Field> fields_; // by field number; "u" stays empty
  mutable Vector constant_;
  const supple_kernel *energy_, *tangent_, *volume_ratio_;
  std::unique_ptr<Workspace> work_;
};

} // namespace supple
