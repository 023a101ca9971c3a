#include "reconstruction/dem/dem_layers.h"

#include <cstddef>
#include <limits>

namespace groundray {

DemLayers unknown_layers(const GridFrame& frame) {
  const std::size_t count =
      static_cast<std::size_t>(frame.samples.x) * static_cast<std::size_t>(frame.samples.y);
  const std::vector<float> none(count, std::numeric_limits<float>::quiet_NaN());
  return {.frame = frame,
          .elevation_m = none,
          .variance_m2 = none,
          .lidar = std::vector<std::uint32_t>(count),
          .stereo = std::vector<std::uint32_t>(count),
          .chi2 = none,
          .surfaces = std::vector<std::uint16_t>(count),
          .overhang_m = none,
          .clearance_m = none,
          .source = std::vector<HeightSource>(count),
          .to_data_m = none,
          .fill_sd_m = none,
          .upper_bound_m = none,
          .slope_rad = none};
}

}  // namespace groundray
