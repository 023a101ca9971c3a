#include "apps/view/rendering/pick.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <tuple>

namespace groundray {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Row with two criteria in order of priority: the lowest is picked.
struct Candidate {
  double first = infinity, second = infinity;
  std::size_t layer = 0, row = 0;
  friend bool operator<(const Candidate& a, const Candidate& b) {
    return std::tie(a.first, a.second, a.layer, a.row) <
           std::tie(b.first, b.second, b.layer, b.row);
  }
};

Candidate least(const Candidate& a, const Candidate& b) { return b < a ? b : a; }

// Two-sided intersection after Moller and Trumbore.
double crossing_m(const std::array<glm::dvec3, 3>& corner, const glm::dvec3& direction) {
  const glm::dvec3 u = corner[1] - corner[0], v = corner[2] - corner[0];
  const glm::dvec3 p = glm::cross(direction, v);
  const double det = glm::dot(u, p);
  if (det == 0) return infinity;
  const double a = -glm::dot(corner[0], p) / det;
  if (a < 0 || a > 1) return infinity;
  const glm::dvec3 q = glm::cross(-corner[0], u);
  const double b = glm::dot(direction, q) / det;
  if (b < 0 || a + b > 1) return infinity;
  const double t_m = glm::dot(v, q) / det;
  return t_m > 0 ? t_m : infinity;
}

// Returns the box of a layer, or null if it is not clipped.
const ClipBox* clip_of(const Layer& layer, const std::optional<ClipBox>& clip) {
  return clip && layer.is_clipped ? &*clip : nullptr;
}

Candidate pick_triangle(const Layer& layer, std::size_t number, const PickRay& ray,
                        const ClipBox* clip) {
  const auto places = coordinates(*layer.data);
  const auto corner = corners(*layer.data);
  const glm::dvec3 offset = layer.origin_w_m - ray.from_w_m;
  const auto try_all = [&](const tbb::blocked_range<std::size_t>& range, Candidate best) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      std::array<glm::dvec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k) p[k] = point_at(places, corner[3 * i + k]) + offset;
      const double t_m = crossing_m(p, ray.direction);
      if (clip != nullptr && t_m < infinity && !clip->contains(ray.from_w_m + t_m * ray.direction))
        continue;
      best = least(best, {t_m, 0, number, i});
    }
    return best;
  };
  return tbb::parallel_reduce(tbb::blocked_range<std::size_t>(0, corner.size() / 3, 4096),
                              Candidate{}, try_all, least);
}

// Returns the distance, m, that a point may lie behind a surface and still count as visible: it may
// be a point on that surface.
double slack_m(double depth_m) { return 0.002 * depth_m + 0.05; }

Candidate pick_point(const Layer& layer, std::size_t number, const PickRay& ray, double near_px,
                     double surface_m, const ClipBox* clip) {
  const auto places = coordinates(*layer.data);
  const glm::dvec3 offset = layer.origin_w_m - ray.from_w_m;
  const double half_px = std::max(layer.point_size_px / 2, 0.5);
  const auto try_all = [&](const tbb::blocked_range<std::size_t>& range, Candidate best) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const glm::dvec3 p = point_at(places, i) + offset;
      const glm::dvec3 seen = ray.to_pixels * p;
      if (!(seen.z > 0)) continue;
      const glm::dvec2 off = glm::abs(glm::dvec2(seen) / seen.z - ray.pixel);
      const bool covers = std::max(off.x, off.y) <= half_px;
      const double off_px = glm::length(off);
      if (!covers && !(off_px <= near_px)) continue;
      const double distance_m = glm::length(p);
      if (distance_m > surface_m + slack_m(surface_m)) continue;
      if (clip != nullptr && !clip->contains(ray.from_w_m + p)) continue;
      best = least(best, {covers ? 0 : off_px, distance_m, number, i});
    }
    return best;
  };
  return tbb::parallel_reduce(tbb::blocked_range<std::size_t>(0, places.size() / 3, 4096),
                              Candidate{}, try_all, least);
}

bool can_be_hit(const Layer& layer) {
  return layer.kind == LayerKind::Terrain || layer.kind == LayerKind::Mesh ||
         layer.kind == LayerKind::Picture;
}

}  // namespace

std::optional<Picked> pick(std::span<const Layer* const> layers, const PickRay& ray, double near_px,
                           const std::optional<ClipBox>& clip) {
  Candidate surface, cloud;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (layers[i]->visible && can_be_hit(*layers[i]))
      surface = least(surface, pick_triangle(*layers[i], i, ray, clip_of(*layers[i], clip)));
  }
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (layers[i]->visible && layers[i]->kind == LayerKind::Cloud)
      cloud = least(
          cloud, pick_point(*layers[i], i, ray, near_px, surface.first, clip_of(*layers[i], clip)));
  }
  if (cloud.first < infinity) {
    const auto row = static_cast<vtkIdType>(cloud.row);
    const Layer& layer = *layers[cloud.layer];
    return Picked{layer.name, LayerColumn::Of::Points, row, layer.p_w_m(row)};
  }
  if (surface.first == infinity) return std::nullopt;
  return Picked{layers[surface.layer]->name, LayerColumn::Of::Cells,
                static_cast<vtkIdType>(surface.row), ray.from_w_m + surface.first * ray.direction};
}

Picked near_vertex(const Layer& layer, const Picked& picked, const PickRay& ray, double near_px) {
  if (picked.of != LayerColumn::Of::Cells) return picked;
  const auto corner = corners(*layer.data);
  Picked nearest = picked;
  double least_px = near_px;
  for (std::size_t k = 0; k < 3; ++k) {
    const vtkIdType row = corner[3 * static_cast<std::size_t>(picked.row) + k];
    const glm::dvec3 p_w_m = layer.p_w_m(row);
    const glm::dvec3 seen = ray.to_pixels * (p_w_m - ray.from_w_m);
    const double off_px = glm::distance(glm::dvec2(seen) / seen.z, ray.pixel);
    if (!(seen.z > 0) || off_px > least_px) continue;
    least_px = off_px;
    nearest = {picked.layer, LayerColumn::Of::Points, row, p_w_m};
  }
  return nearest;
}

}  // namespace groundray
