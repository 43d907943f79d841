#include "supple/library.hpp"

#include <dlfcn.h>

#include <cstring>
#include <map>
#include <mutex>

#include "supple/error.hpp"

namespace supple {

namespace {

const supple_library* open_table(const std::string& path) {
  void* handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    throw Error("kernel library " + path + " cannot be loaded (" + dlerror() + "); delete it");
  }
  void* symbol = dlsym(handle, "supple_kernels");
  if (symbol == nullptr) {
    throw Error("kernel library " + path + " has no table supple_kernels; delete it");
  }
  const supple_library* table = reinterpret_cast<const supple_library* (*)()>(symbol)();
  if (table->abi != SUPPLE_KERNEL_ABI) {
    throw Error("kernel library " + path + " must have ABI " + std::to_string(SUPPLE_KERNEL_ABI) +
                ", got " + std::to_string(table->abi) + "; delete it or rebuild");
  }
  return table;
}

} // namespace

std::shared_ptr<const KernelLibrary> KernelLibrary::load(const std::string& path) {
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<const KernelLibrary>> loaded;
  const std::lock_guard<std::mutex> lock(mutex);
  auto& entry = loaded[path];
  if (!entry) {
    try {
      entry.reset(new KernelLibrary(open_table(path)));
    } catch (...) {
      loaded.erase(path);
      throw;
    }
  }
  return entry;
}

const supple_kernel* KernelLibrary::find(const std::string& name) const {
  for (int i = 0; i < table_->kernel_count; ++i) {
    if (name == table_->kernels[i].name) return &table_->kernels[i];
  }
  return nullptr;
}

const supple_kernel& KernelLibrary::require(const std::string& name) const {
  if (const supple_kernel* kernel = find(name)) return *kernel;
  std::string there;
  for (int i = 0; i < table_->kernel_count; ++i)
    there += std::string(" ") + table_->kernels[i].name;
  throw Error(std::string("kernel library ") + table_->unit + " has no " + name + "; it has" +
              there);
}

int KernelLibrary::field(const std::string& name) const {
  for (int i = 0; i < table_->field_count; ++i) {
    if (name == table_->fields[i].name) return i;
  }
  return -1;
}

} // namespace supple
