/// A kernel library as the runtime sees it: loaded once, checked, found by kernel name.
#pragma once

#include <memory>
#include <string>

#include "supple/kernel.h"

namespace supple {

/// One shared object of generated kernels; stays loaded for the life of the process.
class KernelLibrary {
 public:
  /// Load `path`, or the copy that is loaded already.
  /// @throws Error if it cannot be loaded, is no kernel library or has another ABI.
  static std::shared_ptr<const KernelLibrary> load(const std::string& path);

  const supple_library& table() const { return *table_; }
  /// The kernel called `name`, nullptr where the library has none.
  const supple_kernel* find(const std::string& name) const;
  /// @throws Error naming the unit and what it has, where there is no such kernel.
  const supple_kernel& require(const std::string& name) const;
  /// Number of the field called `name`, −1 where there is none.
  int field(const std::string& name) const;

 private:
  explicit KernelLibrary(const supple_library* table) : table_(table) {}
  const supple_library* table_;
};

} // namespace supple
