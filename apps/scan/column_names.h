#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace groundray {

/// How a column was found.
struct NamedColumn {
  std::string name;              ///< its own
  std::optional<double> unit_s;  ///< of a time, if the name ends in a unit
};

/// Returns which of `columns` is called by a word for what groundray calls `ours`
/// (docs/formats.md): the first in the order of the words, whatever the case and the signs between
/// letters. Nothing if there is none.
std::optional<NamedColumn> find_column(const std::vector<std::string>& columns,
                                       std::string_view ours);

}  // namespace groundray
