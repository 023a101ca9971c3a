#include "apps/python/terrain_model.h"

#include <cmath>

#include "terrain/dem/layers_io.h"
#include "terrain/terrain_scene.h"

namespace groundray::python {

const Scene& TerrainModel::scene(Tracing tracing) const {
  LateScene& late = tracing == Tracing::Exact ? exact_ : fast_;
  std::call_once(late.once, [&] {
    const GridFrame& frame = dem_.grid.frame();
    const glm::dvec2 middle = (frame.to_D({0, 0}) + frame.to_D(frame.samples - 1)) / 2.0;
    const double low_m = dem_.grid.min_height_m();  // NaN without any height
    late.scene = std::make_unique<const Scene>(Scene{
        .rays = RayTracer({full_resolution_level(dem_.grid)},
                          float_frame_origin({middle, std::isnan(low_m) ? 0 : low_m}), tracing),
        .terrain = {.label = 1}});
  });
  return *late.scene;
}

void write_dem(const Dem& dem, const std::filesystem::path& path) {
  const RasterLayer layer{"elevation", "m", dem.grid.heights_m()};
  write_layers(path, dem.grid.frame(), {dem.origin_w_m, dem.crs_name, dem.crs_wkt}, {&layer, 1});
}

}  // namespace groundray::python
