#include "supple/kernel_term.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <type_traits>

#include "cell_order.hpp"
#include "lanes.hpp"
#include "node_cells.hpp"
#include "supple/error.hpp"

namespace supple {

namespace {

constexpr Index kSmallestGroup = 64;  // cells that one thread treats in one go, at least
constexpr Index kLargestGroup = 2048; // what they read and add to fits the second cache
constexpr Index kMostGroups = 128;    // unless that asks for more: a colour ends in a barrier
constexpr Index kWorthThreads = 1000; // fewer cells are done before a second thread is awake
constexpr std::size_t kAlignment = SUPPLE_ALIGNMENT;

Index group_size(Index cells, Index lanes) {
  const Index size = std::clamp(cells / kMostGroups + 1, kSmallestGroup, kLargestGroup);
  return (size + lanes - 1) / lanes * lanes;
}

/// Numbers at an address that is a multiple of SUPPLE_ALIGNMENT.
class Aligned {
 public:
  void grow(std::size_t size) {
    if (size <= size_) return;
    values_.reset(
        static_cast<double*>(::operator new(size * sizeof(double), std::align_val_t{kAlignment})));
    size_ = size;
  }
  double* get() const { return values_.get(); }

 private:
  struct Free {
    void operator()(double* values) const {
      ::operator delete(values, std::align_val_t{kAlignment});
    }
  };
  std::unique_ptr<double, Free> values_;
  std::size_t size_ = 0;
};

/// The kernel leaves entries with column > row as they were.
bool lower_only(const supple_kernel& kernel) {
  return kernel.lower != 0;
}

std::size_t entries(const supple_kernel& kernel) {
  return static_cast<std::size_t>(kernel.rows) * static_cast<std::size_t>(kernel.cols);
}

/// A = 0 where the kernel adds to it.
template <int L>
void clear(const supple_kernel& kernel, double* A) {
  if (!lower_only(kernel)) {
    std::fill_n(A, entries(kernel) * L, 0.0);
    return;
  }
  for (std::ptrdiff_t r = 0; r < kernel.rows; ++r)
    std::fill_n(A + r * kernel.cols * L, (r + 1) * L, 0.0);
}

} // namespace

/// What a thread needs to call a kernel.
struct KernelTerm::Buffers {
  Aligned A, w, x;
};

struct KernelTerm::Workspace {
  std::vector<Buffers> thread;
  std::vector<double> energy;     // of each group of cells
  std::vector<VolumeRatio> worst; // the same

  void prepare(const supple_kernel& kernel, const supple_library& table) {
    std::size_t fields = 0;
    for (int f = 0; f < kernel.field_count; ++f)
      fields += static_cast<std::size_t>(table.fields[kernel.fields[f]].size);
    const auto lanes = static_cast<std::size_t>(table.lanes);
    const auto threads = static_cast<std::size_t>(omp_get_max_threads());
    if (thread.size() < threads) thread.resize(threads);
    for (Buffers& b : thread) {
      b.A.grow(entries(kernel) * lanes);
      b.w.grow(std::max<std::size_t>(fields, 1) * lanes);
      b.x.grow(3 * static_cast<std::size_t>(table.nodes) * lanes);
    }
  }
};

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

void KernelTerm::fill_constants(const supple_kernel& kernel, Buffers& b) const {
  const supple_library& table = library_->table();
  double* w = b.w.get();
  for (int f = 0; f < kernel.field_count; ++f) {
    const Field& field = fields_[static_cast<std::size_t>(kernel.fields[f])];
    if (field.stride == 0) std::copy_n(field.values.data(), field.values.size(), w);
    w += std::ptrdiff_t{table.fields[kernel.fields[f]].size} * table.lanes;
  }
}

template <int L>
void KernelTerm::call(const supple_kernel& kernel, Index first, const double* u, Buffers& b) const {
  const supple_library& table = library_->table();
  const auto left = static_cast<Index>(cells_.rows() - first);
  const LaneCells cells{cells_.data() + first * cells_.cols(), std::min(left, Index{L}), nodes_,
                        scalars_};
  clear<L>(kernel, b.A.get());
  double* w = b.w.get();
  for (int f = 0; f < kernel.field_count; ++f) {
    const Field& field = fields_[static_cast<std::size_t>(kernel.fields[f])];
    const std::ptrdiff_t size = table.fields[kernel.fields[f]].size;
    if (field.values.size() == 0) {
      gather_nodes<L>(cells, u, w);
      for (Index lane = 0; lane < L * scalars_; ++lane) {
        const Index a = nodes_ + lane / L;
        const Index scalar = cells.row(std::min(lane % L, cells.count - 1))[a] + scalar_offset_;
        w[3 * nodes_ * L + lane] = scalar_unit_ * u[scalar];
      }
    } else if (field.stride != 0) {
      std::copy_n(field.values.data() + first / L * field.stride, size * L, w);
    }
    w += size * L;
  }
  gather_nodes<L>(cells, points_->data(), b.x.get());
  kernel.call(b.A.get(), b.w.get(), b.x.get());
}

template <int L, class Consume>
void KernelTerm::each_of(const supple_kernel& kernel, const double* u, Consume consume) const {
  const auto cells = static_cast<Index>(cells_.rows());
#pragma omp parallel if (cells >= kWorthThreads)
  {
    Buffers& b = work_->thread[static_cast<std::size_t>(omp_get_thread_num())];
    fill_constants(kernel, b);
    for (Index colour = 0; colour < colouring_.colours(); ++colour) {
      const Index begin = colouring_.offset[static_cast<std::size_t>(colour)];
      const Index end = colouring_.offset[static_cast<std::size_t>(colour) + 1];
#pragma omp for schedule(dynamic)
      for (Index k = begin; k < end; ++k) {
        const Index group = colouring_.order[static_cast<std::size_t>(k)];
        const Index last = std::min(cells, (group + 1) * group_);
        for (Index first = group * group_; first < last; first += L) {
          call<L>(kernel, first, u, b);
          consume(std::integral_constant<int, L>(), first, std::min(Index{L}, last - first),
                  b.A.get(), group);
        }
      }
    }
  }
}

template <class Consume>
void KernelTerm::each(const supple_kernel& kernel, const ConstVector& u, Consume consume) const {
  require_fields();
  if (cells_.rows() == 0) return;
  work_->prepare(kernel, library_->table());
  switch (library_->table().lanes) {
  case 1:
    return each_of<1>(kernel, u.data(), consume);
  case 2:
    return each_of<2>(kernel, u.data(), consume);
  case 4:
    return each_of<4>(kernel, u.data(), consume);
  case 8:
    return each_of<8>(kernel, u.data(), consume);
  default:
    throw ShapeError("kernels must have 1, 2, 4 or 8 lanes, got " +
                     std::to_string(library_->table().lanes) + "; compile them anew");
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
    for (Index lane = 0; lane < count; ++lane)
      scatter_add(map, first + lane, A + lane, values.data(), L);
  });
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
  const auto size = static_cast<std::ptrdiff_t>(entries(kernel));
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
