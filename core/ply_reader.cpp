#include "core/ply_reader.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/ply_header.h"
#include "core/ply_io.h"
#include "core/text_lines.h"

namespace groundray {
namespace {

/// Takes one number after the other from the rows of a PLY. Each fits a double.
class PlyValues {
 public:
  PlyValues(std::string_view bytes, std::string_view format)
      : bytes_(bytes), is_ascii_(format == "ascii"), is_big_(format == "binary_big_endian") {}

  double next(std::size_t type) {
    if (is_ascii_) return next_word();
    return next_binary(type, std::make_index_sequence<ply_type_count>());
  }

  std::size_t bytes_left() const { return bytes_.size(); }

 private:
  double next_word() {
    constexpr std::string_view blanks = " \t\r\n";
    bytes_.remove_prefix(std::min(bytes_.find_first_not_of(blanks), bytes_.size()));
    const std::string_view word = bytes_.substr(0, bytes_.find_first_of(blanks));
    if (word.size() == bytes_.size()) throw Error("the last line lacks its end: is it cut short?");
    bytes_.remove_prefix(word.size());
    const auto value = number_of<double>(word);
    if (!value) throw Error("{:?} is no number", word.substr(0, 40));
    return *value;
  }

  template <std::size_t... I>
  double next_binary(std::size_t type, std::index_sequence<I...> /*all types*/) {
    double value = 0;
    ((type == I ? void(value = take<std::variant_alternative_t<I, PointCloud::AnyValues>>())
                : void()),
     ...);
    return value;
  }

  template <typename Values>
  double take() {
    using T = typename Values::value_type;
    std::array<char, sizeof(T)> raw;
    if (bytes_.size() < raw.size()) throw Error("the last row lacks its end: is it cut short?");
    bytes_.copy(raw.data(), raw.size());
    bytes_.remove_prefix(raw.size());
    if (is_big_) std::ranges::reverse(raw);
    return static_cast<double>(std::bit_cast<T>(raw));
  }

  std::string_view bytes_;
  bool is_ascii_, is_big_;
};

struct Header {
  std::string_view format;
  std::vector<PlyElement> elements;
};

/// Of a header that parse_ply found to be sound.
Header header_of(TextLines& lines) {
  Header header;
  for (auto line = lines.next(); line && *line != "end_header"; line = lines.next()) {
    const auto words = words_of(*line);
    if (words.empty()) continue;
    if (words[0] == "format") header.format = words.at(1);
    if (words[0] == "element") {
      header.elements.push_back(
          {std::string(words.at(1)), *number_of<std::uint64_t>(words.at(2)), {}});
    }
    if (words[0] == "property") {
      PlyProperty property{std::string(words.back()), ply_type_of(words[words.size() - 2]), {}};
      if (words.at(1) == "list") property.count_type = ply_type_of(words.at(2));
      header.elements.back().properties.push_back(property);
    }
  }
  return header;
}

/// Which number of a vertex a property is: 0 to 2 of its position, 3 to 5 of its normal, 6 and 7
/// its uv; or -1.
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
  std::array<double, 9> numbers{};  // the last of all other properties
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

/// Returns an index as it is, or one that is beyond all.
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

/// Reads rows of faces, or of what is to be passed over.
void read_lists(const PlyElement& element, PlyValues& values, PolygonSoup& soup) {
  const bool are_faces = element.name == "face";
  std::vector<double> indices, uv;
  for (std::uint64_t row = 0; row < element.rows; ++row) {
    indices.clear();
    uv.clear();
    for (const auto& [name, type, count_type] : element.properties) {
      const double count = count_type ? values.next(*count_type) : 1;
      if (!(count >= 0 && count <= static_cast<double>(values.bytes_left()))) {
        throw Error("row {} of element {} has a list of {} numbers", row, element.name, count);
      }
      const bool are_indices = name == "vertex_indices" || name == "vertex_index";
      for (double i = 0; i < count; ++i) {
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
  const std::vector<std::string> comments = parse_ply(bytes, name).comments;
  PolygonSoup soup;
  soup.surfaces.push_back({.looks = {.name = "default"}});
  constexpr std::string_view texture = "TextureFile ";
  for (const std::string& comment : comments) {
    if (comment.starts_with(texture)) soup.surfaces[0].albedo = comment.substr(texture.size());
  }
  TextLines lines(bytes);
  const Header header = header_of(lines);
  PlyValues values(lines.rest(), header.format);
  try {
    for (const PlyElement& element : header.elements) {
      if (element.rows > values.bytes_left()) {
        throw Error("there cannot be {} rows of element {} in {} bytes: is it cut short?",
                    element.rows, element.name, values.bytes_left());
      }
      if (element.name == "vertex") {
        read_vertices(element, values, soup);
      } else if (element.name == "tristrips" && element.rows > 0) {
        throw Error("strips of triangles are not read: convert them to faces");
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
