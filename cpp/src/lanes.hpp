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

/// Columns of a block, `step` entries apart in the values, get theirs from `a`: entry (p, q) from
/// a[p·down + q·right]. With `rows` = 3 there are three columns of three rows, of which the
/// `diagonal` block has one less in each; a scalar's block has one row, or one entry.
template <int rows, int columns, bool diagonal>
inline void add_block(const double* __restrict a, std::ptrdiff_t down, std::ptrdiff_t right,
                      std::ptrdiff_t step, double* to) {
  for (int q = 0; q < columns; ++q) {
    double* target = to + q * step - (q == 2 ? 1 : 0);
    for (int p = diagonal ? q : 0; p < rows; ++p)
      target[p] += a[p * down + q * right];
  }
}

/// The block of local nodes a and b of all lanes.
template <int L, int rows, int columns, bool diagonal>
void add_blocks(const LaneCells& cells, const LowerScatter& map, Index a, Index b,
                const Index* position, const double* block, double* values) {
  const std::ptrdiff_t blocks = map.blocks(), width = cells.width();
  const std::ptrdiff_t row = std::ptrdiff_t{3 * cells.m + cells.s} * L;
  const Index *step = map.step->data(), *node = cells.node;
  for (Index lane = 0; lane < cells.count; ++lane, ++block, position += blocks, node += width) {
    if (*position >= 0) {
      const bool transposed = !diagonal && node[a] < node[b];
      add_block<rows, columns, diagonal>(block, transposed ? L : row, transposed ? row : L,
                                         step[std::min(node[a], node[b])], values + *position);
    } else if (*position < -1) { // free in part
      const Index* entry = map.entry.data() - 2 - *position;
      for (Index i = 0; i < rows; ++i)
        for (Index j = 0; j < columns; ++j, ++entry)
          if (*entry >= 0) values[*entry] += block[i * row + j * L];
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
      const double* block = A + (row * d + column) * L;
      if (a >= cells.m && b >= cells.m)
        add_blocks<L, 1, 1, false>(cells, map, a, b, position, block, values);
      else if (a >= cells.m)
        add_blocks<L, 1, 3, false>(cells, map, a, b, position, block, values);
      else if (a == b)
        add_blocks<L, 3, 3, true>(cells, map, a, b, position, block, values);
      else
        add_blocks<L, 3, 3, false>(cells, map, a, b, position, block, values);
    }
  }
}

/// The block of local nodes a and b of all lanes, into rows of the whole matrix.
template <int L, int rows, int columns>
void add_rows(const LaneCells& cells, const Scatter& map, Index first, Index a, Index b,
              const double* block, double* values) {
  const std::ptrdiff_t width = cells.width(), row = std::ptrdiff_t{3 * cells.m + cells.s} * L;
  const Index* stride = map.row_stride.data() + first * width + a;
  const Index* position = map.position.data() + (first * width + a) * width + b;
  for (Index lane = 0; lane < cells.count; ++lane, ++block) {
    double* to = values + *position;
    for (int i = 0; i < rows; ++i, to += *stride)
      for (int j = 0; j < columns; ++j)
        to[j] += block[i * row + j * L];
    stride += width;
    position += width * width;
  }
}

/// values += the whole cell matrices.
template <int L>
void add_full(const LaneCells& cells, const Scatter& map, Index first, const double* A,
              double* values) {
  const std::ptrdiff_t d = 3 * cells.m + cells.s;
  for (Index a = 0; a < cells.width(); ++a) {
    const std::ptrdiff_t row = a < cells.m ? 3 * a : a + 2 * cells.m;
    for (Index b = 0; b < cells.width(); ++b) {
      const std::ptrdiff_t column = b < cells.m ? 3 * b : b + 2 * cells.m;
      const double* block = A + (row * d + column) * L;
      if (a < cells.m && b < cells.m)
        add_rows<L, 3, 3>(cells, map, first, a, b, block, values);
      else if (a < cells.m)
        add_rows<L, 3, 1>(cells, map, first, a, b, block, values);
      else if (b < cells.m)
        add_rows<L, 1, 3>(cells, map, first, a, b, block, values);
      else
        add_rows<L, 1, 1>(cells, map, first, a, b, block, values);
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
