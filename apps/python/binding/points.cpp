#include "apps/python/binding/points.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <variant>

namespace groundray::python {
namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 19> units{{
    {"x", "m"},           {"y", "m"},
    {"z", "m"},           {"time", "s"},
    {"world_x", "m"},     {"world_y", "m"},
    {"world_z", "m"},     {"range_true", "m"},
    {"incidence", "rad"}, {"error_estimate", "m"},
    {"amplitude", "w"},   {"width", "s"},
    {"range_sd", "m"},    {"vx", "m_s"},
    {"vy", "m_s"},        {"vz", "m_s"},
    {"error_bound", "m"}, {"range", "m"},
    {"t", "s"},
}};

}  // namespace

std::string name_with_unit(const std::string& column) {
  const auto* found = std::ranges::find(units, column, [](const auto& unit) { return unit.first; });
  return found == units.end() ? column : fmt::format("{}_{}", column, found->second);
}

std::vector<std::string> names_of(const Points& points) {
  std::vector<std::string> names;
  for (const PointCloud::Column& column : points.cloud.columns())
    names.push_back(name_with_unit(column.name));
  return names;
}

AnyArray column_of(const Points& points, const std::string& name, nb::handle owner) {
  for (const PointCloud::Column& column : points.cloud.columns()) {
    if (name_with_unit(column.name) != name) continue;
    return std::visit(
        [&](const auto& values) { return view(values.data(), {values.size()}, owner); },
        column.values);
  }
  const std::string text =
      fmt::format("there is no column '{}'; there are {}", name, fmt::join(names_of(points), ", "));
  throw nb::key_error(text.c_str());
}

}  // namespace groundray::python
