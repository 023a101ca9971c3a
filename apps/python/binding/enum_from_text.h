#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"

namespace groundray::python {

/// Returns the value that a keyword selects.
/// @param name  name of the argument, for messages.
/// @throws Error that lists the keywords if `word` is not among them.
template <typename T>
T chosen(std::string_view name, const std::string& word,
         std::initializer_list<std::pair<std::string_view, T>> words) {
  std::vector<std::string_view> all;
  for (const auto& each : words) {
    if (each.first == word) return each.second;
    all.push_back(each.first);
  }
  throw Error("{} = '{}' must be one of {}", name, word, fmt::join(all, ", "));
}

}  // namespace groundray::python
