#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace groundray {

/// Value of a Python literal: None, a bool, an integer, a string, a list or tuple, or a dict whose
/// keys are strings.
struct PythonLiteral {
  using List = std::vector<PythonLiteral>;
  struct Dict {
    std::vector<std::string> keys;
    List values;
  };
  std::variant<std::monostate, bool, std::int64_t, std::string, List, Dict> value;

  /// Returns the value of a dict at `key`, or null if there is none.
  const PythonLiteral* find(std::string_view key) const;
  template <typename T>
  const T* as() const {
    return std::get_if<T>(&value);
  }
};

/// Parses one literal, nested at most 32 deep, and surrounding blanks from all of `text`.
/// @throws Error if it is not a literal of these kinds.
PythonLiteral parse_python_literal(std::string_view text);

}  // namespace groundray
