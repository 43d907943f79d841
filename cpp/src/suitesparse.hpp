/// What the two SuiteSparse backends share; private to the runtime.
#pragma once

#include <SuiteSparse_config.h>

#include <cstdint>
#include <string>
#include <vector>

#include "supple/error.hpp"

namespace supple {

// The 64-bit integer is the macro SuiteSparse_long in old releases, int64_t from SuiteSparse 7 on.
#ifdef SuiteSparse_long
using Long = SuiteSparse_long;
#else
using Long = std::int64_t;
#endif
static_assert(sizeof(Long) == sizeof(std::int64_t), "SuiteSparse's long interface must be 64-bit");

inline const Long* as_long(const std::vector<std::int64_t>& v) {
  return reinterpret_cast<const Long*>(v.data());
}
inline Long* as_long(std::vector<std::int64_t>& v) {
  return reinterpret_cast<Long*>(v.data());
}

/// The exception for a library that gave up at `stage`.
inline NumericalError library_error(const char* library, const char* stage, int status,
                                    bool memory) {
  return NumericalError(std::string(library) + " " + stage +
                        (memory ? " ran out of memory" : " failed") + " (status " +
                        std::to_string(status) + ")" +
                        (memory ? "; use a coarser mesh or a lower order" : "; check the pattern"));
}

} // namespace supple
