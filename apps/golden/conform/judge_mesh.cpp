#include "apps/golden/conform/judge_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <tuple>

#include "core/error.h"
#include "terrain/judge/mesh_deviation.h"
#include "terrain/judge/mesh_topology.h"

namespace groundray::golden {
namespace {

constexpr std::size_t most_listed = 20;

bool is_of_mesher(const ArrayEntry& entry) {
  return entry.pass != "input" && entry.pass != "judge" && !entry.name.starts_with("rays/");
}

using Point = std::array<int, 2>;
using Triangle = std::array<Point, 3>;

// Returns the triangles by their points, each from its first point on, in order.
std::vector<Triangle> sorted_triangles(const TerrainMesh& mesh) {
  std::vector<Triangle> all;
  all.reserve(mesh.triangles.size());
  for (const glm::uvec3& t : mesh.triangles) {
    Triangle triangle;
    for (int k = 0; k < 3; ++k)
      triangle[static_cast<std::size_t>(k)] = {mesh.vertices[t[k]].x, mesh.vertices[t[k]].y};
    std::ranges::rotate(triangle, std::ranges::min_element(triangle));
    all.push_back(triangle);
  }
  std::ranges::sort(all);
  return all;
}

using LeafKey = std::tuple<int, int, int, int>;

std::vector<LeafKey> sorted_leaves(const ArrayFolder& folder, std::uint64_t most) {
  const auto columns = folder.read<std::int32_t>("leaves/column", {any}, most);
  const std::vector<std::uint64_t> shape = {columns.rows()};
  const auto rows = folder.read<std::int32_t>("leaves/row", shape);
  const auto steps = folder.read<std::int32_t>("leaves/step", shape);
  const auto coarser = folder.read<std::uint8_t>("leaves/coarser", shape);
  std::vector<LeafKey> leaves;
  for (std::size_t i = 0; i < columns.rows(); ++i)
    leaves.emplace_back(columns.values[i], rows.values[i], steps.values[i], coarser.values[i]);
  std::ranges::sort(leaves);
  return leaves;
}

// Returns the number of elements that only one of two sorted lists has.
template <typename T>
double count_different(const std::vector<T>& a, const std::vector<T>& b) {
  std::vector<T> different;
  std::ranges::set_symmetric_difference(a, b, std::back_inserter(different));
  return static_cast<double>(different.size());
}

}  // namespace

TerrainMesh read_sample_mesh(const HeightGrid& grid, const ArrayFolder& folder) {
  const std::uint64_t samples = grid.heights_m().size();
  // A mesh of all samples has as many.
  const auto vertices = folder.read<std::int32_t>("mesh/vertices", {any, 2}, samples);
  const auto triangles = folder.read<std::uint32_t>("mesh/triangles", {any, 3}, 2 * samples);
  TerrainMesh mesh;
  for (std::size_t i = 0; i < vertices.rows(); ++i) {
    const glm::ivec2 at(vertices.values[2 * i], vertices.values[2 * i + 1]);
    if (at.x < 0 || at.y < 0 || at.x >= grid.columns() || at.y >= grid.rows()) {
      throw Error("{}: vertex {} is ({}, {}), not a sample of the DEM",
                  (folder.path() / "mesh/vertices.npy").string(), i, at.x, at.y);
    }
    mesh.vertices.push_back(at);
  }
  for (std::size_t i = 0; i < triangles.rows(); ++i) {
    const glm::uvec3 t(triangles.values[3 * i], triangles.values[3 * i + 1],
                       triangles.values[3 * i + 2]);
    if (std::max({t.x, t.y, t.z}) >= mesh.vertices.size()) {
      throw Error("{}: triangle {} has vertex {}, but there are {}",
                  (folder.path() / "mesh/triangles.npy").string(), i, std::max({t.x, t.y, t.z}),
                  mesh.vertices.size());
    }
    mesh.triangles.push_back(t);
  }
  return mesh;
}

Section judge_bytes(const PassFolder& ours, const ArrayFolder& theirs) {
  Section section{.title = "bytes: all arrays of the mesher are equal"};
  Table table{"Arrays that differ", {"array", "pass", "numbers that differ", "first"}, {}};
  double different = 0, compared = 0;
  for (const ArrayEntry& entry : ours.entries) {
    if (!is_of_mesher(entry)) continue;
    // Leaves and meshes of another length differ; other shapes are faults.
    const bool is_list = entry.level < 0;
    std::vector<std::uint64_t> shape = entry.shape;
    if (is_list) shape[0] = any;
    const RawNpy a = ours.arrays.read_raw(entry.name, entry.type, entry.shape);
    const RawNpy b =
        theirs.read_raw(entry.name, entry.type, shape, 2 * ours.grid.heights_m().size());
    ++compared;
    if (a.bytes == b.bytes) continue;
    ++different;
    const std::size_t size = size_of(a.type);
    std::size_t count = 0, first = 0;
    for (std::size_t i = std::min(a.bytes.size(), b.bytes.size()) / size; i-- > 0;) {
      if (a.bytes.compare(i * size, size, b.bytes, i * size, size) == 0) continue;
      ++count;
      first = i;
    }
    if (table.rows.size() >= most_listed) continue;
    table.rows.push_back({entry.name, entry.pass,
                          a.bytes.size() == b.bytes.size()
                              ? fmt::format("{}", count)
                              : fmt::format("{} rows instead of {}", b.shape[0], a.shape[0]),
                          count > 0 ? fmt::format("{}", first) : ""});
  }
  hold(section, "arrays that differ", different, "arrays", 0, "the same passes give equal bytes");
  tell(section, "arrays compared", compared, "arrays");
  if (!table.rows.empty()) section.tables.push_back(std::move(table));
  return section;
}

Section judge_mesh(const PassFolder& ours, const ArrayFolder& theirs) {
  Section section{.title = "mesh: the same leaves and triangles, in any order"};
  const std::uint64_t samples = ours.grid.heights_m().size();
  double below = 0, above = 0, keys = 0;
  for (const ArrayEntry& entry : ours.entries) {
    if (!entry.name.ends_with("/key_m")) continue;
    const auto a = ours.arrays.read<float>(entry.name, entry.shape);
    const auto b = theirs.read<float>(entry.name, entry.shape);
    for (std::size_t i = 0; i < a.values.size(); ++i) {
      const float next = std::nextafter(a.values[i], std::numeric_limits<float>::infinity());
      below += b.values[i] < a.values[i] ? 1 : 0;
      above += b.values[i] > next ? 1 : 0;
    }
    keys += static_cast<double>(a.values.size());
  }
  hold(section, "keys below ours", below, "nodes", 0, "deviations are rounded up");
  hold(section, "keys more than one float above ours", above, "nodes", 0, "of rounding to float");
  tell(section, "keys", keys, "nodes");
  hold(section, "leaves of one alone",
       count_different(sorted_leaves(ours.arrays, samples), sorted_leaves(theirs, samples)),
       "leaves", 0, "the leaves are the same");
  const TerrainMesh own = read_sample_mesh(ours.grid, ours.arrays);
  const TerrainMesh other = read_sample_mesh(ours.grid, theirs);
  hold(section, "triangles of one alone",
       count_different(sorted_triangles(own), sorted_triangles(other)), "triangles", 0,
       "the triangles are the same, with the same winding");
  tell(section, "triangles", static_cast<double>(other.triangles.size()), "triangles");
  return section;
}

Section judge_bound(const PassFolder& ours, const ArrayFolder& theirs) {
  Section section{.title = "bound: a mesh without cracks that keeps the bound"};
  const TerrainMesh mesh = read_sample_mesh(ours.grid, theirs);
  const auto faults = judge::topology_faults(ours.grid, mesh.vertices, mesh.triangles);
  hold(section, "faults of the topology", static_cast<double>(faults.size()), "faults", 0,
       "each facet of the DEM is covered once, without T-junctions, and holes stay open");
  tell(section, "triangles", static_cast<double>(mesh.triangles.size()), "triangles");
  if (!faults.empty()) {
    Table table{"Faults of the topology", {"fault"}, {}};
    for (std::size_t i = 0; i < std::min(faults.size(), most_listed); ++i)
      table.rows.push_back({faults[i]});
    section.tables.push_back(std::move(table));
    fail(section, "largest deviation", 0, "m", "it is not defined for such a mesh");
    return section;
  }
  const MeshBound& bound = ours.bound;
  const auto allowed_m = [&](const glm::dvec3& point) {
    const glm::dvec3 at(glm::dvec2(point) * bound.cell_m, point.z);
    const glm::dvec3 off = glm::max(glm::max(bound.low_m - at, at - bound.high_m), glm::dvec3(0));
    return std::max(bound.tolerance_m, bound.angle_rad * glm::length(off));
  };
  const auto found = judge::largest_deviation(ours.grid, mesh.vertices, mesh.triangles, allowed_m);
  tell(section, "largest deviation", found.largest_m, "m");
  tell(section, "RMS deviation at samples", found.rms_m, "m");
  hold(section, "deviation above the bound", std::max(0.0, found.largest_excess_m), "m", 1e-12,
       "the judge's own rounding");
  hold(section, "triangles over missing facets", static_cast<double>(found.over_missing),
       "triangles", 0, "holes stay open");
  return section;
}

}  // namespace groundray::golden
