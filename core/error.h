#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace groundray {

/// Fault of the caller or of a file. The message is written for people: subject, value, rule and
/// likely remedy. One Error may list several faults, one per line.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  /// Formats the message.
  template <typename... Args>
    requires(sizeof...(Args) > 0)
  explicit Error(fmt::format_string<Args...> format, Args&&... args)
      : std::runtime_error(without_nul(fmt::format(format, std::forward<Args>(args)...))) {}

 private:
  /// Returns the message with `\x00` for each NUL, at which what() would end.
  static std::string without_nul(std::string message);
};

/// Collects all broken rules of one subject, so that the user sees them at once.
class Violations {
 public:
  /// @param subject  subject of the rules (a type, file or section); begins the message.
  explicit Violations(std::string subject) : subject_(std::move(subject)) {}

  /// Records a fault unless `holds`.
  template <typename... Args>
  void unless(bool holds, fmt::format_string<Args...> format, Args&&... args) {
    if (!holds) faults_.push_back(fmt::format(format, std::forward<Args>(args)...));
  }

  /// @throws Error with one line for each fault, if there is any.
  void throw_if_any() const;

 private:
  std::string subject_;
  std::vector<std::string> faults_;
};

}  // namespace groundray
