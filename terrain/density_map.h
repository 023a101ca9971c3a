#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "terrain/area.h"

namespace groundray {

/// How many plants stand on each square metre of the map (of the plane, not of the slope): the same
/// in all of a pixel. Immutable; any number of threads may ask.
class DensityMap {
 public:
  /// The same everywhere. @throws Error if it is negative or not finite.
  explicit DensityMap(double per_m2);

  /// @param size      columns and rows of pixels, each at least 1.
  /// @param corner_m  outer corner of pixel (0, 0) in D.
  /// @param step_m    from one pixel to the next; a component may be negative (rasters run north to
  ///                  south).
  /// @param per_m2    size.x * size.y densities, row by row; NaN means none.
  /// @throws Error if the sizes disagree, a step is zero or not finite, or a density is negative or
  ///         infinite.
  DensityMap(glm::ivec2 size, glm::dvec2 corner_m, glm::dvec2 step_m, std::vector<float> per_m2);

  /// Returns the density at `p` (D); 0 outside the map.
  double per_m2_at(glm::dvec2 p) const noexcept;
  /// Whether nothing grows in all of `area`.
  bool is_empty(const Area& area) const noexcept;
  /// Returns the highest density of the map.
  double max_per_m2() const noexcept { return max_per_m2_; }
  /// Returns the area of the pixels that are not empty; infinite if all of the plane is not.
  double grown_m2() const noexcept { return grown_m2_; }
  /// Where there are pixels.
  const Area& area() const noexcept { return area_; }

 private:
  glm::ivec2 size_{1};
  glm::dvec2 corner_m_{0};
  glm::dvec2 pixels_per_m_{0};
  std::vector<float> per_m2_;  // empty if it is the same everywhere
  double max_per_m2_ = 0;
  double grown_m2_ = std::numeric_limits<double>::infinity();
  Area area_;
};

/// What a density file does not say of itself.
struct DensityOptions {
  double factor_per_m2 = 1;  ///< density for each unit of the stored values, scale and offset done
  std::optional<double> nodata;  ///< a stored value that means "none", besides the declared one
  std::string crs_wkt;           ///< W's, as in Dem; empty: the file lies in W
  glm::dvec3 origin_w_m{0};      ///< D's origin in W, as in Dem
};

/// Loads a raster of one band through GDAL. Its band's scale and offset are honoured, its unit is
/// not. Where it has no value (nodata, NaN, mask, alpha) nothing grows. One in another CRS than W's
/// is warped there, bilinearly; one that names none lies in W.
/// @throws Error that names the file, as load_dem for files that are no such raster or not placed,
///         and for densities that are negative or infinite.
DensityMap load_density_map(const std::filesystem::path& path, const DensityOptions& options);

}  // namespace groundray
