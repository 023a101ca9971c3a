#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace groundray {

/// A value as Python writes it: None, a truth value, a whole number, a text, a list or tuple, or a
/// dict whose keys are texts.
struct PythonLiteral {
  using List = std::vector<PythonLiteral>;
  struct Dict {
    std::vector<std::string> keys;
    List values;
  };
  std::variant<std::monostate, bool, std::int64_t, std::string, List, Dict> value;

  /// Returns what a dict has at `key`, or null.
  const PythonLiteral* find(std::string_view key) const;
  template <typename T>
  const T* as() const {
    return std::get_if<T>(&value);
  }
};

/// Reads one literal, and blanks around it, from all of `text`; no more than 32 deep.
/// @throws Error if it is none of those above.
PythonLiteral parse_python_literal(std::string_view text);

}  // namespace groundray
