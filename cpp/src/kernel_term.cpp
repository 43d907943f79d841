#include "supple/kernel_term.hpp"

#include <algorithm>
#include <cmath>

#include "cell_order.hpp"
#include "kernel_calls.hpp"
#include "node_cells.hpp"
#include "supple/error.hpp"

namespace supple {

namespace {

constexpr Index kSmallestGroup = 64;  // cells that one thread treats in one go, at least
constexpr Index kLargestGroup = 2048; // what they read and add to fits the second cache
constexpr Index kMostGroups = 128;    // unless that asks for more: a colour ends in a barrier

Index group_size(Index cells, Index lanes) {
  const Index size = std::clamp(cells / kMostGroups + 1, kSmallestGroup, kLargestGroup);
  return (size + lanes - 1) / lanes * lanes;
}

} // namespace

KernelTerm::KernelTerm(std::shared_ptr<const KernelLibrary> library,
                       std::shared_ptr<const Vector> points, const Connectivity& cells,
                       Index scalars)
    : library_(std::move(library)), points_(std::move(points)),
      work_(std::make_unique<Workspace>()) {
  const supple_library& table = library_->table();
  nodes_ = table.nodes;
  scalars_ = table.scalars;
  require_size("nodes per cell", cells.cols(), nodes_ + scalars_,
               "pass cells of the kernels' element, and its scalars where it has some");
  const auto nodes = static_cast<Index>(points_->size() / 3);
  scalar_offset_ = 2 * nodes;
  check_nodes(cells.leftCols(nodes_), nodes);
  order_ = order_cells(*points_, cells, nodes_);
  cells_.resize(cells.rows(), cells.cols());
  for (Eigen::Index c = 0; c < cells.rows(); ++c)
    cells_.row(c) = cells.row(order_[static_cast<std::size_t>(c)]);
  group_ = group_size(static_cast<Index>(cells_.rows()), table.lanes);
  colouring_ = colour_cells(cells_, nodes + scalars, group_);
  fields_.resize(static_cast<std::size_t>(table.field_count));
  energy_ = library_->find("energy");
  tangent_ = library_->find("tangent");
  volume_ratio_ = library_->find("volume_ratio");
  work_->energy.resize(colouring_.order.size());
  work_->worst.resize(colouring_.order.size());
}

KernelTerm::~KernelTerm() = default;

Connectivity KernelTerm::given_cells() const {
  Connectivity given(cells_.rows(), cells_.cols());
  for (Eigen::Index c = 0; c < cells_.rows(); ++c)
    given.row(order_[static_cast<std::size_t>(c)]) = cells_.row(c);
  return given;
}

void KernelTerm::set_field(const std::string& name, const ConstVector& values) {
  const int number = library_->field(name);
  if (number < 0 || name == "u") {
    throw ShapeError("field " + name + " is unknown to " + library_->table().unit);
  }
  const supple_field& field = library_->table().fields[number];
  const std::ptrdiff_t size = field.size, cells = cells_.rows(), lanes = library_->table().lanes;
  require_size(field.name, values.size(), cells * size, "one row for each cell");
  constant_.resize(0);
  const bool uniform =
      std::equal(values.data(), values.data() + std::max<std::ptrdiff_t>(cells - 1, 0) * size,
                 values.data() + std::min(cells, std::ptrdiff_t{1}) * size);
  const std::ptrdiff_t batches =
      uniform ? std::min(cells, std::ptrdiff_t{1}) : (cells + lanes - 1) / lanes;
  Field& kept = fields_[static_cast<std::size_t>(number)];
  kept.stride = uniform ? 0 : size * lanes;
  kept.values.resize(batches * size * lanes);
  for (std::ptrdiff_t k = 0; k < batches * lanes; ++k) {
    const Index given = order_[static_cast<std::size_t>(std::min(k, cells - 1))];
    double* target = kept.values.data() + k / lanes * size * lanes + k % lanes;
    for (std::ptrdiff_t i = 0; i < size; ++i)
      target[i * lanes] = values[given * size + i];
  }
}

void KernelTerm::require_fields() const {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const supple_field& field = library_->table().fields[f];
    if (field.name != std::string("u") && fields_[f].values.size() == 0 && cells_.rows() > 0) {
      throw StateError(std::string("field ") + field.name + " of " + library_->table().unit +
                       " has no values; call set_field first");
    }
  }
}

double KernelTerm::energy(const ConstVector& u) const {
  if (energy_ == nullptr) return constant().dot(u.head(points_->size())); // a load alike for all u
  std::vector<double>& sums = work_->energy;
  std::fill(sums.begin(), sums.end(), 0.0);
  each(*energy_, u, [&](auto, Index, Index count, const double* A, Index group) {
    for (Index lane = 0; lane < count; ++lane)
      sums[static_cast<std::size_t>(group)] += A[lane];
  });
  double total = 0.0;
  for (const double sum : sums)
    total += sum;
  return total;
}

const Vector& KernelTerm::constant() const {
  if (constant_.size() == 0) {
    Vector force = Vector::Zero(points_->size());
    add_residual(Vector::Zero(points_->size()), 1.0, force);
    constant_ = std::move(force);
  }
  return constant_;
}

void KernelTerm::residual(const ConstVector& u, double scale, MutableVector r) const {
  if (tangent_ == nullptr) {
    r.head(points_->size()) += scale * constant();
  } else {
    add_residual(u, scale, r);
  }
}

void KernelTerm::add_residual(const ConstVector& u, double scale, MutableVector r) const {
  const supple_kernel& kernel = library_->require("residual");
  const bool with_scalars = kernel.rows > 3 * nodes_;
  each(kernel, u, [&](auto lanes, Index first, Index count, const double* A, Index) {
    constexpr int L = decltype(lanes)::value;
    const LaneCells cells{cells_.data() + first * cells_.cols(), count, nodes_, scalars_};
    scatter_nodes<L>(cells, A, scale, r.data());
    if (!with_scalars) return;
    for (Index lane = 0; lane < count; ++lane)
      for (Index s = 0; s < scalars_; ++s)
        r[cells.row(lane)[nodes_ + s] + scalar_offset_] +=
            scale * scalar_unit_ * A[(3 * nodes_ + s) * L + lane];
  });
}

void KernelTerm::scale_tangent(double scale, double* A) const {
  const std::ptrdiff_t lanes = library_->table().lanes, cols = tangent_->cols;
  const std::ptrdiff_t nodal = 3 * std::ptrdiff_t{nodes_};
  if (scale == 1.0 && scalars_ == 0) return;
  for (std::ptrdiff_t r = 0; r < tangent_->rows; ++r) {
    const std::ptrdiff_t end = lower_only(*tangent_) ? r + 1 : cols;
    for (std::ptrdiff_t c = 0; c < end; ++c) {
      const double by = scale * (r < nodal ? 1.0 : scalar_unit_) * (c < nodal ? 1.0 : scalar_unit_);
      for (std::ptrdiff_t lane = 0; lane < lanes; ++lane)
        A[(r * cols + c) * lanes + lane] *= by;
    }
  }
}

void KernelTerm::tangent(const ConstVector& u, double scale, const Scatter& map,
                         MutableVector values) const {
  if (tangent_ == nullptr) return;
  each(*tangent_, u, [&](auto lanes, Index first, Index count, double* A, Index) {
    constexpr int L = decltype(lanes)::value;
    scale_tangent(scale, A);
    if (lower_only(*tangent_)) mirror_lower<L>(tangent_->rows, A);
    const LaneCells cells{cells_.data() + first * cells_.cols(), count, nodes_, scalars_};
    add_full<L>(cells, map, first, A, values.data());
  });
}

bool KernelTerm::matches(const KernelTerm& other) const {
  const supple_library &table = library_->table(), &others = other.library_->table();
  return tangent_ != nullptr && other.tangent_ != nullptr && !lower_only(*tangent_) &&
         !lower_only(*other.tangent_) && tangent_->rows == other.tangent_->rows && scalars_ == 0 &&
         other.scalars_ == 0 && table.lanes == others.lanes && points_ == other.points_ &&
         same_cells(cells_, other.cells_);
}

bool KernelTerm::tangent_with(const Term& term, const ConstVector& u, const Scatter& map,
                              MutableVector values) const {
  const auto* const other = dynamic_cast<const KernelTerm*>(&term);
  if (other == nullptr || !matches(*other)) return false;
  other->require_fields();
  other->work_->prepare(*other->tangent_, other->library_->table());
  each(*tangent_, u, [&](auto lanes, Index first, Index count, double* A, Index) {
    constexpr int L = decltype(lanes)::value;
    Buffers& b = other->work_->thread[static_cast<std::size_t>(omp_get_thread_num())];
    other->fill_constants(*other->tangent_, b);
    other->template add<L>(*other->tangent_, first, u.data(), b, A);
    const LaneCells cells{cells_.data() + first * cells_.cols(), count, nodes_, scalars_};
    add_full<L>(cells, map, first, A, values.data());
  });
  return true;
}

void KernelTerm::tangent(const ConstVector& u, double scale, const LowerScatter& map,
                         MutableVector values) const {
  if (tangent_ == nullptr) return;
  each(*tangent_, u, [&](auto lanes, Index first, Index count, double* A, Index) {
    constexpr int L = decltype(lanes)::value;
    scale_tangent(scale, A);
    const LaneCells cells{cells_.data() + first * cells_.cols(), count, nodes_, scalars_};
    add_lower<L>(cells, map, first, A, values.data());
  });
}

VolumeRatio KernelTerm::volume_ratio(const ConstVector& u) const {
  if (volume_ratio_ == nullptr) return {};
  std::vector<VolumeRatio>& worst = work_->worst;
  std::fill(worst.begin(), worst.end(), VolumeRatio{});
  each(*volume_ratio_, u, [&](auto lanes, Index first, Index count, const double* A, Index group) {
    VolumeRatio& w = worst[static_cast<std::size_t>(group)];
    for (Index lane = 0; lane < count; ++lane) {
      for (int p = 0; p < volume_ratio_->rows; ++p) {
        const double J = A[p * decltype(lanes)::value + lane];
        if (!(J >= w.value)) w = {std::isnan(J) ? -INFINITY : J, first + lane, 0};
      }
    }
  });
  VolumeRatio smallest;
  for (const VolumeRatio& w : worst) {
    if (w.value < smallest.value) smallest = w;
  }
  if (smallest.cell >= 0) smallest.cell = order_[static_cast<std::size_t>(smallest.cell)];
  return smallest;
}

Eigen::MatrixXd KernelTerm::tabulate(const std::string& name, const ConstVector& u) const {
  const supple_kernel& kernel = library_->require(name);
  const std::ptrdiff_t size = entries(kernel);
  Eigen::MatrixXd out(cells_.rows(), size);
  each(kernel, u, [&](auto lanes, Index first, Index count, double* A, Index) {
    constexpr int L = decltype(lanes)::value;
    if (lower_only(kernel)) mirror_lower<L>(kernel.rows, A);
    for (Index lane = 0; lane < count; ++lane) {
      const Index given = order_[static_cast<std::size_t>(first + lane)];
      for (std::ptrdiff_t i = 0; i < size; ++i)
        out(given, i) = A[i * L + lane];
    }
  });
  return out;
}

} // namespace supple
