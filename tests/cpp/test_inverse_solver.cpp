#include "supple/inverse_solver.hpp"

#include "check.hpp"
#include "fixtures.hpp"
#include "relabelling.hpp"
#include "supple/error.hpp"

using namespace supple;

namespace {

/// A box, a homogeneous F⁻¹ = G, and tangents K = −S F for a symmetric S: what an unstressed body
/// has.
struct Problem {
  BlockPattern pattern =
      block_pattern(fixtures::box_nodes(4, 3, 2), {fixtures::box_tetrahedra(4, 3, 2)});
  Vector points = fixtures::box_points(4, 3, 2);
  Mask free = Mask::Constant(pattern.dofs(), true);
  Reduction reduction;
  Eigen::Matrix3d G;

  Problem() {
    for (Index node = 0; node < pattern.nodes; node += 5)
      free.segment<3>(3 * node).setConstant(false);
    reduction = reduce(pattern, free, Storage::Lower);
    G << 0.9, 0.2, -0.1, 0.05, 1.3, 0.1, 0.0, -0.3, 0.8;
  }

  Vector u() const { // X − x for X = G x
    Vector u(points.size());
    for (Index node = 0; node < pattern.nodes; ++node)
      u.segment<3>(3 * node) = (G - Eigen::Matrix3d::Identity()) * points.segment<3>(3 * node);
    return u;
  }

  Vector tangent(double skew, unsigned seed, double shift = 0.0) const {
    std::mt19937 random(seed);
    Vector values = fixtures::assemble(pattern, skew, random);
    for (Index a = 0; a < pattern.nodes; ++a)
      for (Index i = 0; i < 3; ++i)
        values[pattern.position(a, a) + i * (pattern.row_stride(a) + 1)] -= shift;
    const Eigen::Matrix3d F = -G.inverse();
    for (Index k = 0; k < pattern.nonzeros(); k += 3)
      values.segment<3>(k) = (F.transpose() * values.segment<3>(k)).eval();
    return values;
  }

  /// Solve, and compare with Eigen's dense LU with complete pivoting.
  void check(InverseSolver& solver, const Vector& values, double tolerance = 1e-12) const {
    const Eigen::MatrixXd K = fixtures::restrict_dense(fixtures::dense(pattern, values), reduction);
    const Vector rhs = Vector::LinSpaced(K.rows(), -1.0, 1.5);
    Vector x;
    CHECK(solver.solve(rhs, tolerance, x));
    CHECK_BELOW((rhs - K * x).norm(), 1.1 * tolerance * rhs.norm());
    const Vector expected = K.fullPivLu().solve(rhs);
    CHECK_BELOW((x - expected).norm(), 1e6 * tolerance * expected.norm());
  }
};

} // namespace

/// Least squares over the neighbours are exact where X is affine in x.
TEST(relabelling_of_a_homogeneous_map_is_its_inverse_gradient) {
  const Problem problem;
  Relabelling relabelling(problem.pattern, problem.free, problem.points);
  relabelling.update(problem.u());
  const Vector x = Vector::LinSpaced(problem.points.size(), -1.0, 2.0);
  Vector y(x.size());
  relabelling.apply(x, y);
  for (Index a = 0; a < problem.pattern.nodes; ++a) {
    const bool held = !problem.free[3 * a];
    const Eigen::Vector3d expected =
        held ? Eigen::Vector3d::Zero() : Eigen::Vector3d(-problem.G * x.segment<3>(3 * a));
    CHECK_BELOW((y.segment<3>(3 * a) - expected).norm(), 1e-12);
  }
  const Vector values = problem.tangent(1.0, 3);
  Vector scaled, left(x.size()), right(x.size());
  relabelling.scale_columns(values, scaled);
  multiply(problem.pattern, values, y, left);
  multiply(problem.pattern, scaled, x, right);
  CHECK_BELOW((left - right).norm(), 1e-12 * left.norm());
}

/// Without stress A is symmetric: its own factor leaves GMRES one iteration.
TEST(unstressed_tangent_takes_one_iteration) {
  const Problem problem;
  const Vector values = problem.tangent(0.0, 1);
  InverseSolver solver(problem.pattern, problem.reduction, problem.points);
  CHECK(solver.prepare(values, problem.u()).ok());
  problem.check(solver, values, 1e-10);
  CHECK(solver.work.iterations == 1 && solver.work.symmetric == 1 && solver.work.lu == 0);
}

/// L Lᵀ is handed out where it is what serves, and LDLᵀ, of an indefinite matrix, never.
TEST(only_a_definite_factor_is_handed_out) {
  const Problem problem;
  const Vector definite = problem.tangent(0.0, 1), indefinite = problem.tangent(0.0, 1, 30.0);
  InverseSolver solver(problem.pattern, problem.reduction, problem.points);
  CHECK(!solver.definite_factor());
  CHECK(solver.prepare(definite, problem.u()).ok());
  CHECK(solver.definite_factor()->kind() == Kind::Cholesky);
  solver.forget();
  CHECK(!solver.definite_factor());
  CHECK(solver.prepare(indefinite, problem.u()).ok());
  CHECK(!solver.definite_factor());
  problem.check(solver, indefinite);
  CHECK(solver.work.symmetric == 3 && solver.work.lu == 0);
}

/// One factorisation serves the tangents that follow, each solved as a dense LU solves it.
TEST(near_tangents_share_a_factor) {
  const Problem problem;
  InverseSolver solver(problem.pattern, problem.reduction, problem.points);
  Vector values = problem.tangent(0.0, 2, -20.0);
  const Vector change = 1e-2 * problem.tangent(5.0, 7);
  for (int k = 0; k < 3; ++k) {
    CHECK(solver.prepare(values, problem.u()).ok());
    problem.check(solver, values);
    values += change;
  }
  CHECK(solver.work.symmetric == 1 && solver.work.lu == 0);
}

/// A factor that does not serve is renewed, and LU steps in where the symmetric part cannot help.
TEST(stagnation_falls_back_to_a_new_factor_and_then_to_lu) {
  const Problem problem;
  InverseSolver solver(problem.pattern, problem.reduction, problem.points);
  const Vector first = problem.tangent(0.0, 4), other = problem.tangent(0.0, 5, 30.0);
  CHECK(solver.prepare(first, problem.u()).ok());
  CHECK(solver.prepare(other, problem.u()).ok());
  CHECK(solver.work.symmetric == 1); // the old one is tried first
  problem.check(solver, other, 1e-9);
  CHECK(solver.work.symmetric == 3 && solver.work.lu == 0); // L Lᵀ finds it indefinite
  const Vector unsymmetric = problem.tangent(300.0, 6);
  CHECK(solver.prepare(unsymmetric, problem.u()).ok());
  problem.check(solver, unsymmetric, 1e-9);
  CHECK(solver.work.lu == 1);
}

TEST(singular_tangent_is_told) {
  const Problem problem;
  Vector values = problem.tangent(0.0, 8);
  const Index row = problem.pattern.row_start[3 * 7], stride = problem.pattern.row_stride(7);
  values.segment(row, stride).setZero(); // no equation of a free dof
  InverseSolver solver(problem.pattern, problem.reduction, problem.points);
  Vector x;
  const bool prepared = solver.prepare(values, problem.u()).ok();
  CHECK(!prepared || !solver.solve(Vector::Ones(problem.reduction.free()), 1e-10, x));
  values[row] = std::nan("");
  InverseSolver another(problem.pattern, problem.reduction, problem.points);
  CHECK(another.prepare(values, problem.u()).cause == FactorStatus::Cause::NotFinite);
}

/// The mirrored positions hold the transposed matrix.
TEST(mirror_reads_the_transposed_entries) {
  const Problem problem;
  const Vector values = problem.tangent(1.0, 9);
  const Eigen::MatrixXd K =
      fixtures::restrict_dense(fixtures::dense(problem.pattern, values), problem.reduction);
  const std::vector<Index> position = mirror(problem.pattern, problem.reduction);
  const CscPattern& csc = problem.reduction.pattern;
  for (Index c = 0; c < csc.size; ++c)
    for (auto k = static_cast<std::size_t>(csc.start[static_cast<std::size_t>(c)]);
         k < static_cast<std::size_t>(csc.start[static_cast<std::size_t>(c) + 1]); ++k) {
      CHECK(values[position[k]] == K(csc.row[k], c));
      CHECK(values[problem.reduction.source[k]] == K(c, csc.row[k]));
    }
  CHECK_THROWS(mirror(problem.pattern, reduce(problem.pattern, problem.free, Storage::Full)),
               ShapeError);
}
