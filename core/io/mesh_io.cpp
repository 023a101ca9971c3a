#include "core/io/mesh_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/io/file_io.h"
#include "core/io/ply_header.h"

namespace groundray {
namespace {

constexpr std::size_t block_rows = 1 << 13;  // about 200 kB, to stay in the cache

/// Colours of levels 0, 1, ...; used cyclically.
constexpr std::array<std::array<std::uint8_t, 3>, 8> level_colours{{{68, 119, 170},
                                                                    {102, 204, 238},
                                                                    {34, 136, 51},
                                                                    {204, 187, 68},
                                                                    {238, 102, 119},
                                                                    {170, 51, 119},
                                                                    {187, 187, 187},
                                                                    {85, 85, 85}}};

/// Rows of a file, and a function that appends rows [first, last) to a block of it.
struct Table {
  std::size_t rows = 0;
  std::function<void(std::size_t first, std::size_t last, std::string& block)> append;
};

void write_tables(const std::filesystem::path& path, const std::string& header,
                  const std::vector<Table>& tables) {
  std::string block = header;
  std::size_t table = 0, row = 0;
  bool begun = false;
  write_blocks(path, [&]() -> std::string_view {
    if (!std::exchange(begun, true)) return block;
    block.clear();
    while (table < tables.size() && row == tables[table].rows) {
      ++table;
      row = 0;
    }
    if (table < tables.size()) {
      const std::size_t end = std::min(row + block_rows, tables[table].rows);
      tables[table].append(row, end, block);
      row = end;
    }
    return block;
  });
}

template <typename T>
void append_bytes(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Returns a georeference as lines of comment. They are short and ASCII only: some PLY readers
/// limit lines to 255 characters, others reject other characters.
std::vector<std::string> lines_of(const Georeference& georeference) {
  constexpr std::size_t most = 200;
  const glm::dvec3& origin_m = georeference.origin_w_m;
  std::vector<std::string> lines{
      fmt::format("origin_w {} {} {}", origin_m.x, origin_m.y, origin_m.z)};
  const auto printable = [](const std::string& text) {
    std::string out;
    for (const char c : text) {
      if (' ' <= c && c <= '~') {
        out += c;
      } else {
        out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
      }
    }
    return out;
  };
  if (!georeference.crs_name.empty()) lines.push_back("crs " + printable(georeference.crs_name));
  const std::string wkt = printable(georeference.crs_wkt);
  for (std::size_t begin = 0; begin < wkt.size();) {
    std::size_t end = std::min(begin + most, wkt.size());
    // A reader may strip blanks at either end of a line.
    while (end < wkt.size() && end > begin + 1 && (wkt[end - 1] == ' ' || wkt[end] == ' ')) --end;
    lines.push_back("crs_wkt " + wkt.substr(begin, end - begin));
    begin = end;
  }
  return lines;
}

std::string json_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string json_array(const glm::dvec3& p) { return fmt::format("[{},{},{}]", p.x, p.y, p.z); }

/// Returns the JSON for a buffer of the vertices as floats, followed by the indices.
std::string gltf_json(const TriangleMesh& mesh, const Georeference& georeference,
                      std::size_t vertex_bytes, std::size_t index_bytes) {
  glm::vec3 low(mesh.vertices_m.at(0)), high(low);
  for (const glm::dvec3& p : mesh.vertices_m) {
    low = glm::min(low, glm::vec3(p));
    high = glm::max(high, glm::vec3(p));
  }
  std::string json = R"({"asset":{"version":"2.0","generator":"groundray"},"scene":0,)";
  json += fmt::format(
      R"("scenes":[{{"nodes":[0],"extras":{{"origin_w_m":{},"crs_name":{},"crs_wkt":{}}}}}],)",
      json_array(georeference.origin_w_m), json_string(georeference.crs_name),
      json_string(georeference.crs_wkt));
  // Column-major: glTF's x is D's x, its y is D's z, and its z is D's -y.
  json += R"("nodes":[{"mesh":0,"matrix":[1,0,0,0,0,0,-1,0,0,1,0,0,0,0,0,1]}],)";
  json += R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)";
  json += R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.45,0.35,1],)"
          R"("metallicFactor":0,"roughnessFactor":1}}],)";
  json += fmt::format(
      R"("accessors":[{{"bufferView":0,"componentType":5126,"type":"VEC3","count":{},)"
      R"("min":{},"max":{}}},{{"bufferView":1,"componentType":5125,"type":"SCALAR","count":{}}}],)",
      mesh.vertices_m.size(), json_array(low), json_array(high), 3 * mesh.triangles.size());
  json += fmt::format(R"("bufferViews":[{{"buffer":0,"byteLength":{},"target":34962}},)"
                      R"({{"buffer":0,"byteOffset":{},"byteLength":{},"target":34963}}],)",
                      vertex_bytes, vertex_bytes, index_bytes);
  json += fmt::format(R"("buffers":[{{"byteLength":{}}}]}})", vertex_bytes + index_bytes);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  return json;
}

/// Returns all bytes before the content of the binary chunk.
std::string glb_header(const std::filesystem::path& path, const std::string& json,
                       std::size_t binary_bytes) {
  const std::size_t bytes = 12 + 8 + json.size() + 8 + binary_bytes;
  if (bytes > std::numeric_limits<std::uint32_t>::max()) {
    throw Error("{}: {} bytes exceed the limit of a .glb, 2^32 - 1; write .ply", path.string(),
                bytes);
  }
  std::string header = "glTF";
  append_bytes(header, std::uint32_t{2});
  append_bytes(header, static_cast<std::uint32_t>(bytes));
  append_bytes(header, static_cast<std::uint32_t>(json.size()));
  header += "JSON" + json;
  append_bytes(header, static_cast<std::uint32_t>(binary_bytes));
  header.append("BIN\0", 4);
  return header;
}

PlyProperty property(std::string_view type, std::string_view name) {
  return {std::string(name), ply_type_of(type), std::nullopt};
}

/// Adds a property for each column.
/// @throws Error if a column cannot be a property.
void add_column_properties(const PointCloud& columns, PlyElement& element,
                           const std::filesystem::path& path) {
  if (!columns.columns().empty() && columns.rows() != element.rows) {
    throw Error("{}: columns of {} rows do not match the element {}, which has {}", path.string(),
                columns.rows(), element.name, element.rows);
  }
  for (const auto& [name, values] : columns.columns()) {
    const bool is_visible =
        !name.empty() && std::ranges::all_of(name, [](char c) { return '!' <= c && c <= '~'; });
    const bool is_taken =
        std::ranges::find(element.properties, name, &PlyProperty::name) != element.properties.end();
    if (!is_visible || is_taken) {
      throw Error(
          "{}: the element {} cannot have a column {:?}: {}", path.string(), element.name, name,
          is_taken ? "the name is taken" : "names must consist of visible ASCII characters");
    }
    element.properties.push_back({name, values.index(), std::nullopt});
  }
}

/// Appends rows: for each, the output of `append_row` and then the columns' values.
template <typename AppendRow>
void append_rows(const PointCloud& columns, std::size_t first, std::size_t last, std::string& block,
                 const AppendRow& append_row) {
  for (std::size_t i = first; i < last; ++i) {
    append_row(i, block);
    for (const PointCloud::Column& column : columns.columns())
      std::visit([&](const auto& values) { append_bytes(block, values[i]); }, column.values);
  }
}

}  // namespace

void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                const Georeference& georeference) {
  const std::string form = file_ending(path);
  if (form == ".ply") return write_ply(path, mesh, georeference);
  if (form == ".obj") return write_obj(path, mesh, georeference);
  if (form == ".stl") return write_stl(path, mesh, georeference);
  if (form == ".glb") return write_glb(path, mesh, georeference);
  throw Error("{}: the name of a mesh must end in .ply, .obj, .stl or .glb", path.string());
}

void write_ply(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference, const MeshColumns& columns) {
  check_mesh(mesh, path.string(), EmptyMesh::Allow);
  PlyElement vertex{"vertex",
                    mesh.vertices_m.size(),
                    {property("double", "x"), property("double", "y"), property("double", "z")}};
  PlyElement face{"face", mesh.triangles.size(), {property("uint", "vertex_indices")}};
  face.properties[0].count_type = ply_type_of("uchar");
  if (!mesh.levels.empty()) {
    for (const auto* name : {"level", "red", "green", "blue"}) {
      face.properties.push_back(property("uchar", name));
    }
  }
  add_column_properties(columns.vertices, vertex, path);
  add_column_properties(columns.triangles, face, path);
  const auto append_vertices = [&](std::size_t first, std::size_t last, std::string& block) {
    append_rows(columns.vertices, first, last, block,
                [&](std::size_t i, std::string& row) { append_bytes(row, mesh.vertices_m[i]); });
  };
  const auto append_faces = [&](std::size_t first, std::size_t last, std::string& block) {
    append_rows(columns.triangles, first, last, block, [&](std::size_t i, std::string& row) {
      append_bytes(row, std::uint8_t{3});
      append_bytes(row, mesh.triangles[i]);
      if (mesh.levels.empty()) return;
      append_bytes(row, mesh.levels[i]);
      append_bytes(row, level_colours[mesh.levels[i] % level_colours.size()]);
    });
  };
  write_tables(path, ply_header(lines_of(georeference), {vertex, face}),
               {{vertex.rows, append_vertices}, {face.rows, append_faces}});
}

void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference) {
  check_mesh(mesh, path.string(), EmptyMesh::Allow);
  std::string header;
  for (const std::string& line : lines_of(georeference)) header += "# " + line + "\n";
  const auto append_vertices = [&](std::size_t first, std::size_t last, std::string& block) {
    for (std::size_t i = first; i < last; ++i) {
      const glm::dvec3& p = mesh.vertices_m[i];
      fmt::format_to(std::back_inserter(block), "v {} {} {}\n", p.x, p.y, p.z);
    }
  };
  const auto append_faces = [&](std::size_t first, std::size_t last, std::string& block) {
    for (std::size_t i = first; i < last; ++i) {
      const glm::u64vec3 t = glm::u64vec3(mesh.triangles[i]) + std::uint64_t{1};  // counted from 1
      fmt::format_to(std::back_inserter(block), "f {} {} {}\n", t.x, t.y, t.z);
    }
  };
  write_tables(path, header,
               {{mesh.vertices_m.size(), append_vertices}, {mesh.triangles.size(), append_faces}});
}

void write_stl(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference) {
  check_mesh(mesh, path.string(), EmptyMesh::Allow);
  constexpr std::size_t header_bytes = 80;
  std::string header = lines_of(georeference)[0];
  if (header.size() > header_bytes) {
    throw Error("{}: {:?} is longer than the {} characters of an STL's header; round the origin",
                path.string(), header, header_bytes);
  }
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw Error("{}: {} triangles exceed the limit of an .stl, 2^32 - 1; write .ply", path.string(),
                mesh.triangles.size());
  }
  header.resize(header_bytes, ' ');
  append_bytes(header, static_cast<std::uint32_t>(mesh.triangles.size()));
  const auto append_facets = [&](std::size_t first, std::size_t last, std::string& block) {
    for (std::size_t i = first; i < last; ++i) {
      const glm::uvec3& t = mesh.triangles[i];
      const auto& at = mesh.vertices_m;
      const glm::dvec3 area = glm::cross(at[t.y] - at[t.x], at[t.z] - at[t.x]);
      const double length = glm::length(area);
      append_bytes(block, length > 0 ? glm::vec3(area / length) : glm::vec3(0));
      for (int k = 0; k < 3; ++k) append_bytes(block, glm::vec3(at[t[k]]));
      append_bytes(block, std::uint16_t{0});
    }
  };
  write_tables(path, header, {{mesh.triangles.size(), append_facets}});
}

void write_glb(const std::filesystem::path& path, const TriangleMesh& mesh,
               const Georeference& georeference) {
  check_mesh(mesh, path.string(), EmptyMesh::Allow);
  if (mesh.triangles.empty()) {
    throw Error("{}: glTF does not support a mesh without triangles; write .ply", path.string());
  }
  const auto append_vertices = [&](std::size_t first, std::size_t last, std::string& block) {
    for (std::size_t i = first; i < last; ++i) append_bytes(block, glm::vec3(mesh.vertices_m[i]));
  };
  const auto append_indices = [&](std::size_t first, std::size_t last, std::string& block) {
    for (std::size_t i = first; i < last; ++i) append_bytes(block, mesh.triangles[i]);
  };
  const std::size_t vertex_bytes = sizeof(glm::vec3) * mesh.vertices_m.size();
  const std::size_t index_bytes = sizeof(glm::uvec3) * mesh.triangles.size();
  const std::string header = glb_header(
      path, gltf_json(mesh, georeference, vertex_bytes, index_bytes), vertex_bytes + index_bytes);
  write_tables(
      path, header,
      {{mesh.vertices_m.size(), append_vertices}, {mesh.triangles.size(), append_indices}});
}

}  // namespace groundray
