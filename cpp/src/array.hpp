/// Memory for numbers that are all written before they are read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

#include "supple/error.hpp"

namespace supple {

/// Large arrays that need no first value, and whose pages are kept from one use to the next.
class Array {
 public:
  /// Room for `size` numbers; what was there before is lost where it has to grow.
  /// @throws NumericalError if there is no memory.
  double* sized(std::int64_t size) {
    if (size > size_) {
      values_.reset();
      size_ = 0;
      values_.reset(new (std::nothrow) double[static_cast<std::size_t>(size)]);
      if (!values_)
        throw NumericalError(
            "the factorisation ran out of memory; use a coarser mesh or a lower order");
      size_ = size;
    }
    return values_.get();
  }
  double* get() const { return values_.get(); }

 private:
  std::unique_ptr<double[]> values_;
  std::int64_t size_ = 0;
};

} // namespace supple
