#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec2.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace groundray::golden {

/// Type in which the values of a column were stored; determines their resolution.
enum class Stored { Double, Float, Whole };

/// Named columns of equal length: the echoes of a scan, or the pixels of an image row by row.
struct Columns {
  struct Column {
    std::string name;
    std::vector<double> values;
    Stored stored = Stored::Double;
  };
  std::size_t rows = 0;
  std::vector<Column> all;
  glm::ivec2 size_px{0};  ///< size of an image; 0 for other files

  /// Returns the column with this name, or null.
  const Column* find(std::string_view name) const;
};

/// Reads a file of a dataset: the vertices of a PLY file, the channels of an EXR file or of a PNG
/// (`v0`, `v1`, ..., as stored), the fields of a NumPy array, or the poses of a TUM file (`time`,
/// `x` to `z`, `qx` to `qw`). Dots and dashes in names become underscores.
/// @throws Error if the file is missing, damaged, or of another kind.
Columns read_columns(const std::filesystem::path& file);

/// Evaluates a formula for each row: arithmetic over the names of columns and `pi` with + - * / ^,
/// comparisons, && || and a ? b : c, and the functions sin cos tan asin acos atan atan2 exp ln
/// log10 sqrt cbrt hypot erf abs sign floor rint mod (never negative for a positive divisor) min
/// max; angles are in radians.
/// @throws Error that quotes the formula and states the fault.
std::vector<double> evaluate(const std::string& formula, const Columns& columns);

}  // namespace groundray::golden
