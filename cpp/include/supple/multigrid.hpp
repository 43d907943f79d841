/// Smoothed-aggregation multigrid on rigid motions: a preconditioner that never factorises the
/// whole matrix, so that time and memory stay in proportion to the unknowns.
///
///     elements of degree 2     → corners: a node is the mean of the corners that it lies between
///     nodes (3 × 3 blocks)     → aggregates, whose six rigid motions are the next level's unknowns
///     aggregates (6 × 6)       → aggregates of aggregates, until a direct factor is cheap
///
/// One V-cycle, two Chebyshev steps before and after, is symmetric and positive definite. It runs
/// in single precision: it need not be accurate, and what it reads bounds its time. The
/// prolongations are kept while they serve; Galerkin's products PᵀAP are renewed by each update.
/// Source: Vaněk, Mandel, Brezina (1996), Computing 56, 179–196.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "supple/block_matrix.hpp"
#include "supple/preconditioner.hpp"

namespace supple {

/// (rows of the matrix, 6) values of the rigid motions.
using Modes = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>;

/// Block rows put together, and the rigid motions in an orthonormal basis of each aggregate.
struct Aggregates {
  Index count = 0;
  std::vector<Index> aggregate; ///< (block rows) of each, −1 where it has none
  Modes basis;                  ///< (rows, 6) of the aggregate that the row is in
  Modes modes;                  ///< (6 count, 6): basis · modes are the fine ones
};

/// Aggregates of a level's matrix with its rigid motions; from a library.
using Aggregate = std::function<Aggregates(const BlockMatrix<double>& A, const Modes& modes)>;

/// Which corners the nodes of a mesh of degree 2 are the means of; a corner is that of itself.
struct Corners {
  std::vector<Index> start;  ///< (nodes + 1) offsets; empty for meshes of degree 1
  std::vector<Index> corner; ///< node numbers
};

/// Where the nodes of the mesh are at present (3 nodes), m.
using Places = std::function<Vector()>;

class Multigrid final : public Preconditioner {
 public:
  /// @param dof (unknowns) 3·node + direction of each unknown, ascending.
  /// @param places gives (3 nodes) where all nodes of the mesh are, m: rigid motions are of those.
  Multigrid(std::vector<Index> dof, Places places, Corners corners, Aggregate aggregate);
  ~Multigrid() override;

  /// Take over a matrix; the first time, and after start_over, it also makes the aggregates.
  ///
  /// NotPositiveDefinite where a diagonal block or the coarsest matrix shows that; a matrix may be
  /// indefinite all the same.
  /// @throws ShapeError where sizes do not fit; whatever the aggregation throws.
  FactorStatus update(const CscPattern& pattern, const Vector& values) override;

  /// z = one V-cycle on r; both (unknowns).
  /// @throws StateError unless the last update was ok.
  void apply(const Vector& r, Vector& z) override;

  bool exact() const override { return false; }
  void take(const CscPattern& pattern, const Vector& values) override;
  bool multiply(const Vector& x, Vector& y) override;
  void start_over() override;
  int break_even() const override;
  double bytes() const override;

  /// From level `level` + 1 to `level`, the finest being 0.
  const BlockMatrix<float>& prolongation(std::size_t level) const;
  /// Block rows of each level, the finest first.
  std::vector<Index> rows() const;
  /// Entries of all levels' matrices over those of the finest.
  double complexity() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

} // namespace supple
