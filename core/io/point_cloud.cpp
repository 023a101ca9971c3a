#include "core/io/point_cloud.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.h"

namespace groundray {

bool PointCloud::has(std::string_view name) const {
  return std::ranges::find(columns_, name, &Column::name) != columns_.end();
}

void PointCloud::truncate(std::size_t rows) {
  rows_ = std::min(rows_, rows);
  for (Column& column : columns_) {
    std::visit([&](auto& values) { values.resize(rows_); }, column.values);
  }
}

PointCloud::AnyValues& PointCloud::add_values(std::string_view name, AnyValues values) {
  if (has(name)) throw Error("point cloud: the column '{}' already exists", name);
  columns_.push_back({std::string(name), std::move(values)});
  return columns_.back().values;
}

const PointCloud::AnyValues& PointCloud::find(std::string_view name) const {
  const auto column = std::ranges::find(columns_, name, &Column::name);
  if (column == columns_.end()) {
    std::vector<std::string_view> names;
    for (const Column& each : columns_) names.push_back(each.name);
    throw Error("point cloud: there is no column '{}'; its columns are: {}", name,
                fmt::join(names, ", "));
  }
  return column->values;
}

void PointCloud::throw_type_mismatch(std::string_view name) {
  throw Error("point cloud: the column '{}' is not of the requested type", name);
}

}  // namespace groundray
