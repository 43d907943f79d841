#include "supple/kernel_term.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "supple/error.hpp"

namespace supple {

namespace {

constexpr Index kSmallestGroup = 16;  // cells that one thread treats in one go, at least
constexpr Index kMostGroups = 48;     // few groups need few colours, and a colour ends in a barrier
constexpr Index kWorthThreads = 1000; // fewer cells are done before a second thread is awake

Index group_size(Index cells, Index lanes) {
  const Index size = std::max(kSmallestGroup, (cells + kMostGroups - 1) / kMostGroups);
  return (size + lanes - 1) / lanes * lanes;
}

/// Doubles that begin at a multiple of SUPPLE_ALIGNMENT.
class AlignedArray {
 public:
  void resize(std::size_t size) {
    constexpr std::size_t kSpare = SUPPLE_ALIGNMENT / sizeof(double);
    store_.assign(size + kSpare, 0.0);
    size_ = size;
    void* start = store_.data();
    std::size_t room = store_.size() * sizeof(double);
    start_ = static_cast<double*>(std::align(SUPPLE_ALIGNMENT, size * sizeof(double), start, room));
  }
  double* data() const { return start_; }
  double* begin() const { return start_; }
  double* end() const { return start_ + size_; }

 private:
  std::vector<double> store_;
  std::size_t size_ = 0;
  double* start_ = nullptr;
};

/// Fill the entries above the diagonal of symmetric matrices A (n × n)[lanes].
void mirror(std::ptrdiff_t n, std::ptrdiff_t lanes, double* A) {
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    for (std::ptrdiff_t j = 0; j < i; ++j)
      std::copy_n(A + (i * n + j) * lanes, lanes, A + (j * n + i) * lanes);
  }
}

} // namespace

struct KernelTerm::Buffers {
  AlignedArray A, w, x;
};

KernelTerm::KernelTerm(std::shared_ptr<const KernelLibrary> library,
                       std::shared_ptr<const Vector> points, Connectivity cells, Index scalars)
    : library_(std::move(library)), points_(std::move(points)), cells_(std::move(cells)) {
  const supple_library& table = library_->table();
  nodes_ = table.nodes;
  scalars_ = table.scalars;
  require_size("nodes per cell", cells_.cols(), nodes_ + scalars_,
               "pass cells of the kernels' element, and its scalars where it has some");
  const auto nodes = static_cast<Index>(points_->size() / 3);
  scalar_offset_ = 2 * nodes;
  group_ = group_size(static_cast<Index>(cells_.rows()), table.lanes);
  colouring_ = colour_cells(cells_, nodes + scalars, group_);
  fields_.resize(static_cast<std::size_t>(table.field_count));
  energy_ = library_->find("energy");
  tangent_ = library_->find("tangent");
  volume_ratio_ = library_->find("volume_ratio");
}

void KernelTerm::set_field(const std::string& name, Vector values) {
  const int number = library_->field(name);
  if (number < 0 || name == "u") {
    throw ShapeError("field " + name + " is unknown to " + library_->table().unit);
  }
  const supple_field& field = library_->table().fields[number];
  require_size(field.name, values.size(), cells_.rows() * field.size, "one row for each cell");
  fields_[static_cast<std::size_t>(number)] = std::move(values);
  constant_.resize(0);
}

void KernelTerm::require_fields() const {
  for (std::size_t f = 0; f < fields_.size(); ++f) {
    const supple_field& field = library_->table().fields[f];
    if (field.name != std::string("u") && fields_[f].size() == 0 && cells_.rows() > 0) {
      throw StateError(std::string("field ") + field.name + " of " + library_->table().unit +
                       " has no values; call set_field first");
    }
  }
}

void KernelTerm::call(const supple_kernel& kernel, Index first, const ConstVector& u,
                      Buffers& b) const {
  const supple_library& table = library_->table();
  const std::ptrdiff_t lanes = table.lanes, m = nodes_, all = nodes_ + scalars_;
  std::fill(b.A.begin(), b.A.end(), 0.0);
  double* w = b.w.data();
  for (int f = 0; f < kernel.field_count; ++f) {
    const auto number = static_cast<std::size_t>(kernel.fields[f]);
    const std::ptrdiff_t size = table.fields[number].size;
    const bool nodal = fields_[number].size() == 0;
    for (std::ptrdiff_t lane = 0; lane < lanes; ++lane) {
      const std::ptrdiff_t cell = std::min<std::ptrdiff_t>(first + lane, cells_.rows() - 1);
      if (nodal) {
        const Index* node = cells_.data() + cell * all;
        for (std::ptrdiff_t i = 0; i < 3 * m; ++i)
          w[i * lanes + lane] = u[3 * node[i / 3] + i % 3];
        for (std::ptrdiff_t i = 3 * m; i < size; ++i)
          w[i * lanes + lane] = scalar_unit_ * u[node[i - 2 * m] + scalar_offset_];
      } else {
        const double* value = fields_[number].data() + cell * size;
        for (std::ptrdiff_t i = 0; i < size; ++i)
          w[i * lanes + lane] = value[i];
      }
    }
    w += size * lanes;
  }
  const double* points = points_->data();
  for (std::ptrdiff_t lane = 0; lane < lanes; ++lane) {
    const Index* node =
        cells_.data() + std::min<std::ptrdiff_t>(first + lane, cells_.rows() - 1) * all;
    for (std::ptrdiff_t i = 0; i < 3 * m; ++i) {
      b.x.data()[i * lanes + lane] = points[3 * node[i / 3] + i % 3];
    }
  }
  kernel.call(b.A.data(), b.w.data(), b.x.data());
  if (kernel.lower != 0) mirror(kernel.rows, lanes, b.A.data());
}

template <class Consume>
void KernelTerm::each(const supple_kernel& kernel, const ConstVector& u, Consume consume) const {
  require_fields();
  const supple_library& table = library_->table();
  const Index lanes = table.lanes, cells = static_cast<Index>(cells_.rows());
  const Index group = group_;
  std::size_t w_size = 0;
  for (int f = 0; f < kernel.field_count; ++f) {
    w_size += static_cast<std::size_t>(table.fields[kernel.fields[f]].size);
  }
  const auto width = static_cast<std::size_t>(lanes);
#pragma omp parallel if (cells >= kWorthThreads)
  {
    Buffers b;
    b.A.resize(static_cast<std::size_t>(kernel.rows) * static_cast<std::size_t>(kernel.cols) *
               width);
    b.w.resize(std::max<std::size_t>(w_size, 1) * width);
    b.x.resize(3 * static_cast<std::size_t>(table.nodes) * width);
    for (Index colour = 0; colour < colouring_.colours(); ++colour) {
      const Index begin = colouring_.offset[static_cast<std::size_t>(colour)];
      const Index end = colouring_.offset[static_cast<std::size_t>(colour) + 1];
#pragma omp for schedule(dynamic)
      for (Index k = begin; k < end; ++k) {
        const Index batch = colouring_.order[static_cast<std::size_t>(k)];
        const Index last = std::min(cells, (batch + 1) * group);
        for (Index first = batch * group; first < last; first += lanes) {
          call(kernel, first, u, b);
          consume(first, std::min(lanes, last - first), b.A.data(), batch);
        }
      }
    }
  }
}

double KernelTerm::energy(const ConstVector& u) const {
  if (energy_ == nullptr) return constant().dot(u.head(points_->size())); // a load alike for all u
  std::vector<double> sums(colouring_.order.size(), 0.0);
  each(*energy_, u, [&](Index, Index count, const double* A, Index batch) {
    for (Index lane = 0; lane < count; ++lane)
      sums[static_cast<std::size_t>(batch)] += A[lane];
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
  const Index lanes = library_->table().lanes, rows = kernel.rows;
  each(kernel, u, [&](Index first, Index count, const double* A, Index) {
    for (Index lane = 0; lane < count; ++lane) {
      const Index* node = cells_.data() + static_cast<std::ptrdiff_t>(first + lane) * cells_.cols();
      for (Index i = 0; i < rows; ++i)
        r[dof(node, i)] += scale * unit(i) * A[i * lanes + lane];
    }
  });
}

void KernelTerm::tangent(const ConstVector& u, double scale, const Scatter& map,
                         MutableVector values) const {
  if (tangent_ == nullptr) return;
  const std::ptrdiff_t lanes = library_->table().lanes;
  const std::ptrdiff_t entries = std::ptrdiff_t{tangent_->rows} * tangent_->cols;
  each(*tangent_, u, [&](Index first, Index count, double* A, Index) {
    if (scale != 1.0) {
      for (std::ptrdiff_t i = 0; i < entries * lanes; ++i)
        A[i] *= scale;
    }
    if (scalars_ > 0) {
      for (std::ptrdiff_t i = 0; i < entries; ++i) {
        const double both = unit(static_cast<Index>(i / tangent_->cols)) *
                            unit(static_cast<Index>(i % tangent_->cols));
        for (std::ptrdiff_t lane = 0; lane < lanes; ++lane)
          A[i * lanes + lane] *= both;
      }
    }
    for (Index lane = 0; lane < count; ++lane) {
      scatter_add(map, first + lane, A + lane, values.data(), lanes);
    }
  });
}

VolumeRatio KernelTerm::volume_ratio(const ConstVector& u) const {
  if (volume_ratio_ == nullptr) return {};
  std::vector<VolumeRatio> worst(colouring_.order.size());
  const Index lanes = library_->table().lanes;
  each(*volume_ratio_, u, [&](Index first, Index count, const double* A, Index batch) {
    VolumeRatio& w = worst[static_cast<std::size_t>(batch)];
    for (Index lane = 0; lane < count; ++lane) {
      for (int p = 0; p < volume_ratio_->rows; ++p) {
        const double J = A[p * lanes + lane];
        if (!(J >= w.value)) w = {std::isnan(J) ? -INFINITY : J, first + lane, 0};
      }
    }
  });
  VolumeRatio smallest;
  for (const VolumeRatio& w : worst) {
    if (w.value < smallest.value) smallest = w;
  }
  return smallest;
}

Eigen::MatrixXd KernelTerm::tabulate(const std::string& name, const ConstVector& u) const {
  const supple_kernel& kernel = library_->require(name);
  const std::ptrdiff_t entries = std::ptrdiff_t{kernel.rows} * kernel.cols;
  const Index lanes = library_->table().lanes;
  Eigen::MatrixXd out(cells_.rows(), entries);
  each(kernel, u, [&](Index first, Index count, const double* A, Index) {
    for (Index lane = 0; lane < count; ++lane) {
      for (std::ptrdiff_t i = 0; i < entries; ++i)
        out(first + lane, i) = A[i * lanes + lane];
    }
  });
  return out;
}

} // namespace supple
