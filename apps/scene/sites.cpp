#include "apps/scene/sites.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <utility>

#include "core/error.h"
#include "core/geometry/line_field.h"
#include "terrain/trail/trails.h"
#include "terrain/water/water_distance.h"

namespace groundray {
namespace {

std::size_t memory_bytes(const TerrainSpec& spec) {
  return std::size_t{spec.detail.memory_mib} << 20;
}

// Returns the lines from which a layer's distances are measured.
std::vector<CoverLine> lines_of(const SiteConditions::BesideTrail& beside,
                                const CoverLimits& limits_m, const Relief& relief) {
  using From = SiteConditions::BesideTrail::From;
  double reach_m = 1;
  for (const double limit_m : {limits_m.low, limits_m.high})
    if (std::isfinite(limit_m)) reach_m = std::max(reach_m, limit_m + limits_m.blend);
  std::vector<CoverLine> lines;
  for (const Trail& trail : relief.trails()->all()) {
    const TrailSpec& spec = trail.spec();
    if (!beside.name.empty() && spec.name != beside.name) continue;
    if (beside.from == From::Ruts && !spec.ruts) continue;
    const double aside_m = beside.from == From::Ruts ? spec.ruts->track_m / 2 : 0;
    const double half_width_m = beside.from == From::Edge ? spec.width_m / 2 : 0;
    lines.push_back(
        {std::make_shared<const LineField>(trail.field().line(), aside_m + half_width_m + reach_m),
         aside_m, half_width_m});
  }
  return lines;
}

// Returns a mask of values from 0 to 1, its first row in the north; NaN counts as 0.
template <typename ValueAt>
Drape mask_with(glm::ivec2 size, glm::dvec2 corner_m, glm::dvec2 size_m, const ValueAt& value_at) {
  ImageF image(size.x, size.y, 1);
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column)
      image.at(column, row)[0] = static_cast<float>(value_at(column, row));
  }
  return {Texture(std::move(image), Wrap::Clamp), corner_m, size_m};
}

double value_of(const Drape& mask, glm::dvec2 p) {
  return mask.covers(p) ? static_cast<double>(mask.image.color(mask.uv_at(p)).r) : 0.0;
}

}  // namespace

Sites::Sites(const TerrainSpec& spec, const Terrain& terrain)
    : spec_(spec), terrain_(terrain), area_(area_of(terrain.frame())) {}

void Sites::shade(std::span<const Crown> crowns) {
  const auto& [cell_m, radius_m] = spec_.canopy;
  const glm::dvec2 origin_w_m(terrain_.header().origin_w_m);
  // Cells are fixed in W, so that a cut DEM has the same.
  const glm::dvec2 low_m = glm::floor((area_.low_m + origin_w_m) / cell_m) * cell_m - origin_w_m;
  canopy_ = canopy_cover(crowns, {low_m, area_.high_m}, cell_m, radius_m, memory_bytes(spec_));
}

const StandingWater& Sites::water(Wetness wetness) {
  if (!water_ || (wetness == Wetness::Compute && water_->wetness.empty())) {
    const auto& [cell_m, most_m] = spec_.water.value();
    water_ = standing_water(sample_ground(terrain_.ground(), cell_m, memory_bytes(spec_)), most_m,
                            wetness);
  }
  return *water_;
}

// Returns a mask of the places where water is within limits.
Drape Sites::mask_of(const SiteConditions::Water& condition) {
  using Quantity = SiteConditions::Water::Quantity;
  constexpr double least_depth_m = 0.02;  // of water from which distances count
  const Quantity quantity = condition.quantity;
  const StandingWater& water =
      this->water(quantity == Quantity::Wetness ? Wetness::Compute : Wetness::Omit);
  const std::vector<float> values = quantity == Quantity::Depth ? water.depth_m
                                    : quantity == Quantity::Wetness
                                        ? water.wetness
                                        : distance_to_water_m(water, least_depth_m);
  const GridFrame& frame = water.frame;
  const glm::ivec2 size = frame.samples;
  const auto columns = static_cast<std::size_t>(size.x);
  const glm::dvec2 cell_m = glm::abs(frame.step_m);
  return mask_with(
      size, frame.to_D({0, size.y - 1}) - cell_m / 2.0, glm::dvec2(size) * cell_m,
      [&](int column, int row) {
        const double value =
            values[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
        return std::isnan(value) ? 0 : condition.limits.share(value);
      });
}

Drape Sites::mask_of_canopy(const CoverLimits& limits) const {
  const Drape& canopy = canopy_.value();
  return mask_with(canopy.image.size(), canopy.corner_m, canopy.size_m, [&](int column, int row) {
    return limits.share(static_cast<double>(canopy.image.texel(0, column, row).r));
  });
}

// Returns the product of masks over the ground, with pixels of the size of the finest of them.
Drape Sites::product(std::span<const Drape> masks) const {
  double cell_m = std::numeric_limits<double>::max();
  for (const Drape& mask : masks) {
    const glm::dvec2 pixel_m = mask.size_m / glm::dvec2(mask.image.size());
    cell_m = std::min({cell_m, pixel_m.x, pixel_m.y});
  }
  const glm::dvec2 count = glm::ceil((area_.high_m - area_.low_m) / cell_m);
  constexpr double bytes_per_pixel = 6;  // with mip levels
  if (count.x * count.y * bytes_per_pixel > static_cast<double>(memory_bytes(spec_))) {
    throw Error(
        "the product of its conditions takes {:g} x {:g} pixels of {:g} m, as fine as the finest; "
        "make cell_m of water or canopy larger, or allow more memory",
        count.x, count.y, cell_m);
  }
  return mask_with(glm::ivec2(count), area_.low_m, count * cell_m, [&](int column, int row) {
    const glm::dvec2 p = area_.low_m + glm::dvec2(column + 0.5, count.y - row - 0.5) * cell_m;
    double share = 1;
    for (const Drape& mask : masks) share *= value_of(mask, p);
    return share;
  });
}

void Sites::limit(const SiteConditions& conditions, CoverLayer& layer, std::optional<Drape> mask) {
  std::vector<Drape> masks;
  if (mask) masks.push_back(*std::move(mask));
  if (conditions.water) masks.push_back(mask_of(*conditions.water));
  if (conditions.canopy) masks.push_back(mask_of_canopy(*conditions.canopy));
  if (masks.size() == 1) layer.mask = std::make_shared<const Drape>(std::move(masks.front()));
  if (masks.size() > 1) layer.mask = std::make_shared<const Drape>(product(masks));
  if (!conditions.trail) return;
  layer.distance_m = conditions.trail->limits_m;
  // Limits beyond the ground are none, and need no field that reaches so far.
  if (layer.distance_m.high > glm::distance(area_.low_m, area_.high_m))
    layer.distance_m.high = std::numeric_limits<double>::infinity();
  layer.lines = lines_of(*conditions.trail, layer.distance_m, *terrain_.relief());
}

ScatterSpec::Suitability Sites::suitability(const SiteConditions& conditions) {
  if (!conditions.trail && !conditions.water && !conditions.canopy) return {};
  CoverLayer layer{.mask = nullptr, .texture = {}};
  limit(conditions, layer);
  return [cover = GroundCover({{.mask = nullptr, .texture = {}}, std::move(layer)}, nullptr, {})](
             glm::dvec2 p_D) {
    return static_cast<double>(cover.shares_at({.p_D = {p_D, 0}}).at(1));
  };
}

}  // namespace groundray
