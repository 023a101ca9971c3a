#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

namespace groundray {

/// Subsampled bands of a raster.
struct RasterBands {
  /// Samples of one band.
  struct Band {
    std::string name;  ///< description in the file; "band 2" if there is none
    std::string unit;  ///< unit in the file; may be empty
    /// Value of each sample, row by row, in the file's own unit; NaN for none.
    std::vector<float> values;
  };
  /// Number of columns and rows read: every step-th one of the file, from the first on.
  glm::ivec2 samples{0};
  int step = 1;
  std::vector<Band> bands;
};

/// Reads the bands of a raster, subsampled to every step-th column of every step-th row so that
/// each has at most `most_samples` samples. The file's scale and offset are applied; samples that
/// GDAL's masks hide are NaN.
/// @param most_samples  at least 1.
/// @param most_bands    largest number of bands to read, from the first on; 0 for all.
/// @throws Error that names the file, if it is no raster, holds complex numbers or cannot be read,
///         or if the values would take more than 4 GiB.
RasterBands read_bands(const std::filesystem::path& path, std::size_t most_samples,
                       int most_bands = 0);

/// Properties of a raster file that indicate the kind of its content.
struct RasterKind {
  glm::ivec2 samples{0};
  int bands = 0;
  /// True if there are three bands or more and the first three are bytes: colours.
  bool is_picture = false;
  bool is_geographic = false;  ///< true if positions are angles
};

/// Returns the properties in the header of a raster.
/// @throws Error as load_dem if the file is no raster.
RasterKind inspect_raster(const std::filesystem::path& path);

}  // namespace groundray
