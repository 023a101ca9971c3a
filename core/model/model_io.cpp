#include "core/model/model_io.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/file_io.h"
#include "core/model/polygon_soup.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using SoupSurface = PolygonSoup::Surface;

/// Decodes percent-encoded characters of a URI, such as %41.
std::string without_percents(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned code = 0;
    const char* const digits = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      out += static_cast<char>(code);
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

/// Returns a name with `/` between folders, and without the scheme of local files.
std::string local_name(std::string name) {
  if (name.starts_with("file://")) name.erase(0, 7);
  std::ranges::replace(name, '\\', '/');
  return name;
}

bool leads_out(const fs::path& name) {
  return name.is_absolute() || std::ranges::find(name, fs::path("..")) != name.end();
}

/// Finds a file that the model refers to, in the model's folder or below: first by its path, then
/// by its last component, because files often contain the folders of their author's machine.
/// @throws Error listing the paths that were tried.
fs::path find_beside(const fs::path& model, const std::string& written) {
  std::string tried;
  for (const std::string& name : {local_name(written), local_name(without_percents(written))}) {
    for (const fs::path& relative : {fs::path(name), fs::path(name).filename()}) {
      if (leads_out(relative)) continue;
      const fs::path path = model.parent_path() / relative;
      std::error_code ignored;
      if (fs::is_regular_file(path, ignored)) return path;
      const std::string words = "'" + path.string() + "'";
      if (tried.find(words) == std::string::npos)
        tried += (tried.empty() ? "" : " and no ") + words;
    }
  }
  throw Error("{:?} is missing: there is no {}{}", written, tried,
              leads_out(local_name(written))
                  ? "; only files in the model's folder are read: copy it there"
                  : "");
}

void find_images(const fs::path& model, std::vector<SoupSurface>& surfaces) {
  Violations broken(model.string());
  const auto find = [&](const SoupSurface& surface, const char* what, const std::string& written,
                        ModelImage& image) {
    if (written.empty()) return;
    try {
      image.file = find_beside(model, written);
    } catch (const Error& fault) {
      broken.unless(false, "surface {:?}: its {} {}", surface.looks.name, what, fault.what());
    }
  };
  for (SoupSurface& surface : surfaces) {
    if (surface.opacity == surface.albedo) surface.opacity.clear();  // the albedo's alpha decides
    find(surface, "albedo map", surface.albedo, surface.looks.albedo);
    find(surface, "normal map", surface.normal, surface.looks.normal);
    find(surface, "opacity map", surface.opacity, surface.looks.opacity);
  }
  broken.throw_if_any();
}

struct ModelReading {
  PolygonSoup soup;
  UpAxis up = UpAxis::Z;
};

ModelReading read_obj(const fs::path& path) {
  const auto read_mtl = [&](const std::string& name) { return read_text(find_beside(path, name)); };
  return {.soup = parse_obj(read_text(path), path.string(), read_mtl)};
}

ModelReading read_model_file(const fs::path& path) {
  const std::string ending = file_ending(path);
  if (ending == ".obj") return read_obj(path);
  if (ending == ".ply") return {.soup = parse_ply_faces(read_text(path), path.string())};
  if (ending == ".stl") return {.soup = read_stl(path, read_text(path))};
  if (ending == ".gltf" || ending == ".glb")
    return {.soup = read_gltf(path, read_text(path)), .up = UpAxis::Y};
  if (ending == ".dae") {
    throw Error(
        "{}: Collada is not read; convert it to glTF, for instance by assimp's own tool:\n  assimp "
        "export '{}' '{}'",
        path.string(), path.string(), fs::path(path).replace_extension(".glb").string());
  }
  throw Error("{}: the name of a model must end in .obj, .ply, .stl, .gltf or .glb", path.string());
}

template <typename V>
V turned_up(const V& v, UpAxis up) {
  if (up == UpAxis::X) return {v.y, v.z, v.x};
  if (up == UpAxis::Y) return {v.z, v.x, v.y};
  return v;
}

void turn_and_scale(ModelReading& reading, const ModelOptions& options) {
  const UpAxis up = options.up.value_or(reading.up);
  const double scale = options.metres_per_unit.value_or(1);
  for (glm::dvec3& p : reading.soup.positions) p = scale * turned_up(p, up);
  for (glm::vec3& n : reading.soup.normals) n = turned_up(n, up);
  reading.soup.rounding *= scale;
}

/// Moves the surfaces that triangles use to the model, and renumbers them.
void take_surfaces(const fs::path& path, std::vector<SoupSurface> surfaces, Model& model) {
  std::vector<std::uint16_t> numbers(surfaces.size());
  for (const std::uint16_t surface : model.surface_of) numbers[surface] = 1;
  std::vector<SoupSurface> used;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    if (numbers[i] == 0) continue;
    numbers[i] = static_cast<std::uint16_t>(used.size());
    used.push_back(std::move(surfaces[i]));
  }
  for (std::uint16_t& surface : model.surface_of) surface = numbers[surface];
  find_images(path, used);
  for (SoupSurface& surface : used) model.surfaces.push_back(std::move(surface.looks));
}

void refuse_faults(const fs::path& path, const ModelFile& file) {
  const ModelFaults& faults = file.dropped;
  Violations broken(path.string());
  const auto none = [&](std::size_t count, const char* what) {
    broken.unless(count == 0, "{} {}; repair the model, or allow them to be dropped", count, what);
  };
  none(faults.out_of_range, "polygons refer to a missing vertex or uv");
  none(faults.not_finite, "polygons have a position or uv that is not finite");
  none(faults.degenerate, "polygons or triangles have no area");
  none(faults.entangled, "polygons intersect themselves or are too complex");
  const ModelBounds bounds = bounds_of(file.model.mesh);
  const double size_m = glm::length(bounds.high_m - bounds.low_m);
  broken.unless(
      !(file.rounding_m > std::max(1e-6 * size_m, 1e-6)),
      "positions are stored as floats and rounded by up to {:.2g} m, too much for a size of {:.3g} "
      "m; move the model to its origin, or write it as .obj or .ply with doubles",
      file.rounding_m, size_m);
  broken.throw_if_any();
}

// Returns the model of a soup in O, in metres. The path begins error messages, and images are
// beside it.
ModelFile finished(const fs::path& path, PolygonSoup soup, BrokenParts broken) {
  if (soup.surfaces.size() > std::numeric_limits<std::uint16_t>::max()) {
    throw Error("{}: there are {} surfaces; there must be fewer than 2^16", path.string(),
                soup.surfaces.size());
  }
  ModelFile file{.skipped = soup.skipped, .rounding_m = soup.rounding};
  file.dropped.out_of_range = soup.omitted;
  file.model = model_of(soup, file.dropped);
  if (broken == BrokenParts::Refuse) refuse_faults(path, file);
  if (file.model.mesh.triangles.empty()) {
    throw Error("{}: there is no triangle{}", path.string(),
                why_empty(file.dropped.total(), file.skipped));
  }
  take_surfaces(path, std::move(soup.surfaces), file.model);
  check_model(file.model, path.string());
  return file;
}

}  // namespace

std::string name_beside(const std::string& written) {
  const std::string name = local_name(without_percents(written));
  if (leads_out(name)) {
    throw Error("it refers to {:?}; only files in its own folder are read: copy it there", written);
  }
  return name;
}

ModelFile read_model(const fs::path& path, const ModelOptions& options) {
  const double scale = options.metres_per_unit.value_or(1);
  if (!(scale > 0 && std::isfinite(scale))) {
    throw Error("{}: metres_per_unit = {} must be positive", path.string(), scale);
  }
  ModelReading reading = read_model_file(path);
  turn_and_scale(reading, options);
  return finished(path, std::move(reading.soup), options.broken);
}

Model model_from(const TriangleMesh& mesh, const std::string& name) {
  PolygonSoup soup{.positions = mesh.vertices_m};
  soup.surfaces.push_back({.looks = {.name = "default"}});
  for (const glm::uvec3& triangle : mesh.triangles) {
    soup.polygons.push_back({soup.corners.size(), 3, 0});
    for (int k = 0; k < 3; ++k) soup.corners.push_back({.position = triangle[k]});
  }
  return finished(name, std::move(soup), BrokenParts::Refuse).model;
}

}  // namespace groundray
