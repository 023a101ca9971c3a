#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/ply_header.h"
#include "core/io/text_lines.h"

namespace groundray {

/// Reads the numbers of a PLY file's rows one after the other. Each fits in a double.
class PlyValues {
 public:
  /// @param bytes   all bytes after the header.
  /// @param format  name of the format in the header.
  PlyValues(std::string_view bytes, std::string_view format)
      : bytes_(bytes), is_ascii_(format == "ascii"), is_big_(format == "binary_big_endian") {}

  /// Returns the next number.
  /// @throws Error if there is none, or it is truncated.
  double next(std::size_t type);

  /// Returns the length of the list that follows.
  /// @throws Error naming the element and `row` if the length is invalid, or as next.
  std::size_t next_count(std::size_t type, const std::string& element, std::uint64_t row);

  std::size_t bytes_left() const { return bytes_.size(); }

 private:
  double next_word();

  std::string_view bytes_;
  bool is_ascii_, is_big_;
};

/// Format and elements that a PLY file's header declares.
struct PlyLayout {
  std::string_view format;
  std::vector<PlyElement> elements;
  std::vector<std::string_view> infos;  ///< texts after `obj_info`, one for each line
};

/// Reads a header that parse_ply has accepted, up to the first row.
PlyLayout ply_layout(TextLines& lines);

/// Checks that at least one byte remains for each row of an element.
/// @throws Error if fewer bytes remain than the element has rows.
void check_rows(const PlyElement& element, const PlyValues& values);

}  // namespace groundray
