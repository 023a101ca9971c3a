#pragma once

// A packet of rays in one level, and what is computed for all its lanes at once.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "core/level_scene.h"

namespace groundray {

// Where Embree says a ray hits.
struct FloatHit {
  unsigned geometry = RTC_INVALID_GEOMETRY_ID;
  unsigned primitive = 0;
  float u = 0, v = 0;
  float range_m = 0;  // from the float origin
};

// A packet of rays on their way through one level, each number in an array over the lanes so that
// the loops below become vector instructions. Lanes beyond the last ray repeat it and are not
// valid.
template <int W>
struct Packet {
  using Doubles = std::array<double, W>;

  alignas(64) typename PacketOf<W>::Type floats;
  alignas(64) std::array<int, W> valid;
  alignas(64) Doubles x_m, y_m, z_m, dx, dy, dz;  // the rays as given, in D
  Doubles u0, v0, du, dv;                         // and over the level's grid
  Doubles enter_m, leave_m;
  Doubles column, row, side;  // facet of the hit; side is 1 for the near half, -1 for the far one
  Doubles apex_m, east_m, south_m;         // heights of its samples
  Doubles height_m, u_slope_m, v_slope_m;  // its plane
  Doubles range_m, inside;
  std::array<LevelRay, W> exact_rays;  // exact tracing only
  std::array<Crossing, W> crossings;

  GridRay grid_ray(int lane) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    return {u0[i], v0[i], z_m[i], du[i], dv[i], dz[i]};
  }
  LevelRay level_ray(int lane) const noexcept {
    const auto i = static_cast<std::size_t>(lane);
    return {grid_ray(lane),
            enter_m[i],
            leave_m[i],
            {floats.ray.org_x[i], floats.ray.org_y[i], floats.ray.org_z[i]},
            {floats.ray.dir_x[i], floats.ray.dir_y[i], floats.ray.dir_z[i]},
            far_float(leave_m[i] - enter_m[i], 0)};
  }
  FloatHit hit(int lane) const noexcept {
    return {floats.hit.geomID[lane], floats.hit.primID[lane], floats.hit.u[lane],
            floats.hit.v[lane], floats.ray.tfar[lane]};
  }
  void take(int lane, const HeightGrid& grid, const Facet& facet) noexcept {
    const auto i = static_cast<std::size_t>(lane);
    const int apex = facet.half == Facet::Half::Near ? 0 : 1;
    column[i] = facet.column;
    row[i] = facet.row;
    side[i] = 1 - 2 * apex;
    apex_m[i] = grid.height_m(facet.column + apex, facet.row + apex);
    east_m[i] = grid.height_m(facet.column + 1, facet.row);
    south_m[i] = grid.height_m(facet.column, facet.row + 1);
  }
  // As HeightGrid::plane, operation by operation: ranges must not depend on who computes them.
  void find_planes() noexcept {
    for (std::size_t i = 0; i < W; ++i) {
      const bool near_half = side[i] > 0;
      const double u_m = near_half ? east_m[i] - apex_m[i] : apex_m[i] - south_m[i];
      const double v_m = near_half ? south_m[i] - apex_m[i] : apex_m[i] - east_m[i];
      const double corner_m = near_half ? apex_m[i] : east_m[i] + south_m[i] - apex_m[i];
      u_slope_m[i] = u_m;
      v_slope_m[i] = v_m;
      height_m[i] = corner_m - (u_m * column[i] + v_m * row[i]);
    }
  }
};

// Takes the rays in, and finds where each is inside the level's box: from enter_m to leave_m.
template <int W>
void enter_box(const LevelScene& level, std::span<const Ray> rays, Packet<W>& packet) noexcept {
  for (std::size_t i = 0; i < W; ++i) {
    const Ray& ray = rays[std::min(i, rays.size() - 1)];
    packet.x_m[i] = ray.origin.x;
    packet.y_m[i] = ray.origin.y;
    packet.z_m[i] = ray.origin.z;
    packet.dx[i] = ray.direction.x;
    packet.dy[i] = ray.direction.y;
    packet.dz[i] = ray.direction.z;
    packet.leave_m[i] = ray.far_m;
  }
  const HeightGrid& grid = level.level.grid;
  const glm::dvec2 origin_m = grid.origin_m();
  const glm::dvec2 per_m = grid.cells_per_m();
  constexpr double rim = 1e-6;  // cells, so that rays along the border are inside
  const glm::dvec3 low(-rim, -rim, grid.min_height_m() - level.slack_m);
  const glm::dvec3 high(grid.columns() - 1 + rim, grid.rows() - 1 + rim,
                        grid.max_height_m() + level.slack_m);
  for (std::size_t i = 0; i < W; ++i) {
    const double u0 = packet.u0[i] = (packet.x_m[i] - origin_m.x) * per_m.x;
    const double v0 = packet.v0[i] = (packet.y_m[i] - origin_m.y) * per_m.y;
    const double iu = 1 / (packet.du[i] = packet.dx[i] * per_m.x);
    const double iv = 1 / (packet.dv[i] = packet.dy[i] * per_m.y);
    const double iz = 1 / packet.dz[i];
    const double ua = (low.x - u0) * iu, ub = (high.x - u0) * iu;
    const double va = (low.y - v0) * iv, vb = (high.y - v0) * iv;
    const double za = (low.z - packet.z_m[i]) * iz, zb = (high.z - packet.z_m[i]) * iz;
    packet.enter_m[i] =
        std::max(std::max(std::min(ua, ub), std::min(va, vb)), std::max(std::min(za, zb), 0.0));
    packet.leave_m[i] = std::min(std::min(std::max(ua, ub), std::max(va, vb)),
                                 std::min(std::max(za, zb), packet.leave_m[i]));
  }
}

// Fills Embree's packet: the rays in L, from where they enter the box.
template <int W>
void fill_floats(const LevelScene& level, Packet<W>& packet) noexcept {
  auto& out = packet.floats.ray;
  for (std::size_t i = 0; i < W; ++i) {
    const double begin_m = packet.enter_m[i];
    out.org_x[i] = static_cast<float>(packet.x_m[i] + packet.dx[i] * begin_m - level.p_DL.x);
    out.org_y[i] = static_cast<float>(packet.y_m[i] + packet.dy[i] * begin_m - level.p_DL.y);
    out.org_z[i] = static_cast<float>(packet.z_m[i] + packet.dz[i] * begin_m - level.p_DL.z);
    out.dir_x[i] = static_cast<float>(packet.dx[i]);
    out.dir_y[i] = static_cast<float>(packet.dy[i]);
    out.dir_z[i] = static_cast<float>(packet.dz[i]);
    out.tnear[i] = 0;
    out.tfar[i] = far_float(packet.leave_m[i] - begin_m, level.slack_m);
    out.time[i] = 0;
    out.mask[i] = ~0u;
    out.id[i] = static_cast<unsigned>(i);
    out.flags[i] = 0;
    packet.floats.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
  }
}

// Brings the rays that have met nothing yet to the level. Returns whether any passes its box.
template <int W>
bool enter(const LevelScene& level, std::span<const Ray> rays, std::span<const Hit> hits,
           Packet<W>& packet) noexcept {
  enter_box(level, rays, packet);
  bool any = false;
  for (std::size_t i = 0; i < W; ++i) {
    const bool open = i < rays.size() && !hits[i] && packet.enter_m[i] <= packet.leave_m[i];
    packet.valid[i] = open ? -1 : 0;
    any |= open;
  }
  if (any) fill_floats(level, packet);
  return any;
}

// Meets each ray with the plane of the facet that Embree hit, and finds how far inside the facet
// that is (cells); negative if it is not, or if the plane is met from behind.
template <int W>
void meet_planes(Packet<W>& packet) noexcept {
  for (std::size_t i = 0; i < W; ++i) {
    const double above_m =
        packet.z_m[i] - (packet.height_m[i] + packet.u_slope_m[i] * packet.u0[i] +
                         packet.v_slope_m[i] * packet.v0[i]);
    const double closing =
        -(packet.dz[i] - (packet.u_slope_m[i] * packet.du[i] + packet.v_slope_m[i] * packet.dv[i]));
    const double range_m = above_m / closing;
    const double side = packet.side[i];
    const double offset =
        (1 - side) / 2;  // the far half is the near half turned round: 1 - u, 1 - v
    const double u = packet.u0[i] + range_m * packet.du[i] - packet.column[i];
    const double v = packet.v0[i] + range_m * packet.dv[i] - packet.row[i];
    const double inside =
        std::min(std::min(offset + side * u, offset + side * v), side * (1 - (u + v)));
    const double along_m = std::min(range_m - packet.enter_m[i], packet.leave_m[i] - range_m);
    packet.range_m[i] = range_m;
    packet.inside[i] = std::min(along_m, closing) > 0 ? inside : -1.0;
  }
}

template <int W>
void report(const LevelScene& level, std::uint32_t number, Packet<W>& packet,
            std::span<Hit> hits) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < W; ++i) {
    packet.range_m[i] =
        packet.valid[i] != 0 ? packet.range_m[i] : std::numeric_limits<double>::infinity();
    any |= packet.range_m[i] < std::numeric_limits<double>::infinity();
  }
  if (!any) return;
  packet.find_planes();  // again: a search may have changed a facet
  const glm::dvec2 per_m = level.level.grid.cells_per_m();
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
    hits[i] = {packet.range_m[i], {normals[0][i], normals[1][i], normals[2][i]}, number};
  }
}

}  // namespace groundray
