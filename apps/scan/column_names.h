#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace groundray {

/// Column that was identified by its name.
struct NamedColumn {
  std::string name;              ///< name in the file
  std::optional<double> unit_s;  ///< unit of a time, if the name ends in one
};

/// Returns the column whose name is a synonym of groundray's name `ours`
/// (docs/reference/formats.md), ignoring case and all characters except letters and digits; nothing
/// if there is none. If there are several, the first one in the order of the synonyms.
std::optional<NamedColumn> find_column(const std::vector<std::string>& columns,
                                       std::string_view ours);

}  // namespace groundray
