#include "core/model/mesh_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/io/file_io.h"
#include "core/io/json_fault.h"
#include "core/io/mesh_io.h"
#include "core/io/ply_io.h"
#include "core/io/text_lines.h"
#include "core/model/polygon_soup.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct MeshReading {
  PolygonSoup soup;
  Georeference georeference;
};

void check_origin(const glm::dvec3& origin_m) {
  if (std::isfinite(origin_m.x) && std::isfinite(origin_m.y) && std::isfinite(origin_m.z)) return;
  throw Error("origin_w = {} {} {} must be three finite numbers, metres", origin_m.x, origin_m.y,
              origin_m.z);
}

/// Parses a comment as written by write_ply and write_obj; ignores others.
void read_comment(std::string_view comment, Georeference& georeference) {
  const auto words = words_of(comment);
  if (words.empty()) return;
  const auto rest = [&] { return std::string(comment.substr(words[0].size() + 1)); };
  if (words[0] == "origin_w") {
    glm::dvec3 origin_m(std::nan(""));
    for (std::size_t k = 0; k < 3 && words.size() == 4; ++k) {
      if (const auto number = number_of<double>(words[k + 1]))
        origin_m[static_cast<int>(k)] = *number;
    }
    check_origin(origin_m);
    georeference.origin_w_m = origin_m;
  } else if (words[0] == "crs" && words.size() > 1) {
    georeference.crs_name = rest();
  } else if (words[0] == "crs_wkt" && words.size() > 1) {
    georeference.crs_wkt += rest();
  }
}

/// Reads the georeference from the comments of a text up to its first line of content.
Georeference georeference_of(std::string_view text, std::string_view mark,
                             const std::string& name) {
  Georeference georeference;
  TextLines lines(text);
  for (auto line = lines.next(); line && *line != "end_header"; line = lines.next()) {
    if (mark == "# " && !line->empty() && !line->starts_with('#')) break;
    if (!line->starts_with(mark)) continue;
    try {
      read_comment(line->substr(mark.size()), georeference);
    } catch (const Error& fault) {
      throw Error("{}:{}: {}", name, lines.number(), fault.what());
    }
  }
  return georeference;
}

/// Reads the georeference from the first 80 bytes: the header of a binary STL. A text STL has none
/// there.
Georeference stl_georeference(const fs::path& path, std::string_view bytes) {
  std::string_view header = bytes.substr(0, 80);
  header = header.substr(0, header.find('\0'));
  Georeference georeference;
  try {
    if (header.starts_with("origin_w ")) read_comment(header, georeference);
  } catch (const Error& fault) {
    throw Error("{}: the header: {}", path.string(), fault.what());
  }
  return georeference;
}

/// Reads the georeference from the scene's extras. `bytes` must have passed check_gltf.
Georeference gltf_georeference(std::string_view bytes) {
  if (bytes.starts_with("glTF")) {
    std::uint32_t length = 0;
    bytes.copy(reinterpret_cast<char*>(&length), sizeof length, 12);
    bytes = bytes.substr(20, length);
  }
  const json gltf = json::parse(bytes);
  const double number = gltf.value("scene", 0.0);
  Georeference georeference;
  const json scenes = gltf.value("scenes", json::array());
  if (!(number >= 0 && number < static_cast<double>(scenes.size()))) return georeference;
  const json& shown = scenes.at(static_cast<std::size_t>(number));
  if (!shown.contains("extras") || !shown["extras"].is_object()) return georeference;
  const json& extras = shown["extras"];
  georeference.crs_name = extras.value("crs_name", "");
  georeference.crs_wkt = extras.value("crs_wkt", "");
  if (!extras.contains("origin_w_m")) return georeference;
  for (int k = 0; k < 3; ++k)
    georeference.origin_w_m[k] = extras["origin_w_m"].at(static_cast<std::size_t>(k)).get<double>();
  check_origin(georeference.origin_w_m);
  return georeference;
}

/// Reads a glTF mesh in D's axes.
MeshReading read_gltf_mesh(const fs::path& path) {
  const std::string bytes = read_text(path);
  MeshReading reading{.soup = read_gltf(path, bytes)};
  for (glm::dvec3& p : reading.soup.positions) p = {p.x, -p.z, p.y};
  for (glm::vec3& n : reading.soup.normals) n = {n.x, -n.z, n.y};
  try {
    reading.georeference = gltf_georeference(bytes);
  } catch (const json::exception& fault) {
    throw Error("{}: the scene's extras: {}", path.string(), fault_in_words(fault));
  } catch (const Error& fault) {
    throw Error("{}: the scene's extras: {}", path.string(), fault.what());
  }
  return reading;
}

MeshReading read_mesh_file(const fs::path& path) {
  const std::string form = file_ending(path);
  if (form == ".gltf" || form == ".glb") return read_gltf_mesh(path);
  if (form == ".stl") {
    std::string bytes = read_text(path);
    Georeference georeference = stl_georeference(path, bytes);
    return {.soup = read_stl(path, std::move(bytes)), .georeference = std::move(georeference)};
  }
  if (form == ".ply") {
    const std::string bytes = read_text(path);
    return {parse_ply_faces(bytes, path.string()),
            georeference_of(bytes, "comment ", path.string())};
  }
  if (form == ".obj") {
    const std::string text = read_text(path);
    const auto no_material = [](const std::string&) { return std::string(); };
    return {parse_obj(text, path.string(), no_material),
            georeference_of(text, "# ", path.string())};
  }
  throw Error("{}: the name of a mesh must end in .ply, .obj, .stl, .gltf or .glb", path.string());
}

void check_some(const MeshFile& file, const std::string& name) {
  if (!file.mesh.triangles.empty()) return;
  throw Error("{}: there is no triangle{}", name, why_empty(file.dropped, file.skipped));
}

}  // namespace

MeshFile read_mesh(const fs::path& path) {
  MeshReading reading = read_mesh_file(path);
  for (PolygonSoup::Polygon& polygon : reading.soup.polygons) polygon.surface = 0;
  for (PolygonSoup::Corner& corner : reading.soup.corners) corner = {.position = corner.position};
  ModelFaults faults;
  MeshFile file{.mesh = model_of(reading.soup, faults).mesh,
                .georeference = std::move(reading.georeference),
                .dropped = reading.soup.omitted + faults.total(),
                .skipped = reading.soup.skipped,
                .rounding_m = reading.soup.rounding};
  check_some(file, path.string());
  return file;
}

StoredMesh read_stored_mesh(const fs::path& path) {
  return parse_stored_mesh(read_text(path), path.string());
}

StoredMesh parse_stored_mesh(std::string_view bytes, const std::string& name) {
  PolygonSoup soup = parse_ply_faces(bytes, name);
  for (PolygonSoup::Corner& corner : soup.corners) corner = {.position = corner.position};
  ModelFaults faults;
  StoredMesh stored;
  stored.mesh = stored_mesh_of(soup, faults);
  stored.georeference = georeference_of(bytes, "comment ", name);
  stored.dropped = faults.total();
  stored.skipped = soup.skipped;
  stored.vertices = parse_ply(bytes, name).cloud;
  check_some(stored, name);
  check_mesh(stored.mesh, name, EmptyMesh::Refuse);
  return stored;
}

}  // namespace groundray
