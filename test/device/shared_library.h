#pragma once

#include <string>
#include <vector>

namespace groundray::testing {

/// Library of a driver, opened at run time. It is never closed, for drivers have threads.
class SharedLibrary {
 public:
  /// Opens the first of `names` that can be opened.
  /// @throws NoDevice if none can.
  explicit SharedLibrary(const std::vector<std::string>& names);

  /// Sets `function` to the library's function of that name.
  /// @throws NoDevice if it has none.
  template <typename Function>
  void find(Function*& function, const char* name) const {
    function = reinterpret_cast<Function*>(address_of(name));
  }

 private:
  void* address_of(const char* name) const;

  std::string name_;
  void* handle_ = nullptr;
};

}  // namespace groundray::testing
