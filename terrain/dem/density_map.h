#pragma once

#include <filesystem>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace groundray {

/// Rectangle in the plane of D. It includes its lower sides but not its upper ones, so that
/// adjacent rectangles share no point. The default is the whole plane.
struct Area {
  glm::dvec2 low_m{-std::numeric_limits<double>::infinity()};
  glm::dvec2 high_m{std::numeric_limits<double>::infinity()};

  bool contains(glm::dvec2 p) const noexcept {
    return low_m.x <= p.x && p.x < high_m.x && low_m.y <= p.y && p.y < high_m.y;
  }
  bool is_empty() const noexcept { return !(low_m.x < high_m.x && low_m.y < high_m.y); }
  /// Returns the intersection; empty if the rectangles do not overlap.
  Area operator&(const Area& other) const noexcept {
    return {glm::max(low_m, other.low_m), glm::min(high_m, other.high_m)};
  }
};

/// Number of plants per square metre of the map (of the plane, not of the slope), constant within a
/// pixel. Immutable; any number of threads may query it.
class DensityMap {
 public:
  /// Constructs a uniform density.
  /// @throws Error if it is negative or not finite.
  explicit DensityMap(double per_m2);

  /// @param size      columns and rows of pixels, each at least 1.
  /// @param corner_m  outer corner of pixel (0, 0) in D.
  /// @param step_m    offset from one pixel to the next; a component may be negative (rasters run
  ///                  north to south).
  /// @param per_m2    size.x * size.y densities, row by row; NaN means no plants.
  /// @throws Error if the sizes disagree, if the corner or a step is not finite, if a step is zero,
  ///         or if a density is negative or infinite.
  DensityMap(glm::ivec2 size, glm::dvec2 corner_m, glm::dvec2 step_m, std::vector<float> per_m2);

  /// Returns the density at `p` (D); 0 outside the map.
  double per_m2_at(glm::dvec2 p) const noexcept;
  /// Returns whether nothing grows anywhere in `area`.
  bool is_empty(const Area& area) const noexcept;
  /// Returns the highest density of the map.
  double max_per_m2() const noexcept { return max_per_m2_; }
  /// Returns the area of the pixels that are not empty, m2; infinite for a uniform density.
  double grown_m2() const noexcept { return grown_m2_; }
  /// Returns the extent of the map; the whole plane for a uniform density.
  const Area& area() const noexcept { return area_; }

 private:
  glm::ivec2 size_{1};
  glm::dvec2 corner_m_{0};
  glm::dvec2 pixels_per_m_{0};
  std::vector<float> per_m2_;  // empty if the density is uniform
  double max_per_m2_ = 0;
  double grown_m2_ = std::numeric_limits<double>::infinity();
  Area area_;
};

/// Options of a density map that its file does not contain.
struct DensityOptions {
  double factor_per_m2 = 1;      ///< density per unit of the stored values, after scale and offset
  std::optional<double> nodata;  ///< stored value for "no value", besides the declared one
  std::string crs_wkt;           ///< CRS of W, as in Dem; empty: the file is in W
  glm::dvec3 origin_w_m{0};      ///< D's origin in W, as in Dem
};

/// Loads a raster of one band through GDAL. The band's scale and offset are applied, its unit is
/// ignored. Nothing grows where there is no value (nodata, NaN, mask, alpha). A raster in another
/// CRS than W's is warped to it, bilinearly; one without a CRS is assumed to be in W.
/// @throws Error that names the file, as load_dem for files that are no such raster or not
///         georeferenced, and for densities that are negative or infinite.
DensityMap load_density_map(const std::filesystem::path& path, const DensityOptions& options);

}  // namespace groundray
