#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/error.h"
#include "core/io/ply_header.h"
#include "core/io/ply_io.h"
#include "core/io/text_lines.h"
#include "core/model/polygon_soup.h"

namespace groundray {
namespace {

/// Returns the role of a vertex property: 0 to 2 for the position, 3 to 5 for the normal, 6 and 7
/// for uv; -1 for any other.
int role_of(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, int>, 12> roles{{{"x", 0},
                                                                           {"y", 1},
                                                                           {"z", 2},
                                                                           {"nx", 3},
                                                                           {"ny", 4},
                                                                           {"nz", 5},
                                                                           {"s", 6},
                                                                           {"t", 7},
                                                                           {"u", 6},
                                                                           {"v", 7},
                                                                           {"texture_u", 6},
                                                                           {"texture_v", 7}}};
  const auto found = std::ranges::find(roles, name, &std::pair<std::string_view, int>::first);
  return found == roles.end() ? -1 : found->second;
}

void read_vertices(const PlyElement& element, PlyValues& values, PolygonSoup& soup) {
  std::array<double, 9> numbers{};  // the last element takes all other properties
  std::array<bool, 9> there{};
  std::vector<std::size_t> roles;
  for (const PlyProperty& property : element.properties) {
    const int role = role_of(property.name);
    roles.push_back(role < 0 ? 8 : static_cast<std::size_t>(role));
    there[roles.back()] = true;
  }
  if (!there[0] || !there[1] || !there[2]) throw Error("a vertex must have x, y and z");
  for (std::uint64_t row = 0; row < element.rows; ++row) {
    for (std::size_t i = 0; i < roles.size(); ++i) {
      numbers[roles[i]] = values.next(element.properties[i].type);
    }
    const auto& [x, y, z, nx, ny, nz, u, v, other] = numbers;
    soup.positions.emplace_back(x, y, z);
    if (there[3] && there[4] && there[5]) soup.normals.emplace_back(nx, ny, nz);
    if (there[6] && there[7]) soup.uv.emplace_back(u, v);
  }
}

/// Returns a valid index unchanged, and an index out of range for any other value.
std::uint32_t index_of(double value) {
  const bool is_index = value >= 0 && value < PolygonSoup::none && value == std::floor(value);
  return is_index ? static_cast<std::uint32_t>(value) : PolygonSoup::none;
}

void add_face(const std::vector<double>& indices, const std::vector<double>& uv,
              PolygonSoup& soup) {
  if (indices.size() < 3) {
    ++soup.skipped;
    return;
  }
  const bool has_wedges = uv.size() == 2 * indices.size();
  soup.polygons.push_back({soup.corners.size(), indices.size(), 0});
  for (std::size_t k = 0; k < indices.size(); ++k) {
    PolygonSoup::Corner corner{.position = index_of(indices[k])};
    if (!soup.normals.empty()) corner.normal = corner.position;
    if (has_wedges) {
      corner.uv = static_cast<std::uint32_t>(soup.uv.size());
      soup.uv.emplace_back(uv[2 * k], uv[2 * k + 1]);
    } else if (soup.uv.size() == soup.positions.size()) {
      corner.uv = corner.position;
    }
    soup.corners.push_back(corner);
  }
}

/// Reads the rows of the faces, or skips those of another element.
void read_lists(const PlyElement& element, PlyValues& values, PolygonSoup& soup) {
  const bool are_faces = element.name == "face";
  std::vector<double> indices, uv;
  for (std::uint64_t row = 0; row < element.rows; ++row) {
    indices.clear();
    uv.clear();
    for (const auto& [name, type, count_type] : element.properties) {
      const std::size_t count = count_type ? values.next_count(*count_type, element.name, row) : 1;
      const bool are_indices = name == "vertex_indices" || name == "vertex_index";
      for (std::size_t i = 0; i < count; ++i) {
        const double value = values.next(type);
        if (are_indices) indices.push_back(value);
        if (name == "texcoord") uv.push_back(value);
      }
    }
    if (are_faces) add_face(indices, uv, soup);
  }
}

}  // namespace

PolygonSoup parse_ply_faces(std::string_view bytes, const std::string& name) {
  parse_ply(bytes, name);  // rejects what is wrong with the header or the vertices
  TextLines lines(bytes);
  const PlyHeader header = parse_ply_header(lines);
  PolygonSoup soup;
  soup.surfaces.push_back({.looks = {.name = "default"}});
  constexpr std::string_view texture = "TextureFile ";
  for (const std::string& comment : header.comments) {
    if (comment.starts_with(texture)) soup.surfaces[0].albedo = comment.substr(texture.size());
  }
  PlyValues values(lines.rest(), *header.format);
  try {
    for (const PlyElement& element : header.elements) {
      values.check_rows(element);
      if (element.name == "vertex") {
        read_vertices(element, values, soup);
      } else if (element.name == "tristrips" && element.rows > 0) {
        throw Error("triangle strips are not supported: convert them to faces");
      } else {
        read_lists(element, values, soup);
      }
    }
  } catch (const Error& fault) {
    throw Error("{}: {}", name, fault.what());
  }
  return soup;
}

}  // namespace groundray
