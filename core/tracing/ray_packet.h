#pragma once

// A packet of rays that is traced through the levels of a terrain, and computations on all its
// lanes at once.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/tracing/float_hit.h"
#include "core/tracing/level_surface.h"

namespace groundray {

// A packet of rays, with one array over the lanes for each number, so that the loops below are
// vectorised. Lanes beyond the last ray repeat it and are not valid.
template <int W>
struct Packet {
  using Doubles = std::array<double, W>;

  alignas(64) PacketOf<W> floats;
  alignas(64) std::array<int, W> valid;
  alignas(64) Doubles x_m, y_m, z_m, dx, dy, dz, far_m;  // the rays as given, in D
  Doubles u0, v0, du, dv;                                // in grid coordinates
  Doubles begin_m;                                       // hits before it are ignored
  Doubles inner_m;  // range at which they leave the window of the previous level
  Doubles enter_m, leave_m;
  Doubles column, row, side;  // facet of the hit; side is 1 for the near half, -1 for the far half
  Doubles per_step;           // 1 / width of its cell
  Doubles apex_m, east_m, south_m;         // heights of the facet's corners
  Doubles height_m, u_slope_m, v_slope_m;  // plane of the facet
  Doubles range_m, inside;
  std::array<float, W> deviation_m;
  std::array<std::uint32_t, W> level;
  std::array<LevelRay, W> exact_rays;  // exact tracing only
  std::array<Crossing, W> crossings;
  std::array<GroundFacet, W> facets;  // of the hits

  GridRay grid_ray(int lane) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    return {u0[i], v0[i], z_m[i], du[i], dv[i], dz[i]};
  }
  // Returns a ray for decisions in double.
  FacetRay facet_ray(int lane, const GroundExtent& ground) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    return {grid_ray(lane), ground, begin_m[i], far_m[i]};
  }
  LevelRay level_ray(int lane, const GroundExtent& ground) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    return {facet_ray(lane, ground),
            enter_m[i],
            leave_m[i],
            {floats.ray.org_x[i], floats.ray.org_y[i], floats.ray.org_z[i]},
            {floats.ray.dir_x[i], floats.ray.dir_y[i], floats.ray.dir_z[i]},
            far_float(leave_m[i] - enter_m[i], 0)};
  }
  FloatHit hit(int lane) const noexcept {
    return {floats.hit.geomID[lane], floats.hit.primID[lane], floats.hit.instID[0][lane],
            floats.hit.u[lane],      floats.hit.v[lane],      floats.ray.tfar[lane]};
  }
  void take(int lane, const LevelScene::Impl& at, const Facet& facet) noexcept {
    const auto i = static_cast<std::size_t>(lane);
    const int step = 1 << facet.step_exponent;
    const int apex = facet.half == Half::Near ? 0 : step;
    column[i] = facet.column;
    row[i] = facet.row;
    side[i] = facet.half == Half::Near ? 1 : -1;
    per_step[i] = 1.0 / step;
    apex_m[i] = at.height_m(facet.column + apex, facet.row + apex);
    east_m[i] = at.height_m(facet.column + step, facet.row);
    south_m[i] = at.height_m(facet.column, facet.row + step);
    deviation_m[i] = facet.deviation_m;
  }
  void take(int lane, const Crossing& crossing) noexcept {
    const auto i = static_cast<std::size_t>(lane);
    range_m[i] = crossing.range_m;
    u_slope_m[i] = crossing.plane.u_slope_m;
    v_slope_m[i] = crossing.plane.v_slope_m;
    deviation_m[i] = crossing.deviation_m;
    level[i] = crossing.facet.level;
  }
  // Repeats Cell::plane operation by operation: ranges must not depend on which function computes
  // them.
  void find_planes() noexcept {
    for (std::size_t i = 0; i < W; ++i) {
      const bool near_half = side[i] > 0;
      const double u_m = (near_half ? east_m[i] - apex_m[i] : apex_m[i] - south_m[i]) * per_step[i];
      const double v_m = (near_half ? south_m[i] - apex_m[i] : apex_m[i] - east_m[i]) * per_step[i];
      const double corner_m = near_half ? apex_m[i] : east_m[i] + south_m[i] - apex_m[i];
      u_slope_m[i] = u_m;
      v_slope_m[i] = v_m;
      height_m[i] = corner_m - (u_m * column[i] + v_m * row[i]);
    }
  }
};

// Loads rays into a packet.
template <int W>
void take_rays(const GridFrame& frame, std::span<const Ray> rays, Packet<W>& packet) noexcept {
  for (std::size_t i = 0; i < W; ++i) {
    const Ray& ray = rays[std::min(i, rays.size() - 1)];
    packet.x_m[i] = ray.origin.x;
    packet.y_m[i] = ray.origin.y;
    packet.z_m[i] = ray.origin.z;
    packet.dx[i] = ray.direction.x;
    packet.dy[i] = ray.direction.y;
    packet.dz[i] = ray.direction.z;
    packet.far_m[i] = ray.far_m;
  }
  for (std::size_t i = 0; i < W; ++i) {
    packet.u0[i] = (packet.x_m[i] - frame.origin_m.x) * frame.cells_per_m.x;
    packet.v0[i] = (packet.y_m[i] - frame.origin_m.y) * frame.cells_per_m.y;
    packet.du[i] = packet.dx[i] * frame.cells_per_m.x;
    packet.dv[i] = packet.dy[i] * frame.cells_per_m.y;
    packet.begin_m[i] = packet.inner_m[i] = 0;
  }
}

// Computes the interval from enter_m to leave_m of each ray inside the target's box. A level begins
// where the window of the next finer level ends, since rays start over that window.
template <int W>
void enter_box(const Target& target, Packet<W>& packet) noexcept {
  constexpr double rim = 1e-6;  // cells, so that rays along the boundary are inside
  const glm::dvec2 low = glm::dvec2(target.level->level.first) - rim;
  const glm::dvec2 high = glm::dvec2(target.level->last) + rim;
  const double bottom_m = target.min_m - target.slack_m;
  const double top_m = target.max_m + target.slack_m;
  for (std::size_t i = 0; i < W; ++i) {
    const double z_m = packet.z_m[i];
    const double iu = 1 / packet.du[i];
    const double iv = 1 / packet.dv[i];
    const double iz = 1 / packet.dz[i];
    const double ua = (low.x - packet.u0[i]) * iu, ub = (high.x - packet.u0[i]) * iu;
    const double va = (low.y - packet.v0[i]) * iv, vb = (high.y - packet.v0[i]) * iv;
    const double za = (bottom_m - z_m) * iz, zb = (top_m - z_m) * iz;
    const double window_end_m = std::min(std::max(ua, ub), std::max(va, vb));
    packet.enter_m[i] = std::max(std::max(std::min(ua, ub), std::min(va, vb)),
                                 std::max(std::min(za, zb), packet.inner_m[i]));
    packet.leave_m[i] = std::min(window_end_m, std::min(std::max(za, zb), packet.far_m[i]));
    // Both levels contain the seam between them, with an overlap that slightly exceeds rounding.
    packet.inner_m[i] = std::max(0.0, window_end_m - target.slack_m);
  }
}

// Fills Embree's packet: rays in L that start where they enter the box.
template <int W>
void fill_floats(const Target& target, Packet<W>& packet) noexcept {
  auto& out = packet.floats.ray;
  const glm::dvec3 p_DL = target.level->p_DL;
  for (std::size_t i = 0; i < W; ++i) {
    const double begin_m = packet.enter_m[i];
    out.org_x[i] = static_cast<float>(packet.x_m[i] + packet.dx[i] * begin_m - p_DL.x);
    out.org_y[i] = static_cast<float>(packet.y_m[i] + packet.dy[i] * begin_m - p_DL.y);
    out.org_z[i] = static_cast<float>(packet.z_m[i] + packet.dz[i] * begin_m - p_DL.z);
    out.dir_x[i] = direction_float(packet.dx[i]);
    out.dir_y[i] = direction_float(packet.dy[i]);
    out.dir_z[i] = direction_float(packet.dz[i]);
    out.tnear[i] = 0;
    out.tfar[i] = far_float(packet.leave_m[i] - begin_m, target.slack_m);
    out.time[i] = 0;
    out.mask[i] = ~0u;
    out.id[i] = static_cast<unsigned>(i);
    out.flags[i] = 0;
    packet.floats.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.floats.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
}

// Prepares the rays without a hit so far for the target. Returns whether any of them passes its
// box.
template <int W>
bool enter(const Target& target, std::span<const Hit> hits, Packet<W>& packet) noexcept {
  enter_box(target, packet);
  bool any = false;
  for (std::size_t i = 0; i < W; ++i) {
    const bool open = i < hits.size() && !hits[i] && packet.enter_m[i] <= packet.leave_m[i];
    packet.valid[i] = open ? -1 : 0;
    any |= open;
  }
  if (any) fill_floats(target, packet);
  return any;
}

// Returns the depth inside its facet (cells; the smallest barycentric coordinate) of the point that
// a ray reaches, negative if it lies outside.
template <int W>
double depth_inside(const Packet<W>& packet, std::size_t i, double range_m) noexcept {
  const double side = packet.side[i];
  // The far half is the near half rotated by 180 degrees: 1 - u, 1 - v.
  const double offset = (1 - side) / 2;
  const double u = (packet.u0[i] + range_m * packet.du[i] - packet.column[i]) * packet.per_step[i];
  const double v = (packet.v0[i] + range_m * packet.dv[i] - packet.row[i]) * packet.per_step[i];
  return std::min(std::min(offset + side * u, offset + side * v), side * (1 - (u + v)));
}

// Intersects each ray with the plane of the facet that Embree hit. `inside` becomes the depth of
// the intersection inside the facet, negative if the plane is hit from behind.
template <int W>
void meet_planes(Packet<W>& packet) noexcept {
  for (std::size_t i = 0; i < W; ++i) {
    const double above_m =
        packet.z_m[i] - (packet.height_m[i] + packet.u_slope_m[i] * packet.u0[i] +
                         packet.v_slope_m[i] * packet.v0[i]);
    const double closing =
        -(packet.dz[i] - (packet.u_slope_m[i] * packet.du[i] + packet.v_slope_m[i] * packet.dv[i]));
    const double range_m = above_m / closing;
    const double inside = depth_inside(packet, i, range_m);
    const double along_m = std::min(range_m - packet.enter_m[i], packet.leave_m[i] - range_m);
    packet.range_m[i] = range_m;
    packet.inside[i] = std::min(along_m, closing) > 0 ? inside : -1.0;
  }
}

// Computes where rays that begin on the loaded facets or slightly above them are `above_m` above:
// begin_m, or NaN for those that do not rise so far over their own facet.
template <int W>
void rise_over_planes(Packet<W>& packet, double above_m) noexcept {
  for (std::size_t i = 0; i < W; ++i) {
    const double begins_m =
        packet.z_m[i] - (packet.height_m[i] + packet.u_slope_m[i] * packet.u0[i] +
                         packet.v_slope_m[i] * packet.v0[i]);
    const double rate =
        packet.dz[i] - (packet.u_slope_m[i] * packet.du[i] + packet.v_slope_m[i] * packet.dv[i]);
    const double rise_m = begins_m >= above_m ? 0.0 : (above_m - begins_m) / rate;
    const bool ends_inside = depth_inside(packet, i, rise_m) >= 0;
    const bool rises = begins_m >= 0 && rise_m >= 0 && rise_m <= packet.far_m[i] && ends_inside;
    packet.begin_m[i] = rises ? rise_m : std::numeric_limits<double>::quiet_NaN();
  }
}

template <int W>
void report(const GridFrame& frame, Packet<W>& packet, std::span<Hit> hits) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < W; ++i) {
    packet.range_m[i] =
        packet.valid[i] != 0 ? packet.range_m[i] : std::numeric_limits<double>::infinity();
    any |= packet.range_m[i] < std::numeric_limits<double>::infinity();
  }
  if (!any) return;
  const glm::dvec2 per_m = frame.cells_per_m;
  std::array<std::array<float, W>, 3> normals;
  for (std::size_t i = 0; i < W; ++i) {
    const double x = -packet.u_slope_m[i] * per_m.x;
    const double y = -packet.v_slope_m[i] * per_m.y;
    const double scale = 1 / std::sqrt(x * x + y * y + 1);
    normals[0][i] = static_cast<float>(x * scale);
    normals[1][i] = static_cast<float>(y * scale);
    normals[2][i] = static_cast<float>(scale);
  }
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!(packet.range_m[i] < std::numeric_limits<double>::infinity())) continue;
    hits[i] = {packet.range_m[i],
               {normals[0][i], normals[1][i], normals[2][i]},
               packet.deviation_m[i],
               packet.level[i]};
  }
}

}  // namespace groundray
