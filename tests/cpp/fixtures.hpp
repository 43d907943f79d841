/// Meshes and matrices that the tests share; every random number comes from a fixed seed.
#pragma once

#include <array>
#include <Eigen/Dense>
#include <random>

#include "supple/sparse.hpp"

namespace fixtures {

using supple::BlockPattern;
using supple::Connectivity;
using supple::Index;
using supple::Vector;

/// Six tetrahedra for each of nx × ny × nz boxes, around the diagonal 000–111.
inline Connectivity box_tetrahedra(int nx, int ny, int nz) {
  constexpr std::array<std::array<int, 4>, 6> corner{
      {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}}};
  Connectivity cells(6 * nx * ny * nz, 4);
  Index c = 0;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        for (const auto& tetrahedron : corner) {
          for (int a = 0; a < 4; ++a) {
            const int bits = tetrahedron[static_cast<std::size_t>(a)];
            const int x = i + (bits & 1), y = j + (bits >> 1 & 1), z = k + (bits >> 2);
            cells(c, a) = (z * (ny + 1) + y) * (nx + 1) + x;
          }
          ++c;
        }
  return cells;
}

inline Index box_nodes(int nx, int ny, int nz) {
  return (nx + 1) * (ny + 1) * (nz + 1);
}

/// (3n) coordinates of the nodes of box_tetrahedra, unit boxes.
inline Vector box_points(int nx, int ny, int nz) {
  Vector points(3 * box_nodes(nx, ny, nz));
  Index n = 0;
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i)
        points.segment<3>(3 * n++) = Eigen::Vector3d(i, j, k);
  return points;
}

/// Dense matrix of the CSR values, for comparison.
inline Eigen::MatrixXd dense(const BlockPattern& pattern, const Vector& values) {
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(pattern.dofs(), pattern.dofs());
  for (Index r = 0; r < pattern.dofs(); ++r)
    for (Index k = pattern.row_start[static_cast<std::size_t>(r)];
         k < pattern.row_start[static_cast<std::size_t>(r) + 1]; ++k)
      full(r, pattern.column[static_cast<std::size_t>(k)]) = values[k];
  return full;
}

/// Random (3m × 3m) matrix: symmetric positive semi-definite, plus `skew` times an unsymmetric
/// part.
inline Eigen::MatrixXd cell_matrix(int m, double skew, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Eigen::MatrixXd b =
      Eigen::MatrixXd::NullaryExpr(3 * m, 3 * m, [&] { return normal(random); });
  return b * b.transpose() +
         skew * Eigen::MatrixXd::NullaryExpr(3 * m, 3 * m, [&] { return normal(random); });
}

/// Assemble one random matrix a cell by the scatter map.
inline Vector assemble(const BlockPattern& pattern, double skew, std::mt19937& random) {
  Vector values = Vector::Zero(pattern.nonzeros());
  for (const supple::Scatter& map : pattern.scatter)
    for (Index c = 0; c < map.cells; ++c) {
      const Eigen::Matrix<double, -1, -1, Eigen::RowMajor> k =
          cell_matrix(map.nodes_per_cell, skew, random);
      supple::scatter_add(map, c, k.data(), values.data());
    }
  return values;
}

/// Free dofs: all but those of every fifth node, and a lone y dof of node 1.
inline supple::Mask some_free(Index nodes) {
  supple::Mask free = supple::Mask::Constant(3 * nodes, true);
  for (Index n = 0; n < nodes; n += 5)
    free.segment(3 * n, 3).setConstant(false);
  if (nodes > 1) free[4] = false;
  return free;
}

/// Rows and columns of the free dofs.
inline Eigen::MatrixXd restrict_dense(const Eigen::MatrixXd& full,
                                      const supple::Reduction& reduction) {
  Eigen::MatrixXd part(reduction.free(), reduction.free());
  for (Index r = 0; r < reduction.free(); ++r)
    for (Index c = 0; c < reduction.free(); ++c)
      part(r, c) = full(reduction.dof[static_cast<std::size_t>(r)],
                        reduction.dof[static_cast<std::size_t>(c)]);
  return part;
}

inline Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

/// A sparse matrix that holds the non-zero entries of a dense one.
struct Sparse {
  supple::CscPattern pattern;
  supple::Vector values;

  Sparse(const Eigen::MatrixXd& matrix, bool lower) {
    std::vector<double> found;
    pattern.size = matrix.rows();
    pattern.lower = lower;
    pattern.start.push_back(0);
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) {
      for (Eigen::Index r = lower ? c : 0; r < matrix.rows(); ++r)
        if (matrix(r, c) != 0.0 || r == c) {
          pattern.row.push_back(r);
          found.push_back(matrix(r, c));
        }
      pattern.start.push_back(pattern.nonzeros());
    }
    values =
        Eigen::Map<const supple::Vector>(found.data(), static_cast<Eigen::Index>(found.size()));
  }
};

} // namespace fixtures
