#include "supple/sparse.hpp"

#include <algorithm>
#include <numeric>
#include <set>

#include "check.hpp"
#include "fixtures.hpp"
#include "supple/error.hpp"

using namespace supple;

namespace {

/// A volume and a surface connectivity on the same nodes, and a node without cells.
struct Case {
  Connectivity tetrahedra = fixtures::box_tetrahedra(3, 2, 2);
  Connectivity triangles = tetrahedra.leftCols(3).topRows(10);
  Index nodes = fixtures::box_nodes(3, 2, 2) + 1;
  BlockPattern pattern = block_pattern(nodes, {tetrahedra, triangles});
};

Eigen::MatrixXd dense_lower(const CscPattern& pattern, const Vector& values, bool mirror) {
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(pattern.size, pattern.size);
  for (std::int64_t c = 0; c < pattern.size; ++c)
    for (auto k = pattern.start[static_cast<std::size_t>(c)];
         k < pattern.start[static_cast<std::size_t>(c) + 1]; ++k) {
      const auto r = pattern.row[static_cast<std::size_t>(k)];
      full(r, c) = values[k];
      if (mirror) full(c, r) = values[k];
    }
  return full;
}

} // namespace

/// Summing the cell matrices by node numbers into a dense matrix gives the same matrix.
TEST(scatter_equals_dense_assembly) {
  const Case box;
  std::mt19937 random(1), again(1);
  const Vector values = fixtures::assemble(box.pattern, 0.5, random);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(box.pattern.dofs(), box.pattern.dofs());
  for (const Connectivity& cells : {box.tetrahedra, box.triangles})
    for (Eigen::Index c = 0; c < cells.rows(); ++c) {
      const auto m = static_cast<int>(cells.cols());
      const Eigen::MatrixXd k = fixtures::cell_matrix(m, 0.5, again);
      for (int r = 0; r < 3 * m; ++r)
        for (int s = 0; s < 3 * m; ++s)
          expected(3 * cells(c, r / 3) + r % 3, 3 * cells(c, s / 3) + s % 3) += k(r, s);
    }
  CHECK_BELOW((fixtures::dense(box.pattern, values) - expected).cwiseAbs().maxCoeff(),
              1e-13 * expected.norm());
}

/// Lane l of an array [entry][lane] scatters as that cell's own matrix does.
TEST(scatter_reads_one_lane_of_many) {
  const Case box;
  const Scatter& map = box.pattern.scatter[0];
  std::mt19937 random(2);
  const Eigen::Matrix<double, -1, -1, Eigen::RowMajor> k = fixtures::cell_matrix(4, 1.0, random);
  std::vector<double> lanes(144 * 8, 1e9);
  for (std::size_t e = 0; e < 144; ++e)
    lanes[8 * e + 5] = k.data()[e];
  Vector plain = Vector::Zero(box.pattern.nonzeros()), batched = plain;
  scatter_add(map, 7, k.data(), plain.data());
  scatter_add(map, 7, lanes.data() + 5, batched.data(), 8);
  CHECK(plain == batched);
}

/// Scalars behind the nodes: one for each corner of the box, every cell couples its four with its
/// nodes.
struct MixedCase {
  Index nodes = fixtures::box_nodes(3, 2, 2);
  Connectivity tetrahedra = fixtures::box_tetrahedra(3, 2, 2);
  Connectivity cells{tetrahedra.rows(), 8};
  BlockPattern pattern;

  MixedCase() {
    cells << tetrahedra, tetrahedra.array() + nodes;
    std::vector<Index> home(static_cast<std::size_t>(nodes));
    std::iota(home.begin(), home.end(), 0);
    pattern = block_pattern(nodes, {cells}, home);
  }
  /// Dofs of a cell in the order of its matrix: 3 for each node, then 1 for each scalar.
  std::vector<Index> dofs(Eigen::Index cell) const {
    std::vector<Index> result;
    for (Eigen::Index a = 0; a < 8; ++a)
      for (Index i = 0; i < (a < 4 ? 3 : 1); ++i)
        result.push_back(pattern.first_dof(cells(cell, a)) + i);
    return result;
  }
};

/// Summing the cell matrices by dof numbers into a dense matrix gives the same matrix.
TEST(scatter_with_scalars_equals_dense_assembly) {
  const MixedCase box;
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Vector values = Vector::Zero(box.pattern.nonzeros());
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(box.pattern.dofs(), box.pattern.dofs());
  for (Index c = 0; c < static_cast<Index>(box.cells.rows()); ++c) {
    Eigen::Matrix<double, 16, 16, Eigen::RowMajor> k;
    for (Eigen::Index e = 0; e < k.size(); ++e)
      k.data()[e] = uniform(random);
    scatter_add(box.pattern.scatter[0], c, k.data(), values.data());
    const std::vector<Index> dofs = box.dofs(c);
    for (std::size_t r = 0; r < dofs.size(); ++r)
      for (std::size_t s = 0; s < dofs.size(); ++s)
        expected(dofs[r], dofs[s]) += k(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(s));
  }
  CHECK(box.pattern.dofs() == 4 * box.nodes);
  CHECK_BELOW((fixtures::dense(box.pattern, values) - expected).cwiseAbs().maxCoeff(),
              1e-13 * expected.norm());
}

/// A scalar's unknown belongs to the group of its home, whose neighbours it shares.
TEST(scalars_are_grouped_with_their_home) {
  const MixedCase box;
  const Mask free = Mask::Constant(box.pattern.dofs(), true);
  const Reduction reduction = reduce(box.pattern, free, Storage::Lower);
  for (Index a = 0; a < box.nodes; ++a) {
    CHECK(reduction.pattern.group[static_cast<std::size_t>(3 * a)] == a);
    CHECK(reduction.pattern.group[static_cast<std::size_t>(3 * box.nodes + a)] == a);
  }
  for (std::size_t r = 0; r + 1 < box.pattern.row_start.size(); ++r)
    CHECK(std::is_sorted(box.pattern.column.begin() + box.pattern.row_start[r],
                         box.pattern.column.begin() + box.pattern.row_start[r + 1]));
}

TEST(scalars_before_nodes_are_refused) {
  Connectivity mixed_up(1, 2);
  mixed_up << 4, 0;
  CHECK_THROWS(block_pattern(4, {mixed_up}, {0}), ShapeError);
}

/// Columns ascend, the pattern is symmetric, and holds the neighbours that a search over cells
/// finds.
TEST(pattern_is_the_node_graph) {
  const Case box;
  std::set<std::pair<Index, Index>> expected;
  for (Index n = 0; n < box.nodes; ++n)
    expected.insert({n, n});
  for (Eigen::Index c = 0; c < box.tetrahedra.rows(); ++c)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        expected.insert({box.tetrahedra(c, a), box.tetrahedra(c, b)});
  CHECK(static_cast<std::size_t>(box.pattern.nonzeros()) == 9 * expected.size());
  for (Index a = 0; a < box.nodes; ++a)
    for (Index b = 0; b < box.nodes; ++b) {
      const Index position = box.pattern.position(a, b);
      CHECK((position >= 0) == (expected.count({a, b}) == 1));
      if (position < 0) continue;
      const Index last_row = position + 2 * box.pattern.row_stride(a);
      CHECK(box.pattern.column[static_cast<std::size_t>(last_row)] == 3 * b);
      CHECK(box.pattern.row_start[static_cast<std::size_t>(3 * a) + 2] <= last_row);
    }
  for (std::size_t r = 0; r + 1 < box.pattern.row_start.size(); ++r)
    CHECK(std::is_sorted(box.pattern.column.begin() + box.pattern.row_start[r],
                         box.pattern.column.begin() + box.pattern.row_start[r + 1]));
}

/// Boxes apart, cells in any order; a node without cells is a piece of its own.
TEST(pieces_are_the_boxes_that_share_no_node) {
  const Connectivity box = fixtures::box_tetrahedra(3, 2, 2);
  const Index size = fixtures::box_nodes(3, 2, 2);
  Connectivity cells(2 * box.rows(), 4);
  for (Eigen::Index c = 0; c < box.rows(); ++c) {
    cells.row(2 * c + 1) = box.row(box.rows() - 1 - c);
    cells.row(2 * c) = box.row(c).array() + size;
  }
  const std::vector<Index> piece = connected_pieces(2 * size + 1, cells);
  for (Index node = 0; node <= 2 * size; ++node)
    CHECK(piece[static_cast<std::size_t>(node)] == node / size);
  CHECK_THROWS(connected_pieces(size, cells), ShapeError);
}

TEST(product_equals_dense_product) {
  const Case box;
  std::mt19937 random(3);
  const Vector values = fixtures::assemble(box.pattern, 1.0, random);
  const Vector x = Vector::LinSpaced(box.pattern.dofs(), -1.0, 2.0);
  Vector y(box.pattern.dofs());
  multiply(box.pattern, values, x, y);
  const Vector expected = fixtures::dense(box.pattern, values) * x;
  CHECK_BELOW((y - expected).norm(), 1e-14 * expected.norm());
}

/// The reduced matrix is the dense one without the rows and columns of the fixed dofs.
TEST(reduction_equals_dense_restriction) {
  const Case box;
  std::mt19937 random(4);
  for (const Storage storage : {Storage::Lower, Storage::Full}) {
    const Vector values =
        fixtures::assemble(box.pattern, storage == Storage::Full ? 1.0 : 0.0, random);
    const Reduction reduction = reduce(box.pattern, fixtures::some_free(box.nodes), storage);
    Vector reduced(reduction.pattern.nonzeros());
    reduction.gather(values, reduced);
    const Eigen::MatrixXd expected =
        fixtures::restrict_dense(fixtures::dense(box.pattern, values), reduction);
    const Eigen::MatrixXd got = dense_lower(reduction.pattern, reduced, storage == Storage::Lower);
    CHECK_BELOW((got - expected).cwiseAbs().maxCoeff(), 1e-13 * expected.norm());
    for (std::size_t c = 0; c + 1 < reduction.pattern.start.size(); ++c)
      CHECK(std::is_sorted(reduction.pattern.row.begin() + reduction.pattern.start[c],
                           reduction.pattern.row.begin() + reduction.pattern.start[c + 1]));
  }
}

TEST(restriction_and_its_transpose_move_the_free_dofs_only) {
  const Case box;
  const Mask free = fixtures::some_free(box.nodes);
  const Reduction reduction = reduce(box.pattern, free, Storage::Lower);
  const Vector full = Vector::LinSpaced(box.pattern.dofs(), 1.0, 9.0);
  Vector back = Vector::Zero(full.size());
  reduction.add_to(reduction.restrict(full), 2.0, back);
  CHECK(back == Vector(2.0 * full.array() * free.cast<double>()));
}

/// No two batches of a colour share a node, and every batch occurs once.
TEST(cells_of_one_colour_share_no_node) {
  const Connectivity cells = fixtures::box_tetrahedra(5, 4, 3);
  for (const Index batch : {1, 4, 7}) {
    const Colouring colours = colour_cells(cells, fixtures::box_nodes(5, 4, 3), batch);
    for (Index c = 0; c < colours.colours(); ++c) {
      std::set<Index> seen;
      for (Index k = colours.offset[static_cast<std::size_t>(c)];
           k < colours.offset[static_cast<std::size_t>(c) + 1]; ++k) {
        std::set<Index> own;
        const Index number = colours.order[static_cast<std::size_t>(k)];
        for (Index e = number * batch;
             e < std::min<Index>((number + 1) * batch, static_cast<Index>(cells.rows())); ++e)
          for (int a = 0; a < 4; ++a)
            own.insert(cells(e, a));
        for (Index node : own)
          CHECK(seen.insert(node).second);
      }
    }
    std::vector<Index> order = colours.order, all(order.size());
    std::iota(all.begin(), all.end(), 0);
    CHECK(colours.order == colour_cells(cells, fixtures::box_nodes(5, 4, 3), batch).order);
    std::sort(order.begin(), order.end());
    CHECK(order == all && static_cast<Index>(order.size()) == (cells.rows() + batch - 1) / batch);
    CHECK(batch > 1 || colours.colours() <= 40); // 24 cells meet at a node, so 24 at least
  }
}

TEST(wrong_arguments_are_refused) {
  Connectivity cells(1, 4);
  cells << 0, 1, 2, 4;
  CHECK_THROWS(block_pattern(4, {cells}), ShapeError);
  CHECK_THROWS(colour_cells(cells, 4), ShapeError);
  CHECK_THROWS(colour_cells(cells, 5, 0), ShapeError);
  const BlockPattern pattern = block_pattern(5, {cells});
  CHECK_THROWS(reduce(pattern, Mask::Constant(4, true), Storage::Full), ShapeError);
  const Reduction reduction = reduce(pattern, Mask::Constant(15, true), Storage::Full);
  Vector reduced(reduction.pattern.nonzeros());
  CHECK_THROWS(reduction.gather(Vector::Zero(pattern.nonzeros() - 1), reduced), ShapeError);
}

TEST(empty_meshes_are_no_special_case) {
  const BlockPattern none = block_pattern(0, {});
  CHECK(none.nonzeros() == 0 && none.dofs() == 0);
  const BlockPattern loose = block_pattern(2, {Connectivity(0, 4)});
  CHECK(loose.nonzeros() == 18 && loose.position(0, 1) == -1);
  CHECK(colour_cells(Connectivity(0, 4), 2).colours() == 0);
  CHECK(reduce(loose, Mask::Constant(6, false), Storage::Lower).free() == 0);
}
