#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace groundray::testing {

/// Sets an environment variable and restores it in the destructor.
class Environment {
 public:
  Environment(const char* name, const std::filesystem::path& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ~Environment() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

}  // namespace groundray::testing
