#include "core/appearance/ground_cover.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "core/appearance/normal_map.h"
#include "core/appearance/texture.h"
#include "core/appearance/tiling.h"
#include "core/elementary.h"
#include "core/error.h"

namespace groundray {
namespace {

constexpr float seen_alpha = 0.5f;  // least alpha at which an orthophoto has data

void check_limits(Violations& broken, std::size_t layer, const char* what,
                  const CoverLimits& limits) {
  broken.unless(limits.low <= limits.high, "layer {}: its {} from {} to {} is an empty interval",
                layer + 1, what, limits.low, limits.high);
  broken.unless(limits.blend >= 0 && std::isfinite(limits.blend),
                "layer {}: the blend of its {} = {} must be finite and >= 0", layer + 1, what,
                limits.blend);
}

bool is_everywhere(const CoverLimits& limits) {
  return std::isinf(limits.low) && limits.low < 0 && std::isinf(limits.high) && limits.high > 0;
}

void check_layers(std::span<const CoverLayer> layers) {
  Violations broken("ground cover");
  broken.unless(!layers.empty() && layers.size() <= GroundCover::most_layers,
                "{} layers; there must be from 1 to {}", layers.size(), GroundCover::most_layers);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const CoverLayer& layer = layers[i];
    check_limits(broken, i, "slope", layer.slope_rad);
    check_limits(broken, i, "height", layer.height_m);
    check_limits(broken, i, "distance from lines", layer.distance_m);
    const double size_m = layer.texture ? layer.texture->size_m : 1;
    broken.unless(size_m > 0 && std::isfinite(size_m),
                  "layer {}: size_m = {} of its texture must be positive and finite", i + 1,
                  size_m);
  }
  broken.unless(
      layers.empty() || (is_everywhere(layers[0].slope_rad) && is_everywhere(layers[0].height_m) &&
                         layers[0].lines.empty() && layers[0].mask == nullptr),
      "layer 1 must have no limits and no mask: it covers what the other layers do not");
  broken.throw_if_any();
}

// One limit's ramp: from 0 to 1 over the blend, 1/2 at the limit; without a blend, 1 at the limit
// itself.
double rise(double inside, double blend) noexcept {
  if (blend == 0) return inside >= 0 ? 1 : 0;
  return std::clamp(inside / blend + 0.5, 0.0, 1.0);
}

// Colour of the orthophoto at a point; nothing where it has no data. Its mean excludes such points.
std::optional<glm::vec3> seen(const Drape& orthophoto, const GroundCover::Point& point,
                              const SurfacePatch& patch, Filtering filtering) noexcept {
  const glm::dvec2 p_D(point.p_D);
  if (!orthophoto.covers(p_D)) return std::nullopt;
  const glm::dvec2 uv = orthophoto.uv_at(p_D);
  if (orthophoto.image.alpha(uv) < seen_alpha) return std::nullopt;
  const Footprint footprint{glm::dvec2(patch.a_m) / orthophoto.size_m,
                            glm::dvec2(patch.b_m) / orthophoto.size_m};
  return orthophoto.image.color(uv, footprint, filtering);
}

// Returns a point of D relative to the corner of a copy.
glm::dvec3 in_copies(const GroundTexture& texture, const glm::dvec3& p_D) noexcept {
  return p_D - glm::dvec3(texture.corner_m, 0);
}

// Shading normal of a triplanar normal map, in D; not normalised.
glm::dvec3 bumped(const GroundTexture& texture, const GroundCover::Point& point,
                  const SurfacePatch& patch, Filtering filtering) noexcept {
  const glm::dvec3& n = point.normal;
  const glm::dvec3 weights = triplanar_weights(n);
  glm::dvec3 sum(0);
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    if (weights[axis] == 0) continue;
    const glm::length_t u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    const auto flat = [&](const glm::dvec3& d_m) {
      return glm::dvec2(d_m[u], d_m[v]) / texture.size_m;
    };
    Tangents along;  // of the surface, per unit of u and of v projected along the axis
    along.dp_du[u] = along.dp_dv[v] = texture.size_m;
    along.dp_du[axis] = -texture.size_m * n[u] / n[axis];
    along.dp_dv[axis] = -texture.size_m * n[v] / n[axis];
    const glm::vec3 texel =
        tiled_color(*texture.normal, flat(in_copies(texture, point.p_D)),
                    {flat(patch.a_m), flat(patch.b_m)}, filtering, texture.tiling);
    sum += weights[axis] * shading_normal(along, n, n, decode_normal(texel));
  }
  return sum;
}

}  // namespace

double CoverLine::distance_m(glm::dvec2 p) const noexcept {
  const auto place = field->place(p);
  return place ? std::abs(std::abs(place->across_m) - aside_m) - half_width_m
               : std::numeric_limits<double>::max();
}

double CoverLimits::share(double value) const noexcept {
  return std::min(rise(value - low, blend), rise(high - value, blend));
}

GroundCover::Point GroundCover::on_facet(const glm::dvec3& p_D, const glm::dvec3& normal) noexcept {
  return {p_D, normal, angle_of_cosine(std::clamp(normal.z, 0.0, 1.0))};
}

GroundCover::GroundCover(std::vector<CoverLayer> layers, std::shared_ptr<const Drape> orthophoto,
                         std::span<const Point> points)
    : layers_(std::move(layers)), orthophoto_(std::move(orthophoto)) {
  check_layers(layers_);
  depends_on_slope_ = !std::ranges::all_of(layers_, is_everywhere,
                                           [](const CoverLayer& layer) { return layer.slope_rad; });
  if (orthophoto_ == nullptr) return;
  std::array<glm::dvec3, most_layers> sums{};
  std::array<double, most_layers> weights{};
  glm::dvec3 all(0);
  double count = 0;
  for (const Point& point : points) {
    const auto color = seen(*orthophoto_, point, {}, Filtering::Fast);
    if (!color) continue;
    const Shares shares = shares_at(point);
    for (std::size_t i = 0; i < layers_.size(); ++i) {
      sums[i] += static_cast<double>(shares[i]) * glm::dvec3(*color);
      weights[i] += shares[i];
    }
    all += glm::dvec3(*color);
    ++count;
  }
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    if (weights[i] > 0)
      means_[i] = glm::vec3(sums[i] / weights[i]);
    else if (count > 0)
      means_[i] = glm::vec3(all / count);
  }
}

GroundCover::Shares GroundCover::shares_at(const Point& point) const noexcept {
  Shares shares{};
  double left = 1;
  for (std::size_t i = layers_.size(); i-- > 1 && left > 0;) {
    const CoverLayer& layer = layers_[i];
    double share = layer.slope_rad.share(point.slope_rad) * layer.height_m.share(point.p_D.z);
    const glm::dvec2 p_D(point.p_D);
    if (share > 0 && !layer.lines.empty()) {
      double nearest_m = std::numeric_limits<double>::max();
      for (const CoverLine& line : layer.lines)
        nearest_m = std::min(nearest_m, line.distance_m(p_D));
      share *= layer.distance_m.share(nearest_m);
    }
    if (share > 0 && layer.mask != nullptr) {
      share *= layer.mask->covers(p_D)
                   ? static_cast<double>(layer.mask->image.color(layer.mask->uv_at(p_D)).r)
                   : 0.0;
    }
    shares[i] = static_cast<float>(left * share);
    left *= 1 - share;
  }
  shares[0] = static_cast<float>(left);
  return shares;
}

Tint GroundCover::tint_at(std::size_t layer, const Point& point, const SurfacePatch& patch,
                          Filtering filtering) const noexcept {
  Tint tint;
  if (const auto& texture = layers_[layer].texture; texture && texture->albedo) {
    const glm::vec3 texel =
        triplanar_color(*texture->albedo, in_copies(*texture, point.p_D), point.normal, patch,
                        texture->size_m, filtering, texture->tiling);
    tint = tint_of(texel, glm::vec3(texture->albedo->mean()));
  }
  if (orthophoto_ == nullptr) return tint;
  const auto color = seen(*orthophoto_, point, patch, filtering);
  return color ? tint * tint_of(*color, means_[layer]) : tint;
}

glm::dvec3 GroundCover::shading_normal_at(const Point& point, const SurfacePatch& patch,
                                          Filtering filtering) const noexcept {
  const Shares shares = shares_at(point);
  glm::dvec3 sum(0);
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    if (shares[i] == 0) continue;
    const auto& texture = layers_[i].texture;
    const bool has_bumps = texture && texture->normal;
    sum += static_cast<double>(shares[i]) *
           (has_bumps ? bumped(*texture, point, patch, filtering) : point.normal);
  }
  return glm::normalize(sum);
}

}  // namespace groundray
