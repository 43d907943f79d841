/// Memory for numbers that are all written before they are read.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "supple/error.hpp"
#include "supple/kernel.h"

namespace supple {

/// Large arrays of numbers, aligned as kernels want it, that need no first value, and whose pages
/// are kept from one use to the next.
template <class T>
class ArrayOf {
 public:
  /// Room for `size` numbers; what was there before is lost where it has to grow.
  /// @throws NumericalError if there is no memory.
  T* sized(std::int64_t size) {
    if (size > size_) {
      values_.reset();
      size_ = 0;
      const std::size_t bytes = static_cast<std::size_t>(size) * sizeof(T);
      const std::size_t align = bytes < 4 * kHugePage ? kAlign : kHugePage;
      const std::size_t whole = (bytes / align + 1) * align;
      values_.reset(static_cast<T*>(std::aligned_alloc(align, whole)));
      if (align == kHugePage && values_) madvise(values_.get(), whole, MADV_HUGEPAGE);
      if (!values_) throw NumericalError("out of memory; use a coarser mesh or a lower order");
      size_ = size;
    }
    return values_.get();
  }
  T* get() const { return values_.get(); }

 private:
  static constexpr std::size_t kAlign = SUPPLE_ALIGNMENT, kHugePage = 1 << 21;
  struct Free {
    void operator()(T* values) const { std::free(values); }
  };
  std::unique_ptr<T, Free> values_;
  std::int64_t size_ = 0;
};

using Array = ArrayOf<double>;

} // namespace supple
