#include "sensors/camera/lens/pixel_patch.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace groundray {
namespace {

constexpr PixelRay no_ray;

bool looks_somewhere(const PixelRay& ray) { return ray.direction != glm::dvec3(0); }

}  // namespace

// Second-order Taylor series, whose second derivatives are differences of the neighbours' tangents.
// The third derivatives, from second differences of the tangents, give the truncation error: at a
// corner, where it is largest, (|uuu| + |vvv|) / 48 + (|uuv| + |uvv|) / 16.
PixelPatch::PixelPatch(const Lens& lens, glm::dvec2 pixel, const PixelRay& ray,
                       const PixelRay& left, const PixelRay& right, const PixelRay& above,
                       const PixelRay& below) noexcept
    : lens_(&lens), pixel_(pixel), ray_(ray) {
  if (!looks_somewhere(left) || !looks_somewhere(right) || !looks_somewhere(above) ||
      !looks_somewhere(below))
    return;
  by_uu_ = (right.by_u - left.by_u) / 2.0;
  by_uv_ = (below.by_u - above.by_u) / 2.0;
  by_vv_ = (below.by_v - above.by_v) / 2.0;
  const auto bend = [&](const PixelRay& a, const PixelRay& b, glm::dvec3 PixelRay::*by) {
    return glm::length(a.*by + b.*by - 2.0 * (ray.*by));
  };
  const double left_out =
      (bend(left, right, &PixelRay::by_u) + bend(above, below, &PixelRay::by_v)) / 48 +
      (bend(left, right, &PixelRay::by_v) + bend(above, below, &PixelRay::by_u)) / 16;
  const double area_sr = pixel_sr(ray);
  const double steepest = std::sqrt(glm::dot(ray.by_u, ray.by_u) + glm::dot(ray.by_v, ray.by_v));
  is_smooth_ = left_out * steepest < error_px / 2 * area_sr;  // half, as a margin for higher terms
}

template <typename Real>
Vec3<Real> PixelPatch::by_series(const Vec2<Real>& offset_px) const noexcept {
  const Real x = offset_px.x, y = offset_px.y;
  const Vec3<Real> by_u = Vec3<Real>(ray_.by_u) + Vec3<Real>(by_uu_) * (x / 2.0);
  const Vec3<Real> by_v = Vec3<Real>(ray_.by_v) + Vec3<Real>(by_vv_) * (y / 2.0);
  return unit_of(Vec3<Real>(ray_.direction) + (by_u + Vec3<Real>(by_uv_) * y) * x + by_v * y);
}

std::optional<glm::dvec3> PixelPatch::direction(const glm::dvec2& offset_px) const noexcept {
  if (is_smooth_) return by_series(offset_px);
  const auto ray = lens_->ray(pixel_ + offset_px);
  return ray ? std::optional(ray->direction) : std::nullopt;
}

Vec3<Pack> PixelPatch::directions(const Vec2<Pack>& offset_px) const noexcept {
  if (is_smooth_) return by_series(offset_px);
  Vec3<Pack> all;
  for (std::size_t i = 0; i < pack_size; ++i)
    set_vector(all, i, direction({offset_px.x[i], offset_px.y[i]}).value_or(glm::dvec3(0)));
  return all;
}

void RayRows::fill(int begin, int end) {
  first_ = std::max(begin - 1, 0);
  end_ = std::min(end + 1, lens_.size_px().y);
  const auto rows = static_cast<std::size_t>(end_ - first_);
  rays_.resize(rows * static_cast<std::size_t>(lens_.size_px().x));
  lens_.fill(first_, end_, rays_);
}

const PixelRay& RayRows::ray(int x, int y) const noexcept {
  const int width = lens_.size_px().x;
  if (x < 0 || x >= width || y < first_ || y >= end_) return no_ray;
  return rays_[static_cast<std::size_t>(y - first_) * static_cast<std::size_t>(width) +
               static_cast<std::size_t>(x)];
}

PixelPatch RayRows::patch(glm::ivec2 pixel) const noexcept {
  const auto [x, y] = std::pair(pixel.x, pixel.y);
  return {lens_,         glm::dvec2(pixel), ray(x, y),    ray(x - 1, y),
          ray(x + 1, y), ray(x, y - 1),     ray(x, y + 1)};
}

}  // namespace groundray
