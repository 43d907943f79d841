/// Sparsity of a mesh: node graph, CSR pattern, scatter maps, reduction to free dofs, colours.
///
/// Conventions: a node has three dofs, node-major (dof 3a + i is direction i of node a). After the
/// n nodes come the scalars, such as the pressures of a mixed form: scalar s is node n + s of a
/// connectivity and has the one dof 3n + s. The global matrix is CSR, unsymmetric pattern in
/// general, columns ascending; its three rows of node a lie one after the other and have equal
/// length, so block (a, b) starts at one position and its next row is `row_stride` further on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <Eigen/Core>
#include <memory>
#include <vector>

namespace supple {

using Index = std::int32_t;
/// (cells, nodes per cell) node numbers of each cell, its scalars last.
using Connectivity = Eigen::Matrix<Index, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
/// (dofs) true where the dof is free.
using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;
using Vector = Eigen::VectorXd;
using ConstVector = Eigen::Ref<const Eigen::VectorXd>;
using MutableVector = Eigen::Ref<Eigen::VectorXd>;

/// Where the cell matrices of one connectivity go in the global CSR values.
struct Scatter {
  Index cells = 0;
  Index nodes_per_cell = 0;      ///< m with three dofs
  Index scalars_per_cell = 0;    ///< s with one, behind them
  std::vector<Index> position;   ///< (cells, m + s, m + s) first entry of block (a, b)
  std::vector<Index> row_stride; ///< (cells, m + s) from one row of local node a to its next row
};

/// Which nodes share a cell.
struct NodeGraph {
  Index nodes = 0;
  std::vector<Index> home;       ///< (scalars) the node whose neighbours a scalar shares
  std::vector<Index> node_start; ///< (nodes + scalars + 1) offsets into `neighbour`
  std::vector<Index> neighbour;  ///< nodes that share a cell with a node, itself too, ascending

  Index scalars() const { return static_cast<Index>(home.size()); }
  Index dofs() const { return 3 * nodes + scalars(); }
  Index width(Index a) const { return a < nodes ? 3 : 1; }
  Index first_dof(Index a) const { return a < nodes ? 3 * a : a + 2 * nodes; }
  /// Entry of `neighbour` that says that `b` is one of `a`, −1 if the nodes share no cell.
  Index find(Index a, Index b) const;
};

/// A node without cells keeps itself as neighbour. Cost O(cells m²).
/// @param home (scalars) the node whose neighbours each scalar shares; empty where there are none.
/// @throws ShapeError if a cell names a node outside [0, nodes + scalars), or the matrix exceeds
/// 2³¹ entries.
NodeGraph node_graph(Index nodes, const std::vector<Connectivity>& connectivities,
                     std::vector<Index> home = {});

/// (nodes) the connected piece of each node, numbered from 0 in the order of their first nodes.
/// @throws ShapeError if a cell names a node outside [0, nodes).
std::vector<Index> connected_pieces(Index nodes, const Connectivity& cells);

/// Node graph of a mesh and the CSR pattern of its stiffness matrix.
struct BlockPattern : NodeGraph {
  std::vector<Index> row_start; ///< (dofs + 1) CSR offsets
  std::vector<Index> column;    ///< (nonzeros) CSR columns
  std::vector<Scatter> scatter; ///< one for each connectivity, in the order given

  Index nonzeros() const { return static_cast<Index>(column.size()); }
  /// From one row of node `a` to its next row: the length of its rows.
  Index row_stride(Index a) const;
  /// First entry of block (a, b) in the CSR values, −1 if the nodes share no cell.
  Index position(Index a, Index b) const;
};

/// Pattern of a mesh with `nodes` nodes, and the scatter map of each connectivity.
///
/// A node without cells keeps its diagonal block. Cost O(cells m² log).
/// @throws ShapeError as node_graph, and if a cell has a scalar before a node.
BlockPattern block_pattern(Index nodes, const std::vector<Connectivity>& connectivities,
                           std::vector<Index> home = {});
/// The same from the graph of these connectivities.
BlockPattern block_pattern(NodeGraph graph, const std::vector<Connectivity>& connectivities);

/// values += cell matrix: entry (r, c) of the row-major (d × d) matrix, d = 3m + s, is
/// `matrix[(r·d + c)·step]`.
///
/// `step` is 1 for one cell, the number of lanes for cells in lanes. Neither allocates nor locks:
/// cells that share a node must not be scattered at once (see colour_cells).
inline void scatter_add(const Scatter& map, Index cell, const double* matrix, double* values,
                        std::ptrdiff_t step = 1) {
  const auto m = static_cast<std::ptrdiff_t>(map.nodes_per_cell);
  const std::ptrdiff_t all = m + map.scalars_per_cell, d = 2 * m + all;
  const Index* position = map.position.data() + cell * all * all;
  const Index* row_stride = map.row_stride.data() + cell * all;
  const double* row = matrix;
  for (std::ptrdiff_t a = 0; a < all; ++a) {
    for (std::ptrdiff_t i = 0; i < (a < m ? 3 : 1); ++i, row += d * step) {
      double* target = values + i * row_stride[a];
      for (std::ptrdiff_t b = 0; b < m; ++b) {
        double* block = target + position[a * all + b];
        for (std::ptrdiff_t j = 0; j < 3; ++j)
          block[j] += row[(3 * b + j) * step];
      }
      for (std::ptrdiff_t b = m; b < all; ++b)
        target[position[a * all + b]] += row[(2 * m + b) * step];
    }
  }
}

/// y = K x with the CSR values of `pattern`; the sum of each row is in a fixed order.
/// @throws ShapeError if a size does not fit.
void multiply(const BlockPattern& pattern, const ConstVector& values, const ConstVector& x,
              MutableVector y);

/// Pattern of a sparse matrix by columns, rows ascending, with the group (node) of each unknown.
struct CscPattern {
  std::int64_t size = 0;
  std::vector<std::int64_t> start; ///< (size + 1) offsets of the columns
  std::vector<std::int64_t> row;   ///< (nonzeros) rows, ascending in a column
  std::vector<Index> group;        ///< (size) unknowns of one group have equal neighbours; or empty
  bool lower = false;              ///< only row ≥ column is stored, the matrix is symmetric

  std::int64_t nonzeros() const { return static_cast<std::int64_t>(row.size()); }
};

inline bool operator==(const CscPattern& a, const CscPattern& b) {
  return a.lower == b.lower && a.start == b.start && a.group == b.group && a.row == b.row;
}

/// Which part of the reduced matrix is stored.
enum class Storage { Lower, Full };

/// The free dofs and where the reduced matrix finds its values; made once per boundary condition.
struct Reduction {
  std::vector<Index> dof;     ///< (free) dof of each unknown, ascending
  std::vector<Index> unknown; ///< (dofs) unknown of each dof, −1 where fixed
  CscPattern pattern;         ///< of the reduced matrix
  std::vector<Index> source;  ///< (reduced nonzeros) position in the CSR values
  Index full_nonzeros = 0;    ///< of the CSR matrix that it is taken from

  Index free() const { return static_cast<Index>(dof.size()); }
  /// reduced = the reduced matrix's values, taken from the CSR `values`; no search, no allocation.
  /// Storage::Lower reads the upper triangle of the rows, which holds the same numbers.
  /// @throws ShapeError if a size does not fit.
  void gather(const ConstVector& values, MutableVector reduced) const;
  /// Entries of the free dofs.
  Vector restrict(const ConstVector& full) const;
  /// full[free dofs] += scale · reduced.
  void add_to(const ConstVector& reduced, double scale, MutableVector full) const;
};

/// @throws ShapeError if `free` does not have one entry for each dof.
Reduction reduce(const BlockPattern& pattern, const Mask& free, Storage storage);

/// The lower triangle, without the CSR matrix that it would be taken from: `source` stays empty.
/// @throws ShapeError if `free` does not have one entry for each dof.
Reduction reduce_lower(const NodeGraph& graph, const Mask& free);

/// Where the cell matrices of one connectivity go in the values of a reduced lower triangle.
///
/// Block (a, b ≤ a) of a cell has its first entry at `position`. If node a is numbered above node b
/// its rows are rows of the matrix, and its second column is `step[b]` further on, its third
/// 2·step[b] − 1; if below, they are columns, and `step[a]` counts. This holds where all dofs of
/// the two are free; if some are fixed `position` is −2 − e, and `entry[e + i·width(b) + j]` is the
/// place of entry (i, j), −1 where there is none.
struct LowerScatter {
  Index cells = 0;
  Index nodes_per_cell = 0;    ///< m with three dofs
  Index scalars_per_cell = 0;  ///< s with one, behind them
  std::vector<Index> position; ///< (cells, (m + s)(m + s + 1)/2) row by row; −1: nothing is free
  std::vector<Index> entry;    ///< of the blocks that are free in part
  std::shared_ptr<const std::vector<Index>> step; ///< (nodes + scalars)

  std::ptrdiff_t blocks() const {
    const std::ptrdiff_t all = nodes_per_cell + scalars_per_cell;
    return all * (all + 1) / 2;
  }
};

/// @param reduction of storage Lower, of the same graph.
/// @throws ShapeError if a cell has a scalar before a node, or names nodes that share no cell.
std::vector<LowerScatter> lower_scatter(const NodeGraph& graph, const Reduction& reduction,
                                        const std::vector<Connectivity>& connectivities);

/// Where the CSR values hold the transposed entry of each that `reduction`, of storage Lower,
/// takes.
/// @throws ShapeError if it stores the full matrix.
std::vector<Index> mirror(const BlockPattern& pattern, const Reduction& reduction);

/// Batches of cells in the order of their colours; batches of one colour share no node.
struct Colouring {
  std::vector<Index> order;  ///< (batches) batch numbers; batch k is cells [k·batch, (k+1)·batch)
  std::vector<Index> offset; ///< (colours + 1) colour c is order[offset[c] … offset[c+1])

  Index colours() const { return static_cast<Index>(offset.size()) - 1; }
};

/// Greedy first-fit colouring in the order of the batches: depends on nothing but its arguments.
/// With `batch` = 1 a batch is a cell. Cost O(cells m), where batches are many cells that lie
/// together.
/// @throws ShapeError if a cell names a node outside [0, nodes), or batch < 1.
Colouring colour_cells(const Connectivity& cells, Index nodes, Index batch = 1);

} // namespace supple
