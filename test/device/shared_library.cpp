#include "test/device/shared_library.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "test/device/kernel_device.h"

namespace groundray::testing {

SharedLibrary::SharedLibrary(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    handle_ = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    name_ = name;
    if (handle_ != nullptr) return;
  }
  throw NoDevice(fmt::format("there is no driver: {} cannot be opened", fmt::join(names, ", ")));
}

void* SharedLibrary::address_of(const char* name) const {
  void* const address = dlsym(handle_, name);
  if (address == nullptr) throw std::runtime_error(fmt::format("{} has no {}", name_, name));
  return address;
}

}  // namespace groundray::testing
