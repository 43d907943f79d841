/// MKL's Pardiso, found at run time: Supple neither links nor needs it.
#pragma once

#include <string>

namespace supple {

/// Load MKL's single library, `libmkl_rt.so.N`, for factors with Library::Pardiso; once loaded it
/// stays. MKL then shares the threads of this runtime's OpenMP.
/// @throws NumericalError if `path` cannot be loaded or is not MKL's.
void load_pardiso(const std::string& path);

/// Whether load_pardiso was called and went well.
bool pardiso_loaded();

} // namespace supple
