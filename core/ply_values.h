#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/ply_header.h"
#include "core/text_lines.h"

namespace groundray {

/// Takes one number after the other from the rows of a PLY. Each fits a double.
class PlyValues {
 public:
  /// @param bytes   all that follows the header.
  /// @param format  as the header names it.
  PlyValues(std::string_view bytes, std::string_view format)
      : bytes_(bytes), is_ascii_(format == "ascii"), is_big_(format == "binary_big_endian") {}

  /// Returns the next number. @throws Error if there is none, or it is cut short.
  double next(std::size_t type);

  /// Returns the length of a list that follows. @throws Error naming the element and `row` if it
  /// cannot be one, or as next.
  std::size_t next_count(std::size_t type, const std::string& element, std::uint64_t row);

  std::size_t bytes_left() const { return bytes_.size(); }

 private:
  double next_word();

  std::string_view bytes_;
  bool is_ascii_, is_big_;
};

/// What a PLY says of its rows.
struct PlyLayout {
  std::string_view format;
  std::vector<PlyElement> elements;
  std::vector<std::string_view> infos;  ///< what follows `obj_info`, a line each
};

/// Reads on to the first row, of a header that parse_ply found to be sound.
PlyLayout ply_layout(TextLines& lines);

/// @throws Error if fewer bytes are left than the element has rows.
void check_rows(const PlyElement& element, const PlyValues& values);

}  // namespace groundray
