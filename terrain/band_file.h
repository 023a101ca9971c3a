#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

namespace groundray {

/// Some samples of the bands of a raster.
struct RasterBands {
  /// The samples of one band.
  struct Band {
    std::string name;  ///< as its file describes it; of a band without, "band 2"
    std::string unit;  ///< likewise; may be empty
    /// One for each sample, row by row, in the file's own unit; NaN for none.
    std::vector<float> values;
  };
  /// Every step-th column and row of the file, from the first on.
  glm::ivec2 samples{0};
  int step = 1;
  std::vector<Band> bands;
};

/// Reads the bands of a raster, thinned to at most so many samples each: every step-th column of
/// every step-th row. Values are scaled as the file says; holes are what GDAL's masks hide.
/// @throws Error that names the file, if it is no raster, one of complex numbers, or cannot be
///         read.
/// @param most_samples  1 or more.
/// @param most_bands    so many are read, from the first on, if there are more; 0 for all.
/// @throws Error that names the file as well, if the numbers would take more than 4 GiB.
RasterBands read_bands(const std::filesystem::path& path, std::size_t most_samples,
                       int most_bands = 0);

/// What kind of picture or model a raster's file seems to hold.
struct RasterKind {
  glm::ivec2 samples{0};
  int bands = 0;
  bool is_picture = false;     ///< three bytes or more for each sample, that are colours
  bool is_geographic = false;  ///< placed by angles
};

/// Returns what the header of a raster says. @throws Error as load_dem for what is no raster.
RasterKind inspect_raster(const std::filesystem::path& path);

}  // namespace groundray
