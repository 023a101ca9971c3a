#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/io/point_cloud.h"
#include "core/io/text_lines.h"

/// Header and numbers of a PLY file, shared by the code that reads and writes such files.
namespace groundray {

static_assert(std::endian::native == std::endian::little, "rows are written as they lie in memory");

constexpr std::size_t ply_type_count = std::variant_size_v<PointCloud::AnyValues>;

/// Names of each type of PointCloud::AnyValues in a header: the one that is written, then its
/// synonym.
constexpr std::array<std::array<std::string_view, 2>, ply_type_count> ply_type_names{
    {{"float", "float32"},
     {"double", "float64"},
     {"uchar", "uint8"},
     {"ushort", "uint16"},
     {"uint", "uint32"},
     {"char", "int8"},
     {"short", "int16"},
     {"int", "int32"}}};

struct PlyProperty {
  std::string name;
  std::size_t type = 0;                   ///< index in PointCloud::AnyValues
  std::optional<std::size_t> count_type;  ///< type of a list's length; empty for a single number
};

struct PlyElement {
  std::string name;
  std::uint64_t rows = 0;
  std::vector<PlyProperty> properties;
};

/// Returns the index in PointCloud::AnyValues of the type of this name.
/// @throws Error if there is none.
inline std::size_t ply_type_of(std::string_view name) {
  const auto is_named = [name](const auto& names) {
    return std::ranges::find(names, name) != names.end();
  };
  const auto found = std::ranges::find_if(ply_type_names, is_named);
  if (found == ply_type_names.end()) {
    throw Error(
        "{:?} is not a PLY type; use char, uchar, short, ushort, int, uint, float or double", name);
  }
  return static_cast<std::size_t>(found - ply_type_names.begin());
}

/// Returns the header of a binary little-endian file.
inline std::string ply_header(const std::vector<std::string>& comments,
                              const std::vector<PlyElement>& elements) {
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : comments) text += "comment " + comment + "\n";
  for (const PlyElement& element : elements) {
    text += fmt::format("element {} {}\n", element.name, element.rows);
    for (const auto& [name, type, count_type] : element.properties) {
      const std::string list =
          count_type ? fmt::format("list {} ", ply_type_names[*count_type][0]) : "";
      text += fmt::format("property {}{} {}\n", list, ply_type_names[type][0], name);
    }
  }
  return text + "end_header\n";
}

enum class PlyFormat { Ascii, LittleEndian, BigEndian };

struct PlyHeader {
  std::optional<PlyFormat> format;
  std::vector<PlyElement> elements;
  std::vector<std::string> comments, infos;  ///< texts after `comment` and `obj_info`
};

/// Reads a header, up to the first row.
/// @throws Error with the violated rule.
PlyHeader parse_ply_header(TextLines& lines);

/// Reads the numbers of a PLY file's rows one after the other. Each fits in a double.
class PlyValues {
 public:
  /// @param bytes  all bytes after the header.
  PlyValues(std::string_view bytes, PlyFormat format) : bytes_(bytes), format_(format) {}

  /// Returns the next number.
  /// @throws Error if there is none, or it is truncated.
  double next(std::size_t type);

  /// Returns the length of the list that follows.
  /// @throws Error naming the element and `row` if the length is invalid, or as next.
  std::size_t next_count(std::size_t type, const std::string& element, std::uint64_t row);

  /// Checks that at least one byte remains for each row of an element.
  /// @throws Error if fewer bytes remain than the element has rows.
  void check_rows(const PlyElement& element) const;

 private:
  double next_word();

  std::string_view bytes_;
  PlyFormat format_;
};

}  // namespace groundray
