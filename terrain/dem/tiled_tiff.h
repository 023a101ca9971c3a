#pragma once

// Private to the library: the rasters of a certificate as GeoTIFF files.
#include <cstddef>
#include <filesystem>
#include <glm/vec2.hpp>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "terrain/dem/gdal_raster.h"

namespace groundray {

/// Specification of a tiled raster of floats.
struct TiffSpec {
  glm::ivec2 size{1};
  /// Number of coarser images in the same file, each half as large as the one before, rounded up.
  int overviews = 0;
  std::vector<std::string> bands;
  int tile = 128;            ///< cells along a side of a tile
  glm::dvec2 corner_w_m{0};  ///< outer corner of the first cell, in W
  glm::dvec2 cell_m{1};
  std::string crs_wkt;

  /// Returns the columns and rows of the full image, 0, or of an overview, 1 and up.
  glm::ivec2 image_size(int image) const noexcept { return ((size - 1) >> image) + 1; }
};

/// Writes a file window by window. A tile is written as soon as it is complete, so memory use and
/// the bytes of the file depend on the order of the windows. For one thread.
class TiledTiffWriter {
 public:
  /// @throws Error as write.
  TiledTiffWriter(const std::filesystem::path& path, const TiffSpec& spec);
  ~TiledTiffWriter();
  TiledTiffWriter(const TiledTiffWriter&) = delete;
  TiledTiffWriter& operator=(const TiledTiffWriter&) = delete;

  /// Writes a window of an image.
  /// @param bands  values of each band, row by row without gaps.
  /// @throws Error that names the file if it cannot be written.
  void write(int image, glm::ivec2 first, glm::ivec2 size, std::span<const float* const> bands);

  /// Closes the file; all its cells must have been written.
  /// @throws Error as write.
  void close();

 private:
  struct Pending {
    std::size_t cells = 0;  // number of cells present
    std::vector<float> values;
  };
  void add_to_tile(int image, glm::ivec2 tile, glm::ivec2 first, glm::ivec2 size,
                   std::span<const float* const> bands);
  void write_tile(int image, glm::ivec2 tile, std::vector<float>& values);
  void refuse_faults() const;

  std::filesystem::path path_;
  TiffSpec spec_;
  GDALDatasetUniquePtr dataset_;
  std::map<std::tuple<int, int, int>, Pending> pending_;  // by image, row and column of the tile
};

/// File written by TiledTiffWriter. Any number of threads may read.
class TiledTiff {
 public:
  /// @throws Error that names the file if it cannot be opened or does not match `spec`.
  TiledTiff(const std::filesystem::path& path, const TiffSpec& spec);

  /// Reads a window of an image: the values of each of its bands in turn, row by row.
  /// @throws Error that names the file if they cannot be read, or if the window exceeds the image.
  std::vector<float> read(int image, glm::ivec2 first, glm::ivec2 size) const;

 private:
  std::filesystem::path path_;
  TiffSpec spec_;
  GDALDatasetUniquePtr dataset_;
  mutable std::mutex one_at_a_time_;
};

}  // namespace groundray
