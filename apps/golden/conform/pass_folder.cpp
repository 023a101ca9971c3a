#include "apps/golden/conform/pass_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <utility>

#include "apps/dataset/file_sum.h"
#include "apps/golden/conform/reference_rays.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/json_fault.h"
#include "terrain/dem/dem_io.h"
#include "terrain/lod/clipmap.h"
#include "terrain/lod/deviation.h"
#include "terrain/terrain_mesh.h"

namespace groundray::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Shape = std::vector<std::uint64_t>;

constexpr std::uint64_t most_list_bytes = 1 << 24;

std::uint64_t extent(int of) { return static_cast<std::uint64_t>(of); }
Shape rows_by_columns(glm::ivec2 size) { return {extent(size.y), extent(size.x)}; }

std::string level_folder(std::size_t level) { return fmt::format("level_{:02}/", level); }

void write_level(ArrayWriter& out, std::size_t number, const NodeLevel& level,
                 const std::vector<std::uint8_t>& states) {
  const auto entry = [&](const char* name, const char* pass, const char* unit) {
    return ArrayEntry{level_folder(number) + name, pass, static_cast<int>(number), unit, {},
                      rows_by_columns(level.size), {}};
  };
  const char* const joining = number == 0 ? "DeviationPass" : "SaturatePass";
  out.write(entry("key_m", joining, "m"), level.key_m);
  out.write(entry("deviation_m", "DeviationPass", "m"), level.deviation_m);
  out.write(entry("full_m", "DeviationPass", "m"), level.full_m);
  out.write(entry("low_m", joining, "m"), level.low_m);
  out.write(entry("high_m", joining, "m"), level.high_m);
  out.write(entry("state", "LeafPass", ""), states);
}

void write_leaves(ArrayWriter& out, const std::vector<Leaf>& leaves) {
  const auto write = [&](const char* name, const char* unit, const auto& value_of) {
    std::vector<decltype(value_of(leaves[0]))> values;
    for (const Leaf& leaf : leaves) values.push_back(value_of(leaf));
    out.write({fmt::format("leaves/{}", name), "ListLeavesPass", -1, unit, {}, {leaves.size()}, {}},
              values);
  };
  write("column", "", [](const Leaf& leaf) { return leaf.column; });
  write("row", "", [](const Leaf& leaf) { return leaf.row; });
  write("step", "", [](const Leaf& leaf) { return leaf.step; });
  write("coarser", "", [](const Leaf& leaf) { return leaf.coarser; });
  write("has_holes", "", [](const Leaf& leaf) { return std::uint8_t{leaf.has_holes}; });
  write("deviation_m", "m", [](const Leaf& leaf) { return leaf.deviation_m; });
  write("high_m", "m", [](const Leaf& leaf) { return leaf.high_m; });
}

template <typename T, int n>
std::span<const T> flat(const std::vector<glm::vec<n, T>>& vectors) {
  return {reinterpret_cast<const T*>(vectors.data()), n * vectors.size()};
}

void write_mesh(ArrayWriter& out, const TerrainMesh& mesh) {
  out.write({"mesh/vertices", "EmitVerticesPass", -1, "", {}, {mesh.vertices.size(), 2}, {}},
            flat(mesh.vertices));
  out.write({"mesh/triangles", "EmitTrianglesPass", -1, "", {}, {mesh.triangles.size(), 3}, {}},
            flat(mesh.triangles));
  out.write({"mesh/level", "EmitTrianglesPass", -1, "", {}, {mesh.triangles.size()}, {}},
            mesh.levels);
}

void write_rays(ArrayWriter& out, const ReferenceRays& rays) {
  std::vector<glm::dvec3> origins_m, directions;
  for (const Ray& ray : rays.rays) {
    origins_m.push_back(ray.origin);
    directions.push_back(ray.direction);
  }
  const std::uint64_t count = rays.rays.size();
  out.write({"rays/origin_m", "input", -1, "m", {}, {count, 3}, {}}, flat(origins_m));
  out.write({"rays/direction", "input", -1, "", {}, {count, 3}, {}}, flat(directions));
  out.write({"rays/range_m", "exact tracing", -1, "m", {}, {count}, {}}, rays.range_m);
  out.write({"rays/triangle", "judge", -1, "", {}, {count}, {}}, rays.triangle);
  out.write({"rays/silhouette_m", "judge", -1, "m", {}, {count}, {}}, rays.silhouette_m);
  out.write({"rays/edge_m", "judge", -1, "m", {}, {count}, {}}, rays.edge_m);
}

Json json_of(const glm::dvec3& v) { return Json::array({v.x, v.y, v.z}); }
Json json_of(const glm::dvec2& v) { return Json::array({v.x, v.y}); }

Json manifest_of(const fs::path& dem_path, const Dem& dem, const PassSettings& settings,
                 const glm::dvec3& viewpoint_m, double silhouette_limit_m,
                 const std::vector<ArrayEntry>& entries) {
  const HeightGrid& grid = dem.grid;
  Json arrays = Json::array();
  for (const ArrayEntry& entry : entries) {
    Json json = {{"name", entry.name}, {"pass", entry.pass}};
    if (entry.level >= 0) json["level"] = entry.level;
    json.update({{"shape", entry.shape}, {"dtype", entry.type}});
    if (!entry.unit.empty()) json["unit"] = entry.unit;
    json["sha256"] = entry.sha256;
    arrays.push_back(std::move(json));
  }
  return {{"groundray_passes", 1},
          {"version", GROUNDRAY_VERSION},
          {"commit", settings.commit},
          {"dem",
           {{"file", dem_path.filename().string()},
            {"sha256", sum_file(dem_path).sha256},
            {"columns", grid.columns()},
            {"rows", grid.rows()},
            {"origin_m", json_of(grid.origin_m())},
            {"step_m", json_of(grid.step_m())},
            {"origin_w_m", json_of(dem.origin_w_m)}}},
          {"settings",
           {{"tolerance_m", settings.tolerance_m},
            {"angle_rad", settings.angle_rad},
            {"viewpoint_m", json_of(viewpoint_m)},
            {"block_cells", settings.block_cells},
            {"rays", settings.rays},
            {"seed", settings.seed.value}}},
          {"silhouette_limit_m", silhouette_limit_m},
          {"arrays", std::move(arrays)}};
}

void check(const PassSettings& settings, const fs::path& out) {
  const int cells = settings.block_cells;
  if (cells < 2 || cells > Lattice::max_block_cells || !std::has_single_bit(unsigned(cells)))
    throw Error("block_cells = {} must be a power of two from 2 to 64", cells);
  if (settings.rays == 0) throw Error("rays = 0: at least one ray is needed");
  if (fs::exists(out) && (!fs::is_directory(out) || !fs::is_empty(out)))
    throw Error("{}: it exists and is not an empty folder; choose another one", out.string());
}

}  // namespace

void write_pass_folder(const fs::path& dem_path, const PassSettings& settings,
                       const fs::path& out) {
  check(settings, out);
  const Dem dem = load_dem(dem_path);
  const HeightGrid& grid = dem.grid;
  if (grid.hole_count() == grid.heights_m().size())
    throw Error("{}: it has no heights", dem_path.string());
  const glm::dvec2 middle_m =
      grid.origin_m() + 0.5 * glm::dvec2(grid.columns() - 1, grid.rows() - 1) * grid.step_m();
  const glm::dvec3 viewpoint_m = settings.viewpoint_m.value_or(
      glm::dvec3(middle_m, grid.height_m_at(middle_m).value_or(grid.max_height_m()) + 2));
  const MeshBound bound = bound_from({viewpoint_m, viewpoint_m}, grid.frame(), settings.tolerance_m,
                                     settings.angle_rad);
  const Lattice lattice{{grid.columns(), grid.rows()}, settings.block_cells};
  const auto levels = certify(grid, settings.block_cells, NodeDetail::Full);
  std::vector<NodeWindow> windows;
  for (const NodeLevel& level : levels) windows.push_back(whole_window(level));
  const Selection selection = select_nodes(lattice, windows, bound);
  const auto leaves = list_leaves(selection, windows, 0);
  const TerrainMesh mesh = build_terrain_mesh(grid, bound, settings.block_cells);
  if (mesh.triangles.empty())
    throw Error("{}: no three heights of any cell form a triangle", dem_path.string());
  const ReferenceRays rays = trace_reference_rays(grid, leaves, settings.block_cells, mesh,
                                                  sample_rays(grid, settings.rays, settings.seed));

  // The manifest comes last: a folder without it is not complete.
  ArrayWriter writer(out);
  writer.write({"heights_m", "input", -1, "m", {}, rows_by_columns(lattice.samples), {}},
               grid.heights_m());
  for (std::size_t i = 0; i < levels.size(); ++i)
    write_level(writer, i, levels[i], selection.levels[i].state);
  write_leaves(writer, leaves);
  write_mesh(writer, mesh);
  write_rays(writer, rays);
  const Json manifest =
      manifest_of(dem_path, dem, settings, viewpoint_m, rays.limit_m, writer.entries());
  write_text(out / "manifest.json", manifest.dump(2) + "\n");
}

namespace {

glm::dvec2 pair_of(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>()};
}

int whole_number(const Json& json, const char* key, int least, int most) {
  const Json& value = json.at(key);
  if (!value.is_number_integer() || value < least || value > most)
    throw Error("{} must be a whole number from {} to {}", key, least, most);
  return value.get<int>();
}

double tolerance(const Json& json, const char* key) {
  const double value = json.at(key).get<double>();
  if (!(value >= 0) || !std::isfinite(value))
    throw Error("{} = {} must be finite and not negative", key, value);
  return value;
}

// Returns the names of the arrays that a folder must have.
std::vector<std::string> required_names(const Lattice& lattice) {
  std::vector<std::string> names = {"heights_m"};
  const auto add = [&](const std::string& folder, std::initializer_list<const char*> all) {
    for (const char* name : all) names.push_back(folder + name);
  };
  for (int level = 0; level <= lattice.top_level(); ++level) {
    add(level_folder(static_cast<std::size_t>(level)),
        {"key_m", "deviation_m", "full_m", "low_m", "high_m", "state"});
  }
  add("leaves/", {"column", "row", "step", "coarser", "has_holes", "deviation_m", "high_m"});
  add("mesh/", {"vertices", "triangles", "level"});
  add("rays/", {"origin_m", "direction", "range_m", "triangle", "silhouette_m", "edge_m"});
  return names;
}

std::vector<ArrayEntry> read_entries(const Json& list, const Lattice& lattice,
                                     const ArrayFolder& arrays) {
  std::vector<ArrayEntry> entries;
  for (const Json& entry : list) {
    entries.push_back({entry.at("name").get<std::string>(), entry.at("pass").get<std::string>(),
                       entry.value("level", -1), entry.value("unit", std::string()),
                       entry.at("dtype").get<std::string>(), entry.at("shape").get<Shape>(),
                       entry.at("sha256").get<std::string>()});
  }
  for (const std::string& name : required_names(lattice)) {
    const auto found = std::ranges::find(entries, name, &ArrayEntry::name);
    if (found == entries.end()) throw Error("arrays: {} is missing", name);
    if (found->shape.empty() || found->shape[0] == 0)
      throw Error("arrays: {} must have at least one row", name);
    const RawNpy raw = arrays.read_raw(name, found->type, found->shape, 0, name == "heights_m");
    if (sha256_of(raw.bytes) != found->sha256)
      throw Error("arrays: {} has changed since it was written: its SHA-256 differs", name);
  }
  return entries;
}

}  // namespace

PassFolder read_pass_folder(const fs::path& folder) {
  const ArrayFolder arrays(folder);
  const fs::path path = arrays.file("manifest.json");
  try {
    if (fs::file_size(path) > most_list_bytes)
      throw Error("it is larger than {} bytes", most_list_bytes);
    const Json json = Json::parse(read_text(path));
    if (json.at("groundray_passes") != 1) throw Error("groundray_passes must be 1");
    const Json &dem = json.at("dem"), &settings = json.at("settings");
    const glm::ivec2 size(whole_number(dem, "columns", 2, 1 << 30),
                          whole_number(dem, "rows", 2, 1 << 30));
    const Lattice lattice{size, whole_number(settings, "block_cells", 2, Lattice::max_block_cells)};
    auto entries = read_entries(json.at("arrays"), lattice, arrays);
    const HeightGrid grid(size, pair_of(dem.at("origin_m")), pair_of(dem.at("step_m")),
                          arrays.read<float>("heights_m", rows_by_columns(size), 0, true).values);
    const Json& at = settings.at("viewpoint_m");
    const glm::dvec3 viewpoint_m(pair_of(at), at.at(2).get<double>());
    return {arrays, grid,
            bound_from({viewpoint_m, viewpoint_m}, grid.frame(), tolerance(settings, "tolerance_m"),
                       tolerance(settings, "angle_rad")),
            tolerance(json, "silhouette_limit_m"), std::move(entries)};
  } catch (const nlohmann::json::exception& fault) {
    throw Error("{}: {} (is it a folder that groundray-golden passes has written?)", path.string(),
                fault_in_words(fault));
  } catch (const Error& rule) {
    throw Error("{}: {}", path.string(), rule.what());
  }
}

}  // namespace groundray::golden
