#include "apps/scene/cover.h"

#include <cstddef>
#include <glm/common.hpp>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "apps/scene/cover_images.h"
#include "core/error.h"
#include "terrain/dem/drape_io.h"

namespace groundray {
namespace {

constexpr int points_across = 256;  // side of the lattice for an orthophoto's means

CoverLayer load_layer(const CoverSpec& spec, const TerrainSpec& ground, const Terrain& terrain,
                      Sites& sites, Palette& palette, CoverImages& images) {
  const DemHeader& dem = terrain.header();
  CoverLayer layer{.material = palette.index_of(spec.material),
                   .label = spec.label.value_or(ground.label),
                   .slope_rad = spec.slope_rad,
                   .height_m = spec.height_m,
                   .mask = nullptr,
                   .texture = images.texture(spec.texture)};
  layer.height_m.low -= dem.origin_w_m.z;
  layer.height_m.high -= dem.origin_w_m.z;
  std::optional<Drape> mask;
  if (!spec.mask.empty())
    mask = load_mask(spec.mask, {spec.mask_full, spec.mask_nodata, dem.crs_wkt, dem.origin_w_m});
  sites.limit(spec.site, layer, std::move(mask));
  if (layer.mask != nullptr) images.add(*layer.mask);
  return layer;
}

// Returns a lattice of points on the ground under an orthophoto.
std::vector<GroundCover::Point> points_under(const Drape& orthophoto, const Terrain& terrain) {
  const GridFrame& frame = terrain.frame();
  const glm::dvec2 a = frame.origin_m, b = frame.to_D(frame.samples - 1);
  const glm::dvec2 low = glm::max(orthophoto.corner_m, glm::min(a, b));
  const glm::dvec2 high = glm::min(orthophoto.corner_m + orthophoto.size_m, glm::max(a, b));
  if (!(low.x < high.x && low.y < high.y)) {
    throw Error(
        "it does not overlap the DEM: it covers ({:.1f}, {:.1f}) to ({:.1f}, {:.1f}) m from the "
        "DEM's origin; is its CRS correct?",
        orthophoto.corner_m.x, orthophoto.corner_m.y, orthophoto.corner_m.x + orthophoto.size_m.x,
        orthophoto.corner_m.y + orthophoto.size_m.y);
  }
  std::vector<GroundCover::Point> points;
  for (int row = 0; row < points_across; ++row) {
    for (int column = 0; column < points_across; ++column) {
      const glm::dvec2 p_D =
          glm::mix(low, high, (glm::dvec2(column, row) + 0.5) / static_cast<double>(points_across));
      const auto height_m = terrain.ground().height_m_at(p_D);
      const auto facet = terrain.ground().facet_at(p_D);
      if (height_m && facet)
        points.push_back(GroundCover::on_facet({p_D, *height_m}, frame.normal(*facet)));
    }
  }
  return points;
}

}  // namespace

LoadedCover load_cover(const TerrainSpec& spec, const Terrain& terrain, Sites& sites,
                       Palette& palette) {
  if (!spec.texture && spec.cover.empty() && spec.orthophoto.empty()) return {};
  const DemHeader& dem = terrain.header();
  CoverImages images(spec, terrain);
  std::vector<CoverLayer> layers{{.material = palette.index_of(spec.material),
                                  .label = spec.label,
                                  .mask = nullptr,
                                  .texture = images.texture(spec.texture)}};
  for (std::size_t i = 0; i < spec.cover.size(); ++i) {
    try {
      layers.push_back(load_layer(spec.cover[i], spec, terrain, sites, palette, images));
    } catch (const Error& fault) {
      throw Error("cover, layer {}: {}", i + 1, fault.what());
    }
  }
  std::shared_ptr<const Drape> orthophoto;
  std::vector<GroundCover::Point> points;
  if (!spec.orthophoto.empty()) {
    orthophoto = std::make_shared<const Drape>(
        load_orthophoto(spec.orthophoto, {dem.crs_wkt, dem.origin_w_m}));
    images.add(*orthophoto);
    try {
      points = points_under(*orthophoto, terrain);
    } catch (const Error& fault) {
      throw Error("{}: {}", spec.orthophoto.string(), fault.what());
    }
  }
  return {GroundCover(std::move(layers), std::move(orthophoto), points), images.fingerprint(),
          images.memory_bytes()};
}

}  // namespace groundray
