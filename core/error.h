#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace groundray {

/// A fault of the caller or of a file, in words for a person: subject, value, rule and likely fix.
/// One Error may list several faults, a line for each.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;

  /// Formats the message in place.
  template <typename... Args>
    requires(sizeof...(Args) > 0)
  explicit Error(fmt::format_string<Args...> format, Args&&... args)
      : std::runtime_error(fmt::format(format, std::forward<Args>(args)...)) {}
};

/// Collects every broken rule of one subject, so that a user sees all of them at once.
class Violations {
 public:
  /// @param subject  what the rules are about: a type, a file, a section; heads the message.
  explicit Violations(std::string subject) : subject_(std::move(subject)) {}

  /// Notes a fault unless `holds`.
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
