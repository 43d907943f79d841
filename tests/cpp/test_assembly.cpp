/// Cells to the finished matrix, by kernels that the test can check by hand (spring_kernels.c).
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <numeric>

#include "check.hpp"
#include "fixtures.hpp"
#include "lanes.hpp"
#include "supple/error.hpp"
#include "supple/kernel_term.hpp"
#include "supple/system.hpp"

using namespace supple;

namespace {

std::atomic<long> allocations{0};

} // namespace

#ifndef __SANITIZE_ADDRESS__
extern "C" void* __libc_malloc(std::size_t);
extern "C" void* __libc_memalign(std::size_t, std::size_t);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
#endif

namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Tetrahedra whose nodes come in any order, so that blocks lie on either side of the diagonal.
Connectivity shuffled(Connectivity cells, unsigned seed) {
  std::mt19937 random(seed);
  for (Eigen::Index c = 0; c < cells.rows(); ++c)
    std::shuffle(cells.data() + 4 * c, cells.data() + 4 * c + 4, random);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(cells.rows()));
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), random);
  Connectivity mixed = cells;
  for (std::size_t c = 0; c < order.size(); ++c)
    mixed.row(static_cast<Eigen::Index>(c)) = cells.row(order[c]);
  return mixed;
}

/// A box of springs under some strain; the stiffness differs from cell to cell unless `uniform`.
struct Springs {
  Connectivity cells;
  std::shared_ptr<Vector> points;
  Vector stiffness, u;
  std::shared_ptr<KernelTerm> term;
  System system;

  Springs(const char* library, int nx, int ny, int nz, bool uniform = false)
      : cells(shuffled(fixtures::box_tetrahedra(nx, ny, nz), 3)),
        points(std::make_shared<Vector>(fixtures::box_points(nx, ny, nz))), stiffness(cells.rows()),
        u(points->size()),
        term(std::make_shared<KernelTerm>(KernelLibrary::load(library), points, cells)),
        system(points) {
    for (Eigen::Index c = 0; c < stiffness.size(); ++c)
      stiffness[c] = uniform ? 2.0 : 1.0 + 0.5 * std::sin(static_cast<double>(c));
    for (Eigen::Index i = 0; i < u.size(); ++i)
      u[i] = 0.1 * std::sin(1.7 * static_cast<double>(i));
    term->set_field("stiffness", stiffness);
    system.add(term);
    system.set_free(fixtures::some_free(static_cast<Index>(points->size() / 3)));
  }

  /// Call use(cell, a, b, stiffness, d, e) for each spring of each cell as it was given.
  template <class Use>
  void each(Use use) const {
    for (Eigen::Index c = 0; c < cells.rows(); ++c)
      for (int b = 1; b < 4; ++b)
        for (int a = 0; a < b; ++a) {
          const Eigen::Index i = 3 * cells(c, a), j = 3 * cells(c, b);
          const Eigen::Vector3d rest = points->segment<3>(j) - points->segment<3>(i);
          const Eigen::Vector3d d = rest + u.segment<3>(j) - u.segment<3>(i);
          use(c, i, j, stiffness[c], d, 0.5 * (d.squaredNorm() - rest.squaredNorm()));
        }
  }
};

Eigen::MatrixXd full_of_lower(const CscPattern& pattern, const Vector& values) {
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(pattern.size, pattern.size);
  for (std::int64_t c = 0; c < pattern.size; ++c)
    for (auto k = pattern.start[static_cast<std::size_t>(c)];
         k < pattern.start[static_cast<std::size_t>(c) + 1]; ++k) {
      const auto r = pattern.row[static_cast<std::size_t>(k)];
      full(r, c) = full(c, r) = values[k];
    }
  return full;
}

double largest(const Eigen::MatrixXd& m) {
  return m.size() == 0 ? 0.0 : m.cwiseAbs().maxCoeff();
}

const char* const kLibraries[] = {SPRINGS_1, SPRINGS_2, SPRINGS_4, SPRINGS_8};

} // namespace

/// Energy, force and stiffness of every spring, added by node numbers into dense arrays, are what
/// kernels of any number of lanes come to, for a count of cells that fills no batch.
TEST(assembly_equals_the_sum_of_the_springs) {
  for (const char* library : kLibraries)
    for (const bool uniform : {false, true}) {
      Springs box(library, 3, 2, 3, uniform);
      double energy = 0.0;
      Vector force = Vector::Zero(box.u.size());
      Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(box.u.size(), box.u.size());
      box.each([&](auto, auto i, auto j, double k, const Eigen::Vector3d& d, double e) {
        energy += 0.5 * k * e * e;
        force.segment<3>(j) += k * e * d;
        force.segment<3>(i) -= k * e * d;
        const Eigen::Matrix3d block = k * (d * d.transpose() + e * Eigen::Matrix3d::Identity());
        stiffness.block<3, 3>(i, i) += block;
        stiffness.block<3, 3>(j, j) += block;
        stiffness.block<3, 3>(i, j) -= block;
        stiffness.block<3, 3>(j, i) -= block;
      });
      CHECK_BELOW(std::abs(box.system.energy(box.u, 1.0) - energy), 1e-13 * energy);
      CHECK_BELOW(largest(box.system.residual(box.u, 1.0) - force), 1e-13 * largest(force));
      box.system.assemble_tangent(box.u, 1.0);
      const Reduction& reduction = box.system.reduction();
      const Eigen::MatrixXd expected = fixtures::restrict_dense(stiffness, reduction);
      const Eigen::MatrixXd got = full_of_lower(reduction.pattern, box.system.reduced_tangent());
      CHECK_BELOW(largest(got - expected), 1e-13 * largest(expected));
      const Eigen::MatrixXd full = fixtures::dense(box.system.pattern(), box.system.full_tangent());
      CHECK_BELOW(largest(full - stiffness), 1e-13 * largest(stiffness));
      const Vector product = stiffness * box.u;
      CHECK_BELOW(largest(box.system.apply(box.u) - product), 1e-13 * largest(product));
    }
}

/// Cells are reordered inside, but named as they were given.
TEST(results_come_in_the_order_of_the_cells) {
  Springs box(SPRINGS_8, 3, 2, 3);
  CHECK(box.term->given_cells() == box.cells);
  CHECK(box.term->cells() != box.cells);
  Vector energy = Vector::Zero(box.cells.rows()), ratio = Vector::Constant(box.cells.rows(), 9.0);
  box.each([&](auto c, auto i, auto j, double k, const Eigen::Vector3d&, double e) {
    energy[c] += 0.5 * k * e * e;
    if (i == 3 * box.cells(c, 0) && j == 3 * box.cells(c, 1)) ratio[c] = 1.0 + e;
  });
  CHECK_BELOW(largest(box.term->tabulate("energy", box.u) - energy), 1e-13);
  Eigen::Index worst = 0;
  const double smallest = ratio.minCoeff(&worst);
  const VolumeRatio got = box.system.volume_ratio(box.u);
  CHECK(got.cell == worst);
  CHECK_BELOW(std::abs(got.value - smallest), 1e-14);
  const Eigen::MatrixXd cell = box.term->tabulate("tangent", box.u).row(5).reshaped(12, 12);
  CHECK(cell == cell.transpose());
}

/// Sums run in the same order whoever does them.
TEST(no_bit_depends_on_the_number_of_threads) {
  Springs box(SPRINGS_8, 12, 8, 6);
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  box.system.assemble_tangent(box.u, 1.0);
  const Vector tangent = box.system.reduced_tangent(), full = box.system.full_tangent();
  const Vector force = box.system.residual(box.u, 1.0);
  const double energy = box.system.energy(box.u, 1.0);
  for (const int threads : {2, 3, 4, 16}) {
    omp_set_num_threads(threads);
    for (int repeat = 0; repeat < 3; ++repeat) {
      box.system.assemble_tangent(box.u, 1.0);
      CHECK(box.system.reduced_tangent() == tangent);
      CHECK(box.system.full_tangent() == full);
      CHECK(box.system.residual(box.u, 1.0) == force);
      CHECK(box.system.energy(box.u, 1.0) == energy);
    }
  }
  omp_set_num_threads(before);
}

#ifndef __SANITIZE_ADDRESS__
/// After the first time, what a Newton step evaluates takes no memory.
TEST(nothing_is_allocated_again) {
  Springs box(SPRINGS_8, 6, 4, 4);
  Vector force(box.u.size());
  double sum = 0.0;
  const auto evaluate = [&] {
    sum += box.system.volume_ratio(box.u).value + box.system.energy(box.u, 1.0);
    box.system.residual(box.u, 1.0, force);
    box.system.assemble_tangent(box.u, 1.0);
    sum += box.system.reduced_tangent()[0];
  };
  const long at_all = allocations;
  evaluate();
  CHECK(allocations > at_all); // the counter works
  const long before = allocations;
  evaluate();
  evaluate();
  CHECK(allocations == before);
  CHECK(std::isfinite(sum));
}
#endif

/// Random symmetric cell matrices with scalars behind the nodes, some dofs fixed, added by dof
/// numbers into a dense matrix; both the direct way and that over CSR come to it.
TEST(lower_scatter_equals_dense_assembly) {
  const Connectivity tetrahedra = shuffled(fixtures::box_tetrahedra(3, 2, 2), 5);
  const Index nodes = fixtures::box_nodes(3, 2, 2);
  Connectivity cells(tetrahedra.rows(), 8);
  cells << tetrahedra, tetrahedra.array() + nodes;
  std::vector<Index> home(static_cast<std::size_t>(nodes));
  std::iota(home.begin(), home.end(), 0);
  const NodeGraph graph = node_graph(nodes, {cells}, home);
  Mask free = Mask::Constant(4 * nodes, true);
  free.head(3 * nodes) = fixtures::some_free(nodes);
  free[7] = free[11] = free[3 * nodes + 2] = false;
  const Reduction reduction = reduce_lower(graph, free);
  const LowerScatter map = lower_scatter(graph, reduction, {cells}).front();
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(graph.dofs(), graph.dofs());
  Vector values = Vector::Zero(reduction.pattern.nonzeros());
  for (Index c = 0; c < map.cells; ++c) {
    const Eigen::MatrixXd half = fixtures::random_matrix(16, 16, static_cast<unsigned>(c));
    RowMajor k = half + half.transpose();
    for (Index r = 0; r < 16; ++r)
      for (Index s = 0; s < 16; ++s) {
        const auto dof = [&](Index d) {
          return d < 12 ? 3 * cells(c, d / 3) + d % 3 : graph.first_dof(cells(c, d - 8));
        };
        expected(dof(r), dof(s)) += k(r, s);
      }
    k.triangularView<Eigen::StrictlyUpper>().setConstant(1e30);
    add_lower<1>({cells.data() + 8 * c, 1, 4, 4}, map, c, k.data(), values.data());
  }
  const Eigen::MatrixXd got = full_of_lower(reduction.pattern, values);
  const Eigen::MatrixXd part = fixtures::restrict_dense(expected, reduction);
  CHECK_BELOW(largest(got - part), 1e-13 * largest(part));
  const Reduction detour = reduce(block_pattern(nodes, {cells}, home), free, Storage::Lower);
  CHECK(detour.pattern.start == reduction.pattern.start);
  CHECK(detour.pattern.row == reduction.pattern.row);
  CHECK(detour.pattern.group == reduction.pattern.group);
}

TEST(cells_that_no_map_can_hold_are_refused) {
  Connectivity cells(1, 4), others(1, 4), twice(1, 4);
  cells << 0, 1, 2, 3;
  others << 1, 2, 3, 4;
  twice << 0, 1, 2, 2;
  const NodeGraph graph = node_graph(5, {cells});
  const Reduction reduction = reduce_lower(graph, Mask::Constant(15, true));
  CHECK_THROWS(lower_scatter(graph, reduction, {others}), ShapeError);
  CHECK_THROWS(lower_scatter(graph, reduction, {twice}), ShapeError);
  CHECK_THROWS(reduce_lower(graph, Mask::Constant(14, true)), ShapeError);
  CHECK(lower_scatter(graph, reduction, {Connectivity(0, 0)}).front().cells == 0);
}
