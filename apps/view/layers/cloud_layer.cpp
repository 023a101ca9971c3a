#include "apps/view/layers/cloud_layer.h"

#include <fmt/format.h>
#include <vtkPointData.h>
#include <vtkTypeInt64Array.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <string_view>

#include "apps/scan/column_names.h"

namespace groundray {
namespace {

std::string lower(std::string_view text) {
  std::string small(text);
  std::ranges::transform(small, small.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return small;
}

const PointCloud::Column* find(const PointCloud& table, std::string_view name) {
  const auto found = std::ranges::find_if(table.columns(), [&](const PointCloud::Column& column) {
    return lower(column.name) == name;
  });
  return found == table.columns().end() ? nullptr : &*found;
}

// Returns the columns of x, y and z under any of their names; null for each that is missing.
std::array<const PointCloud::Column*, 3> position_columns(const PointCloud& table) {
  std::vector<std::string> names;
  for (const PointCloud::Column& column : table.columns()) names.push_back(column.name);
  std::array<const PointCloud::Column*, 3> axes{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto found = find_column(names, std::string_view("xyz").substr(k, 1));
    if (found)
      axes[k] = &*std::ranges::find(table.columns(), found->name, &PointCloud::Column::name);
  }
  return axes;
}

// Returns true if a column of that name holds kinds.
bool counts_kinds(std::string_view name) {
  constexpr std::array<std::string_view, 13> names = {
      "label",        "class",        "classification", "semantic", "return_index",
      "return_count", "second_label", "kind",           "material", "reason",
      "return",       "surface",      "group"};
  return std::ranges::find(names, lower(name)) != names.end();
}

// Returns the unit of a column, as listed in docs/reference/formats.md.
std::string unit_of(std::string_view name) {
  struct Unit {
    std::string_view unit;
    std::array<std::string_view, 12> names;
  };
  constexpr std::array<Unit, 5> units = {{
      {"m",
       {"range", "range_true", "error_estimate", "error_bound", "range_sd", "height", "sd",
        "signed_distance", "world_x", "world_y", "world_z", "elevation"}},
      {"rad", {"incidence"}},
      {"s", {"time", "width"}},
      {"W", {"amplitude"}},
      {"m/s", {"vx", "vy", "vz"}},
  }};
  const std::string small = lower(name);
  for (const Unit& unit : units) {
    if (std::ranges::find(unit.names, small) != unit.names.end()) return std::string(unit.unit);
  }
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> endings = {
      {{"_m_s", "m/s"}, {"_m", "m"}, {"_s", "s"}, {"_w", "W"}, {"_rad", "rad"}}};
  for (const auto& [ending, unit] : endings) {
    if (small.ends_with(ending)) return std::string(unit);
  }
  return "";
}

ColourScale scale_of(std::string_view name) {
  const std::string small = lower(name);
  if (small == "height" || small == "elevation") return ColourScale::Earth;
  if (small.starts_with("range") || small == "ring" || small.starts_with("time"))
    return ColourScale::Vivid;
  for (const std::string_view part : {"signed", "deviation", "difference"}) {
    if (small.find(part) != std::string::npos) return ColourScale::Signed;
  }
  return ColourScale::Even;
}

std::vector<float> taken(const PointCloud::Column& column, std::span<const std::size_t> rows) {
  return std::visit(
      [&](const auto& values) {
        std::vector<float> some(rows.size());
        std::ranges::transform(rows, some.begin(),
                               [&](std::size_t row) { return static_cast<float>(values[row]); });
        return some;
      },
      column.values);
}

// Returns the categories of a column, or none if there are too many for a colour each.
std::map<int, std::string> kinds_in(std::span<const float> values) {
  constexpr std::size_t most = 64;
  std::set<int> found;
  for (const float value : values) {
    if (!std::isfinite(value) || value != std::floor(value) || std::abs(value) > 65535) return {};
    found.insert(static_cast<int>(value));
    if (found.size() > most) return {};
  }
  std::map<int, std::string> kinds;
  for (const int kind : found) kinds[kind] = std::to_string(kind);
  return kinds;
}

// Returns a colour component as a byte: floats range from 0 to 1, 16-bit integers to 65535.
std::uint8_t colour_byte(const PointCloud::Column& column, std::size_t row) {
  return std::visit(
      [&](const auto& values) {
        using T = std::remove_cvref_t<decltype(values[0])>;
        const auto value = static_cast<double>(values[row]);
        const double most = std::is_floating_point_v<T>        ? 1
                            : std::is_same_v<T, std::uint16_t> ? 65535
                                                               : 255;
        return static_cast<std::uint8_t>(std::lround(std::clamp(value / most, 0.0, 1.0) * 255));
      },
      column.values);
}

void add_colour(Layer& layer, LayerColumn::Of of, const PointCloud& table,
                std::span<const std::size_t> rows) {
  std::array<const PointCloud::Column*, 3> channels = {find(table, "red"), find(table, "green"),
                                                       find(table, "blue")};
  if (std::ranges::find(channels, nullptr) != channels.end()) return;
  std::vector<std::uint8_t> rgb(3 * rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) rgb[3 * i + k] = colour_byte(*channels[k], rows[i]);
  }
  if (std::ranges::all_of(rgb, [](std::uint8_t byte) { return byte == 0; })) {
    if (!rgb.empty()) layer.facts.emplace_back("its colours are all black, so they are not shown");
    return;
  }
  add_colours(layer, {.name = "colour", .unit = "", .of = of}, rgb);
}

// Array with the table rows of the points; not listed among the layer's columns.
constexpr const char* rows_name = "groundray: rows of the table";

void keep_rows(Layer& layer, std::span<const std::size_t> rows) {
  const auto array = make_array<vtkTypeInt64Array>(rows_name, rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    array->SetValue(static_cast<vtkIdType>(i), static_cast<vtkTypeInt64>(rows[i]));
  layer.data->GetPointData()->AddArray(array);
}

// Returns the number of finite values that floats cannot represent.
std::size_t beyond_floats(const PointCloud::Column& column) {
  const auto* const values = std::get_if<PointCloud::Values<double>>(&column.values);
  if (values == nullptr) return 0;
  return static_cast<std::size_t>(std::ranges::count_if(*values, [](double value) {
    return std::isfinite(value) && std::abs(value) > std::numeric_limits<float>::max();
  }));
}

// Returns an origin for the points' floats: the centre in whole metres if any coordinate reaches
// 4096 m, else zero, so that floats resolve millimetres.
glm::dvec3 near_origin(std::span<const glm::dvec3> points, std::span<const std::size_t> rows) {
  constexpr double far_m = 4096;
  if (rows.empty()) return glm::dvec3(0);
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const std::size_t row : rows) {
    low = glm::min(low, points[row]);
    high = glm::max(high, points[row]);
  }
  const glm::dvec3 far = glm::max(glm::abs(low), glm::abs(high));
  if (std::max({far.x, far.y, far.z}) < far_m) return glm::dvec3(0);
  return glm::round((low + high) / 2.0);
}

std::vector<std::size_t> rows_kept(const CloudContent& content, std::size_t& broken) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < content.p_m.size(); ++i) {
    const glm::dvec3& p = content.p_m[i];
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) rows.push_back(i);
  }
  broken = content.p_m.size() - rows.size();
  if (content.most_points == 0 || rows.size() <= content.most_points) return rows;
  std::vector<std::size_t> some(content.most_points);
  for (std::size_t i = 0; i < some.size(); ++i)
    some[i] =
        rows[static_cast<std::size_t>(static_cast<double>(i) * static_cast<double>(rows.size()) /
                                      static_cast<double>(some.size()))];
  return some;
}

}  // namespace

std::vector<glm::dvec3> positions_of(const PointCloud& table) {
  const std::array<const PointCloud::Column*, 3> axes = position_columns(table);
  if (std::ranges::find(axes, nullptr) != axes.end()) return {};
  std::vector<glm::dvec3> points(table.rows());
  for (std::size_t k = 0; k < 3; ++k) {
    std::visit(
        [&](const auto& values) {
          for (std::size_t i = 0; i < values.size(); ++i)
            points[i][static_cast<glm::length_t>(k)] = static_cast<double>(values[i]);
        },
        axes[k]->values);
  }
  return points;
}

void add_table(Layer& layer, LayerColumn::Of of, const PointCloud& table,
               std::span<const std::size_t> rows) {
  const auto axes = position_columns(table);
  for (const PointCloud::Column& column : table.columns()) {
    if (std::ranges::find(axes, &column) != axes.end()) continue;
    const std::vector<float> values = taken(column, rows);
    LayerColumn described{.name = column.name,
                          .unit = unit_of(column.name),
                          .of = of,
                          .scale = scale_of(column.name)};
    if (counts_kinds(column.name)) described.categories = kinds_in(values);
    if (const std::size_t count = beyond_floats(column); count > 0)
      layer.facts.push_back(fmt::format("{} values of '{}' are beyond {:.2g}: treated as infinite",
                                        count, column.name, std::numeric_limits<float>::max()));
    add_column(layer, std::move(described), values);
  }
  add_colour(layer, of, table, rows);
}

std::size_t table_row(const Layer& cloud, vtkIdType point) {
  auto* const rows =
      vtkTypeInt64Array::SafeDownCast(cloud.data->GetPointData()->GetAbstractArray(rows_name));
  return static_cast<std::size_t>(rows == nullptr ? point : rows->GetValue(point));
}

Layer cloud_layer(const CloudContent& content, const PointCloud& table) {
  std::size_t broken = 0;
  const std::vector<std::size_t> rows = rows_kept(content, broken);
  Layer layer{.name = content.name, .kind = LayerKind::Cloud, .data = make_points(rows.size())};
  const glm::dvec3 origin = near_origin(content.p_m, rows);
  layer.origin_w_m = content.origin_w_m + origin;
  layer.frame_w_m = content.origin_w_m;
  const auto places = coordinates(*layer.data);
  std::vector<float> height(rows.size()), number(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const glm::dvec3& p = content.p_m[rows[i]];
    for (glm::length_t k = 0; k < 3; ++k)
      places[3 * i + static_cast<std::size_t>(k)] = static_cast<float>(p[k] - origin[k]);
    height[i] = static_cast<float>(p.z + content.origin_w_m.z);
    number[i] = static_cast<float>(rows[i]);
  }
  add_table(layer, LayerColumn::Of::Points, table, rows);
  add_column(layer, {.name = "height", .unit = "m", .scale = ColourScale::Earth}, height);
  if (rows.size() < content.p_m.size()) {
    keep_rows(layer, rows);
    if (layer.find("row") == nullptr) add_column(layer, {.name = "row", .unit = ""}, number);
  }
  layer.coloured_by = layer.find("colour") != nullptr ? "colour" : "height";
  layer.facts.push_back(fmt::format("{} points, {} columns", rows.size(), layer.columns.size()));
  if (broken > 0) layer.facts.push_back(fmt::format("{} rows without a position", broken));
  if (rows.size() + broken < content.p_m.size())
    layer.facts.push_back(fmt::format("thinned from {} points", content.p_m.size() - broken));
  return layer;
}

}  // namespace groundray
