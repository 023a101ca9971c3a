#include "reconstruction/mesh/scan/range_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/ply_header.h"
#include "core/io/ply_io.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

constexpr std::uint64_t most_beams = 1'000'000;  // along a side

std::vector<double> coordinates(const PointCloud& cloud, std::string_view name) {
  std::vector<double> out;
  for (const PointCloud::Column& column : cloud.columns()) {
    if (column.name != name) continue;
    std::visit([&](const auto& values) { out.assign(values.begin(), values.end()); },
               column.values);
    return out;
  }
  throw Error("a vertex must have x, y and z");
}

/// Returns the number in a line of obj_info such as `num_cols 512`.
int count_of(const PlyHeader& layout, std::string_view key) {
  for (const std::string& info : layout.infos) {
    const auto words = words_of(info);
    if (words.size() != 2 || words[0] != key) continue;
    const auto count = number_of<std::uint64_t>(words[1]);
    if (!count || *count > most_beams)
      throw Error("obj_info {} = {:?} must be a whole number from 0 to {}", key, words[1],
                  most_beams);
    return static_cast<int>(*count);
  }
  throw Error("there must be a line 'obj_info {} ...': is this a range grid?", key);
}

/// Reads one row of any element and returns the vertex in its list vertex_indices, or `none`.
std::uint32_t read_row(const PlyElement& element, std::uint64_t row, std::size_t vertices,
                       PlyValues& values) {
  std::uint32_t vertex = OrganisedScan::none;
  for (const auto& [name, type, count_type] : element.properties) {
    const std::size_t count = count_type ? values.next_count(*count_type, element.name, row) : 1;
    const bool is_cell = element.name == "range_grid" && count_type && name == "vertex_indices";
    if (is_cell && count > 1)
      throw Error("cell {} refers to {} vertices; it must refer to one or none", row, count);
    for (std::size_t i = 0; i < count; ++i) {
      const double value = values.next(type);
      if (!is_cell) continue;
      if (!(value >= 0 && value < static_cast<double>(vertices)) || value != std::floor(value))
        throw Error("cell {} refers to vertex {}, but there are {} vertices", row, value, vertices);
      vertex = static_cast<std::uint32_t>(value);
    }
  }
  return vertex;
}

void check_grid(const PlyHeader& layout, int rows, int columns) {
  const auto grid = std::ranges::find(layout.elements, "range_grid", &PlyElement::name);
  if (grid == layout.elements.end())
    throw Error("there is no element range_grid: is this a mesh or a cloud?");
  const auto cells = std::ranges::find(grid->properties, "vertex_indices", &PlyProperty::name);
  if (cells == grid->properties.end() || !cells->count_type)
    throw Error("element range_grid must have a list vertex_indices");
  const std::uint64_t named =
      static_cast<std::uint64_t>(rows) * static_cast<std::uint64_t>(columns);
  if (grid->rows != named) {
    throw Error("element range_grid has {} rows, but num_rows x num_cols = {} x {} = {}",
                grid->rows, rows, columns, named);
  }
}

OrganisedScan read_grid(std::string_view bytes, const PointCloud& cloud,
                        const RangeGridBeams& beams) {
  TextLines lines(bytes);
  const PlyHeader layout = parse_ply_header(lines);
  OrganisedScan scan{.rows = count_of(layout, "num_rows"), .columns = count_of(layout, "num_cols")};
  check_grid(layout, scan.rows, scan.columns);
  PlyValues values(lines.rest(), *layout.format);
  for (const PlyElement& element : layout.elements) {
    values.check_rows(element);
    for (std::uint64_t row = 0; row < element.rows; ++row) {
      const std::uint32_t vertex = read_row(element, row, cloud.rows(), values);
      if (element.name == "range_grid") scan.returns.push_back(vertex);
    }
  }
  const auto x = coordinates(cloud, "x"), y = coordinates(cloud, "y"), z = coordinates(cloud, "z");
  const glm::dvec3 nothing(std::numeric_limits<double>::quiet_NaN());
  for (const std::uint32_t vertex : scan.returns) {
    const bool is_there = vertex != OrganisedScan::none;
    scan.points_m.push_back(is_there ? glm::dvec3(x[vertex], y[vertex], z[vertex]) : nothing);
    scan.origins_m.push_back(scan.points_m.back() + beams.back_m);
  }
  scan.sd_m.assign(scan.returns.size(), beams.sd_m);
  check_scan(scan, "the range grid");
  return scan;
}

}  // namespace

OrganisedScan read_range_grid(const std::filesystem::path& path, const RangeGridBeams& beams) {
  return parse_range_grid(read_text(path), path.string(), beams);
}

OrganisedScan parse_range_grid(std::string_view bytes, const std::string& name,
                               const RangeGridBeams& beams) {
  const PointCloud cloud = parse_ply(bytes, name).cloud;
  try {
    return read_grid(bytes, cloud, beams);
  } catch (const Error& fault) {
    throw Error("{}: {}", name, fault.what());
  }
}

}  // namespace groundray
