/// Between arrays [entry][lane] of W = L cells and what belongs to nodes; private to the runtime.
///
/// Nothing here allocates or locks. Cells that share a node must not be treated at once by two
/// threads (see colour_cells); the lanes of one call may share nodes.
#pragma once

#include <algorithm>
#include <cstddef>

#include "supple/sparse.hpp"

namespace supple {

/// The cells of a call: `count` ≤ L rows of a connectivity, m nodes and s scalars each.
struct LaneCells {
  const Index* node; ///< first row
  Index count, m, s;

  Index width() const { return m + s; }
  const Index* row(Index lane) const { return node + std::ptrdiff_t{lane} * width(); }
};

/// to[3a + i][lane] = from[3·node + i] for the m nodes; idle lanes repeat the last cell.
template <int L>
void gather_nodes(const LaneCells& cells, const double* from, double* to) {
  for (Index lane = 0; lane < L; ++lane) {
    const Index* node = cells.row(std::min(lane, cells.count - 1));
    for (Index a = 0; a < cells.m; ++a) {
      const double* value = from + 3 * std::ptrdiff_t{node[a]};
      double* target = to + 3 * a * L + lane;
      target[0] = value[0];
      target[L] = value[1];
      target[2 * L] = value[2];
    }
  }
}

/// to[3·node + i] += scale · from[3a + i][lane] for the m nodes.
template <int L>
void scatter_nodes(const LaneCells& cells, const double* from, double scale, double* to) {
  for (Index lane = 0; lane < cells.count; ++lane) {
    const Index* node = cells.row(lane);
    for (Index a = 0; a < cells.m; ++a) {
      double* target = to + 3 * std::ptrdiff_t{node[a]};
      const double* value = from + 3 * a * L + lane;
      target[0] += scale * value[0];
      target[1] += scale * value[L];
      target[2] += scale * value[2 * L];
    }
  }
}

/// Where entry (i, j) of a block goes from its first: i[i] + j[j].
struct BlockStrides {
  Index i1, i2, j1, j2;

  /// In columns `step` apart; in rows if the local block is the transposed one.
  static BlockStrides of(Index step, bool transposed) {
    const Index near = 1, far = 2, second = step, third = 2 * step - 1;
    return {transposed ? second : near, transposed ? third : far, transposed ? near : second,
            transposed ? far : third};
  }
};

/// The 3 × 3 block `a`, whose rows are `row` apart; only its lower triangle if it is `diagonal`.
template <int L, bool diagonal>
inline void add_block(const double* a, std::ptrdiff_t row, const BlockStrides& s, double* to) {
  const double *b = a + row, *c = b + row;
  double *second = to + s.i1, *third = to + s.i2;
  to[0] += a[0];
  if (!diagonal) to[s.j1] += a[L];
  if (!diagonal) to[s.j2] += a[2 * L];
  second[0] += b[0];
  second[s.j1] += b[L];
  if (!diagonal) second[s.j2] += b[2 * L];
  third[0] += c[0];
  third[s.j1] += c[L];
  third[s.j2] += c[2 * L];
}

/// The entries of a block of which a part is free.
template <int L>
void add_part(const double* a, std::ptrdiff_t row, Index rows, Index columns, const Index* entry,
              double* values) {
  for (Index i = 0; i < rows; ++i)
    for (Index j = 0; j < columns; ++j, ++entry)
      if (*entry >= 0) values[*entry] += a[i * row + j * L];
}

/// The block (a, b) of all lanes.
template <int L>
void add_blocks(const LaneCells& cells, const LowerScatter& map, Index a, Index b,
                const Index* position, const double* block, double* values) {
  const std::ptrdiff_t blocks = map.blocks();
  const std::ptrdiff_t row = std::ptrdiff_t{3 * cells.m + cells.s} * L;
  const Index rows = a < cells.m ? 3 : 1, columns = b < cells.m ? 3 : 1;
  const Index* step = map.step->data();
  for (Index lane = 0; lane < cells.count; ++lane, ++block, position += blocks) {
    if (*position == -1) continue;
    if (*position < -1) {
      add_part<L>(block, row, rows, columns, map.entry.data() - 2 - *position, values);
      continue;
    }
    const Index* node = cells.row(lane);
    double* to = values + *position;
    const Index column = std::min(node[a], node[b]);
    const BlockStrides s = BlockStrides::of(step[column], node[a] < node[b]);
    if (rows == 3) {
      a == b ? add_block<L, true>(block, row, s, to) : add_block<L, false>(block, row, s, to);
    } else {
      to[0] += block[0];
      if (columns == 1) continue;
      to[s.j1] += block[L];
      to[s.j2] += block[2 * L];
    }
  }
}

/// values += the cell matrices, of which entries with column ≤ row are read.
template <int L>
void add_lower(const LaneCells& cells, const LowerScatter& map, Index first, const double* A,
               double* values) {
  const std::ptrdiff_t d = 3 * cells.m + cells.s;
  const Index* position = map.position.data() + first * map.blocks();
  for (Index a = 0; a < cells.width(); ++a) {
    const std::ptrdiff_t row = a < cells.m ? 3 * a : a + 2 * cells.m;
    for (Index b = 0; b <= a; ++b, ++position) {
      const std::ptrdiff_t column = b < cells.m ? 3 * b : b + 2 * cells.m;
      add_blocks<L>(cells, map, a, b, position, A + (row * d + column) * L, values);
    }
  }
}

/// Entries with column > row, from those below the diagonal.
template <int L>
void mirror_lower(std::ptrdiff_t d, double* A) {
  for (std::ptrdiff_t r = 0; r < d; ++r)
    for (std::ptrdiff_t c = 0; c < r; ++c)
      std::copy_n(A + (r * d + c) * L, L, A + (c * d + r) * L);
}

} // namespace supple
