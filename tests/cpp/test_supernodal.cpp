/// The multifrontal factorisations against dense algebra, Eigen's LDLᵀ and UMFPACK.
#include <omp.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <limits>

#include "check.hpp"
#include "fixtures.hpp"
#include "linear_backend.hpp"
#include "supernodal_tree.hpp"
#include "supple/linear.hpp"

using namespace supple;
using Eigen::MatrixXd;
using fixtures::random_matrix;
using fixtures::Sparse;

namespace {

constexpr double kRounding = std::numeric_limits<double>::epsilon();

/// Thirty unknowns that touch only a root of sixty: those without pivoting have no choice.
MatrixXd symmetric_leaves(double leaf_diagonal, unsigned seed) {
  constexpr Index leaves = 30, root = 60, size = leaves + root;
  MatrixXd a = random_matrix(size, size, seed);
  for (Index i = 0; i < leaves; ++i)
    for (Index j = 0; j < leaves; ++j)
      a(i, j) = i == j ? leaf_diagonal * (i % 2 == 0 ? 1.0 : -1.0) : 0.0;
  return a.selfadjointView<Eigen::Lower>();
}

/// Ten unknowns that touch a tenth of a root of two hundred: too little to be eliminated together
/// with it, so rows cannot pass from one to the other.
MatrixXd unsymmetric_leaf(double size_of_leaf, unsigned seed) {
  constexpr Index leaf = 10, touched = 20, size = 210;
  MatrixXd a = random_matrix(size, size, seed);
  a.topLeftCorner(leaf, leaf) *= size_of_leaf;
  a.block(0, leaf, leaf, touched) *= 1e3;
  a.topRightCorner(leaf, size - leaf - touched).setZero();
  a.bottomLeftCorner(size - leaf - touched, leaf).setZero();
  return a;
}

MatrixXd leaves_and_root(double leaf, unsigned seed, bool symmetric) {
  return symmetric ? symmetric_leaves(leaf, seed) : unsymmetric_leaf(leaf, seed);
}

void check_factor(const MatrixXd& dense, Kind kind, bool expect_fall_back, double tolerance) {
  const Sparse sparse(dense, kind != Kind::Unsymmetric);
  Factor factor(kind);
  factor.analyse(sparse.pattern);
  CHECK(factor.factorise(sparse.values).ok());
  const Vector rhs = Vector::LinSpaced(dense.rows(), -1.0, 1.5);
  Vector x(rhs.size());
  const SolveReport report = factor.solve(rhs, x);
  const Vector expected = dense.fullPivLu().solve(rhs);
  CHECK_BELOW((x - expected).norm(), tolerance * expected.norm());
  CHECK_BELOW(report.backward, 16 * kRounding);
  CHECK(factor.fell_back() == expect_fall_back);
}

/// Random mesh matrix with a scalar a node, K positive definite and −C on the scalars' diagonal.
struct Saddle {
  Reduction reduction;
  Vector values;

  Saddle(int n, Kind kind, unsigned seed) {
    const Index nodes = fixtures::box_nodes(n, n, n);
    const Connectivity plain = fixtures::box_tetrahedra(n, n, n);
    Connectivity cells(plain.rows(), 8);
    cells << plain, plain.array() + nodes;
    std::vector<Index> home(static_cast<std::size_t>(nodes));
    for (Index a = 0; a < nodes; ++a)
      home[static_cast<std::size_t>(a)] = a;
    const BlockPattern pattern = block_pattern(nodes, {cells}, home);
    std::mt19937 random(seed);
    Vector full = Vector::Zero(pattern.nonzeros());
    for (Index c = 0; c < plain.rows(); ++c) {
      Eigen::Matrix<double, -1, -1, Eigen::RowMajor> k =
          random_matrix(16, 16, static_cast<unsigned>(random()));
      k = kind == Kind::Unsymmetric ? MatrixXd(k + k.transpose() * 0.9)
                                    : MatrixXd(k + k.transpose());
      k.topLeftCorner(12, 12).diagonal().array() += 16.0;
      k.bottomRightCorner(4, 4).diagonal().array() -= 8.0;
      scatter_add(pattern.scatter[0], c, k.data(), full.data());
    }
    reduction = reduce(pattern, Mask::Constant(pattern.dofs(), true), storage(kind));
    values.resize(reduction.pattern.nonzeros());
    reduction.gather(full, values);
  }

  /// What is stored of the matrix: its lower triangle where it is symmetric.
  Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t> sparse() const {
    const CscPattern& p = reduction.pattern;
    return Eigen::Map<const Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t>>(
        p.size, p.size, p.nonzeros(), p.start.data(), p.row.data(), values.data());
  }

  MatrixXd dense() const { return MatrixXd(sparse()).selfadjointView<Eigen::Lower>(); }
};

/// max (|L||D||Lᵀ|)ᵢᵢ / max |A| by elimination, column by column, in the given order.
double dense_growth(const MatrixXd& matrix, const std::vector<Index>& order) {
  const MatrixXd a = matrix(order, order);
  MatrixXd left = a;
  Vector diagonal = Vector::Zero(a.rows());
  for (Eigen::Index j = 0; j < a.rows(); ++j) {
    const Vector column = left.col(j) / left(j, j);
    diagonal.tail(a.rows() - j) += std::abs(left(j, j)) * column.cwiseAbs2().tail(a.rows() - j);
    left -= left(j, j) * column * column.transpose();
  }
  return diagonal.maxCoeff() / a.cwiseAbs().maxCoeff();
}

Vector solve(Backend& backend, const Vector& rhs) {
  Vector x(rhs.size());
  backend.solve(rhs.data(), x.data());
  return x;
}

std::int64_t square(Index m) {
  return static_cast<std::int64_t>(m) * m;
}

} // namespace

/// Same matrix, same answer and same signs of the pivots as Eigen's LDLᵀ, which takes one column at
/// a time; on meshes where all of the tree is used.
TEST(multifrontal_and_simplicial_ldl_agree) {
  for (const int n : {1, 3, 7}) {
    Saddle problem(n, Kind::QuasiDefinite, 8);
    const auto ours = make_supernodal(Kind::QuasiDefinite);
    ours->analyse(problem.reduction.pattern);
    CHECK(ours->factorise(problem.values.data()).ok());
    const Eigen::SimplicialLDLT<decltype(problem.sparse())> theirs(problem.sparse());
    const Vector rhs = Vector::LinSpaced(problem.reduction.free(), -1.0, 2.0);
    const Vector expected = theirs.solve(rhs);
    CHECK_BELOW((solve(*ours, rhs) - expected).norm(), 1e-10 * expected.norm());
    CHECK(ours->raised_pivots() == 0);
    const Inertia inertia = ours->inertia();
    CHECK(inertia.negative == (theirs.vectorD().array() < 0.0).count());
    CHECK(inertia.positive == (theirs.vectorD().array() > 0.0).count());
    CHECK(inertia.zero == 0 && inertia.negative == fixtures::box_nodes(n, n, n));
    if (n > 3) continue;
    const double growth =
        dense_growth(problem.dense(), make_tree(problem.reduction.pattern, 1).tree.order);
    CHECK_BELOW(std::abs(inertia.growth - growth), 1e-8 * growth);
  }
}

/// Same matrix, same answer as the library that is held in reserve.
TEST(multifrontal_lu_and_umfpack_agree) {
  for (const int n : {1, 3, 7}) {
    Saddle problem(n, Kind::Unsymmetric, 8);
    const auto ours = make_supernodal(Kind::Unsymmetric), theirs = make_umfpack();
    for (Backend* backend : {ours.get(), theirs.get()}) {
      backend->analyse(problem.reduction.pattern);
      CHECK(backend->factorise(problem.values.data()).ok());
    }
    const Vector rhs = Vector::LinSpaced(problem.reduction.free(), -1.0, 2.0);
    const Vector expected = solve(*theirs, rhs);
    CHECK_BELOW((solve(*ours, rhs) - expected).norm(), 1e-10 * expected.norm());
    CHECK(ours->raised_pivots() == 0);
  }
}

/// A tree cut for two threads gives the numbers of one thread, to the last bit.
TEST(threads_do_not_change_the_factor) {
  const int before = omp_get_max_threads();
  for (const Kind kind : {Kind::QuasiDefinite, Kind::Unsymmetric}) {
    Saddle problem(10, kind, 9);
    const Vector rhs = Vector::Ones(problem.reduction.free());
    std::vector<Vector> x;
    for (const int threads : {1, 2}) {
      omp_set_num_threads(threads);
      const auto backend = make_supernodal(kind);
      backend->analyse(problem.reduction.pattern);
      CHECK(backend->flops() > 2e8); // else there is nothing to share
      backend->factorise(problem.values.data());
      x.push_back(solve(*backend, rhs));
    }
    CHECK(x[0] == x[1]);
  }
  omp_set_num_threads(before);
}

/// Every supernode is in one branch or in the trunk, and no update overwrites one still to be read.
TEST(updates_that_live_together_lie_apart) {
  const Saddle problem(6, Kind::QuasiDefinite, 10);
  for (const int branches : {1, 8}) {
    const SupernodeTree tree = make_tree(problem.reduction.pattern, branches).tree;
    std::vector<int> seen(static_cast<std::size_t>(tree.size()), 0);
    std::vector<Index> order = tree.trunk;
    for (auto range = tree.branch.rbegin(); range != tree.branch.rend(); ++range) {
      std::vector<Index> members;
      for (Index s = range->begin; s < range->end; ++s)
        members.push_back(s);
      order.insert(order.begin(), members.begin(), members.end());
    }
    CHECK(branches == 1 ? tree.trunk.empty() : tree.branch.size() > 1);
    std::vector<Index> alive;
    for (const Index s : order) {
      ++seen[static_cast<std::size_t>(s)];
      const Supernode& node = tree.node[static_cast<std::size_t>(s)];
      const std::int64_t begin = node.update, end = begin + square(node.below);
      CHECK(begin >= 0 && end <= tree.updates);
      for (const Index other : alive) {
        const Supernode& o = tree.node[static_cast<std::size_t>(other)];
        CHECK(end <= o.update || o.update + square(o.below) <= begin);
      }
      alive.erase(std::remove_if(
                      alive.begin(), alive.end(),
                      [&](Index c) { return tree.node[static_cast<std::size_t>(c)].parent == s; }),
                  alive.end());
      if (node.below > 0) alive.push_back(s);
    }
    CHECK(alive.empty());
    CHECK(std::all_of(seen.begin(), seen.end(), [](int times) { return times == 1; }));
  }
}

/// Zero pivots are raised and refined away, and the signs stay those of the eigenvalues.
TEST(zero_pivots_keep_answer_and_signs) {
  const MatrixXd a = leaves_and_root(0.0, 11, true).bottomRightCorner(40, 40);
  check_factor(a, Kind::QuasiDefinite, false, 1e-9);
  const Sparse sparse(a, true);
  Factor factor(Kind::QuasiDefinite);
  factor.analyse(sparse.pattern);
  CHECK(factor.factorise(sparse.values).ok());
  const Vector eigen = a.selfadjointView<Eigen::Lower>().eigenvalues();
  CHECK(factor.inertia().negative == (eigen.array() < 0.0).count());
}

/// Rows change places inside a front, so a cyclic permutation needs nothing else.
TEST(pivots_are_chosen_inside_a_front) {
  MatrixXd a = MatrixXd::Zero(9, 9);
  for (Index i = 0; i < 9; ++i)
    a(i, (i + 1) % 9) = 1.0 + i;
  a += MatrixXd::Constant(9, 9, 1e-18); // no entry is missing from the pattern
  check_factor(a, Kind::Unsymmetric, false, 1e-13);
}

/// Pivots that would have to come from another front: where refinement cannot repair what small
/// ones spoil, the answer is UMFPACK's. Either way it is right.
TEST(matrices_that_need_pivoting_fall_back) {
  for (const Kind kind : {Kind::QuasiDefinite, Kind::Unsymmetric}) {
    const bool symmetric = kind == Kind::QuasiDefinite;
    check_factor(leaves_and_root(1e-13, 12, symmetric), kind, true, 1e-9);
    check_factor(leaves_and_root(1e-6, 13, symmetric), kind, false, 1e-9);
  }
}

/// After a fall-back the next matrix is tried by the quick factor again.
TEST(a_fall_back_is_not_for_ever) {
  const Sparse bad(leaves_and_root(1e-13, 14, true), true);
  const Sparse good(leaves_and_root(60.0, 14, true), true);
  Factor factor(Kind::QuasiDefinite);
  factor.analyse(bad.pattern);
  Vector x(bad.pattern.size);
  for (int repeat = 0; repeat < 2; ++repeat) {
    CHECK(factor.factorise(bad.values).ok());
    CHECK_BELOW(factor.solve(Vector::Ones(x.size()), x).backward, 16 * kRounding);
    CHECK(factor.fell_back());
    CHECK(factor.factorise(good.values).ok());
    CHECK_BELOW(factor.solve(Vector::Ones(x.size()), x).backward, 16 * kRounding);
    CHECK(!factor.fell_back());
  }
}

/// A right-hand side outside the range of a singular matrix is not met, and the report says so.
TEST(a_singular_matrix_never_gives_a_wrong_answer) {
  const Index n = 40;
  MatrixXd a = MatrixXd::Zero(n, n); // a chain of springs that nothing holds: exact in binary
  for (Index i = 0; i + 1 < n; ++i) {
    a(i, i) += 1.0;
    a(i + 1, i + 1) += 1.0;
    a(i, i + 1) = a(i + 1, i) = -1.0;
  }
  for (const Kind kind : {Kind::QuasiDefinite, Kind::Unsymmetric}) {
    const Sparse sparse(a, kind != Kind::Unsymmetric);
    Factor factor(kind);
    factor.analyse(sparse.pattern);
    const FactorStatus status = factor.factorise(sparse.values);
    if (!status.ok()) {
      CHECK(status.cause == FactorStatus::Cause::Singular && status.unknown >= 0);
      continue;
    }
    Vector x(n);
    const SolveReport report = factor.solve(Vector::Ones(n), x);
    CHECK(report.residual > 1e-3 || x.lpNorm<Eigen::Infinity>() > 1e12);
  }
}

/// Near singular: x is as good as its condition lets it be, and solves A x = b to rounding.
TEST(near_singular_matrices_are_solved_to_rounding) {
  const Index n = 60;
  const MatrixXd q = random_matrix(n, n, 15).householderQr().householderQ();
  const Vector eigen =
      Vector::LinSpaced(n, 0.0, -11.0).unaryExpr([](double e) { return std::pow(10.0, e); });
  const MatrixXd a = q * eigen.asDiagonal() * q.transpose();
  check_factor((a + a.transpose()) / 2, Kind::QuasiDefinite, false, 1e-3);
  check_factor(a, Kind::Unsymmetric, false, 1e-3);
}

/// Entries without a partner across the diagonal are as good as others.
TEST(structurally_unsymmetric_matrices_are_solved) {
  MatrixXd a = random_matrix(80, 80, 16);
  for (Index i = 0; i < 80; ++i)
    for (Index j = 0; j < 80; ++j)
      if (i != j && (i * 7 + j * 3) % 11 != 0) a(i, j) = 0.0;
  a.diagonal().array() += 20.0;
  check_factor(a, Kind::Unsymmetric, false, 1e-12);
}

TEST(one_unknown_is_no_special_case) {
  for (const Kind kind : {Kind::QuasiDefinite, Kind::Unsymmetric})
    check_factor(MatrixXd::Constant(1, 1, -4.0), kind, false, 1e-15);
}

/// With no refinement asked for, the factor is applied once and nothing else is tried.
TEST(without_refinement_there_is_no_fall_back) {
  const Sparse bad(leaves_and_root(1e-13, 17, false), false);
  Factor factor(Kind::Unsymmetric);
  factor.analyse(bad.pattern);
  CHECK(factor.factorise(bad.values).ok());
  Vector x(bad.pattern.size);
  CHECK(factor.solve(Vector::Ones(x.size()), x, {0.0, 0}).residual > 1e-12);
  CHECK(!factor.fell_back());
}
