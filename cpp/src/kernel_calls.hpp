/// How a term calls its kernels: batch by batch, by all threads; private to the runtime.
///
/// Here are the members of KernelTerm that are templates, and what they work with. Only
/// kernel_term.cpp includes this.
#pragma once

#include <omp.h>

#include <algorithm>
#include <string>
#include <type_traits>
#include <vector>

#include "array.hpp"
#include "lanes.hpp"
#include "supple/error.hpp"
#include "supple/kernel_term.hpp"

namespace supple {

constexpr Index kWorthThreads = 1000; // fewer cells are done before a second thread is awake

/// The kernel leaves entries with column > row as they were.
inline bool lower_only(const supple_kernel& kernel) {
  return kernel.lower != 0;
}

inline std::ptrdiff_t entries(const supple_kernel& kernel) {
  return std::ptrdiff_t{kernel.rows} * kernel.cols;
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

/// What a thread needs to call a kernel.
struct KernelTerm::Buffers {
  Array A, w, x;
};

struct KernelTerm::Workspace {
  std::vector<Buffers> thread;
  std::vector<double> energy;     // of each group of cells
  std::vector<VolumeRatio> worst; // the same

  void prepare(const supple_kernel& kernel, const supple_library& table) {
    std::int64_t fields = 0;
    for (int f = 0; f < kernel.field_count; ++f)
      fields += table.fields[kernel.fields[f]].size;
    const std::int64_t lanes = table.lanes;
    const auto threads = static_cast<std::size_t>(omp_get_max_threads());
    if (thread.size() < threads) thread.resize(threads);
    for (Buffers& b : thread) {
      b.A.sized(entries(kernel) * lanes);
      b.w.sized(std::max<std::int64_t>(fields, 1) * lanes);
      b.x.sized(3 * table.nodes * lanes);
    }
  }
};

inline void KernelTerm::fill_constants(const supple_kernel& kernel, Buffers& b) const {
  const supple_library& table = library_->table();
  double* w = b.w.get();
  for (int f = 0; f < kernel.field_count; ++f) {
    const Field& field = fields_[static_cast<std::size_t>(kernel.fields[f])];
    if (field.stride == 0) std::copy_n(field.values.data(), field.values.size(), w);
    w += std::ptrdiff_t{table.fields[kernel.fields[f]].size} * table.lanes;
  }
}

template <int L>
void KernelTerm::add(const supple_kernel& kernel, Index first, const double* u, Buffers& b,
                     double* A) const {
  const supple_library& table = library_->table();
  const auto left = static_cast<Index>(cells_.rows() - first);
  const LaneCells cells{cells_.data() + first * cells_.cols(), std::min(left, Index{L}), nodes_,
                        scalars_};
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
  kernel.call(A, b.w.get(), b.x.get());
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
          clear<L>(kernel, b.A.get());
          add<L>(kernel, first, u, b, b.A.get());
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

} // namespace supple
