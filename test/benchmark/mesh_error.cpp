// groundray_mesh_error FOLDER NAME...: prints the measures of terrain/judge/mesh_deviation.h,
// one line of JSON each, for meshes that other programs left in FOLDER. A number of metres instead
// of a name selects groundray's own mesh of that tolerance.
//
//   size.txt             columns and rows of samples
//   heights.f32          heights, row by row
//   NAME.vertices.i32    column and row of each vertex
//   NAME.triangles.u32   three vertices of each triangle
#include <fmt/format.h>

#include <cctype>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrain/judge/mesh_deviation.h"
#include "terrain/judge/mesh_topology.h"
#include "terrain/terrain_mesh.h"

namespace groundray::benchmark {
namespace {

template <typename T>
std::vector<T> read(const std::filesystem::path& path) {
  std::vector<T> values(std::filesystem::file_size(path) / sizeof(T));
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(T)));
  if (!file) throw std::runtime_error("cannot read " + path.string());
  return values;
}

HeightGrid read_grid(const std::filesystem::path& folder) {
  glm::ivec2 size;
  std::ifstream(folder / "size.txt") >> size.x >> size.y;
  return {size, {0, 0}, {1, 1}, read<float>(folder / "heights.f32")};
}

TerrainMesh mesh_of(const HeightGrid& grid, const std::filesystem::path& folder,
                    const std::string& name) {
  if (std::isdigit(static_cast<unsigned char>(name.at(0))) != 0) {
    return build_terrain_mesh(grid, {.tolerance_m = std::stod(name)});
  }
  return {read<glm::ivec2>(folder / (name + ".vertices.i32")),
          read<glm::uvec3>(folder / (name + ".triangles.u32")),
          {}};
}

void report(const HeightGrid& grid, const std::string& name, const TerrainMesh& mesh) {
  const auto faults = judge::topology_faults(grid, mesh.vertices, mesh.triangles);
  const auto found = judge::largest_deviation(grid, mesh.vertices, mesh.triangles);
  fmt::print(R"({{"name": "{}", "triangles": {}, "largest_m": {}, "place": [{}, {}], "rms_m": {}, )"
             R"("conforming": {}}})"
             "\n",
             name, mesh.triangles.size(), found.largest_m, found.place.x, found.place.y,
             found.rms_m, faults.empty());
  for (const std::string& fault : faults) fmt::print(stderr, "{}: {}\n", name, fault);
}

}  // namespace
}  // namespace groundray::benchmark

int main(int argc, char** argv) {
  try {
    if (argc < 2) throw std::runtime_error("usage: groundray_mesh_error FOLDER NAME...");
    const groundray::HeightGrid grid = groundray::benchmark::read_grid(argv[1]);
    for (int i = 2; i < argc; ++i) {
      groundray::benchmark::report(grid, argv[i],
                                   groundray::benchmark::mesh_of(grid, argv[1], argv[i]));
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "groundray_mesh_error: {}\n", error.what());
    return 1;
  }
  return 0;
}
