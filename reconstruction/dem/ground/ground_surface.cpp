#include "reconstruction/dem/ground/ground_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <tuple>
#include <vector>

#include "reconstruction/dem/ground/disc_opening.h"

namespace groundray {
namespace {

constexpr float no_height = std::numeric_limits<float>::quiet_NaN();

// Returns the radii of the discs up to the widest: each larger than the last by a cell or a tenth,
// so that fine cells do not need hundreds of discs.
std::vector<int> growing_radii(int widest) {
  std::vector<int> radii;
  for (int radius = 1; radius < widest; radius += std::max(1, radius / 10)) radii.push_back(radius);
  if (widest > 0) radii.push_back(widest);
  return radii;
}

// Removes points below all their neighbours, where a closing by a disc of one cell raises the
// surface by more than `depth_m`. Returns their number.
std::size_t drop_pits(const Raster& surface, float depth_m, SurfacePins& pins) {
  const Raster closed = closed_by_disc(surface, 1);
  std::size_t count = 0;
  for (std::size_t i = 0; i < surface.values.size(); ++i) {
    float& pin = pins.height_m.values[i];
    if (std::isnan(pin) || closed.values[i] - surface.values[i] <= depth_m) continue;
    pin = no_height;
    ++count;
  }
  return count;
}

// Lowers the surface along the lines of a net to its opening by a disc of twice their spacing,
// where that is lower by more than the slope allows. Features wider than all discs thus fall into
// pieces that are not. Removes the points there and returns their number.
std::size_t cut_by_net(const SurfaceRules& rules, Raster& surface, SurfacePins& pins) {
  std::size_t count = 0;
  const int radius = 2 * rules.net_cells;
  const Raster opened = opened_by_disc(surface, radius);
  const auto most_m = static_cast<float>(rules.slope * radius * rules.cell_m);
  for (int row = 0; row < surface.size.y; ++row) {
    for (int column = 0; column < surface.size.x; ++column) {
      if (row % rules.net_cells != 0 && column % rules.net_cells != 0) continue;
      if (surface(column, row) - opened(column, row) <= most_m) continue;
      surface(column, row) = opened(column, row);
      float& pin = pins.height_m(column, row);
      count += static_cast<std::size_t>(!std::isnan(pin));
      pin = no_height;
    }
  }
  return count;
}

// Marks the cells that a disc lowers by more than the slope allows over its radius, compared with
// the previous disc.
std::vector<std::uint8_t> objects_on(Raster surface, const SurfaceRules& rules,
                                     const std::function<void(double)>& progress) {
  std::vector<std::uint8_t> is_object(surface.values.size(), 0);
  const std::vector<int> radii = growing_radii(rules.radius_cells);
  double done = 0, all = 0;
  for (const int radius : radii) all += radius;
  for (const int radius : radii) {
    Raster opened = opened_by_disc(surface, radius);
    const auto most_m = static_cast<float>(rules.slope * radius * rules.cell_m);
    for (std::size_t i = 0; i < is_object.size(); ++i)
      is_object[i] |= static_cast<std::uint8_t>(surface.values[i] - opened.values[i] > most_m);
    surface = std::move(opened);
    progress((done += radius) / all);
  }
  return is_object;
}

Raster slope_of(const Raster& height_m, double cell_m) {
  const glm::ivec2 size = height_m.size;
  Raster slope(size);
  tbb::parallel_for(0, size.y, [&](int row) {
    const int below = std::max(row - 1, 0), above = std::min(row + 1, size.y - 1);
    for (int column = 0; column < size.x; ++column) {
      const int left = std::max(column - 1, 0), right = std::min(column + 1, size.x - 1);
      const auto rise = [&](float first, float second, int cells) {
        return cells == 0 ? 0 : (second - first) / (cells * cell_m);
      };
      slope(column, row) = static_cast<float>(
          std::hypot(rise(height_m(left, row), height_m(right, row), right - left),
                     rise(height_m(column, below), height_m(column, above), above - below)));
    }
  });
  return slope;
}

}  // namespace

SurfacePins lowest_points(std::span<const glm::dvec3> points_m, const CellFrame& frame) {
  constexpr std::uint32_t nobody = std::numeric_limits<std::uint32_t>::max();
  SurfacePins pins(frame.cells);
  std::vector<std::uint32_t> lowest(pins.height_m.values.size(), nobody);
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const glm::dvec3& p = points_m[i];
    // Rounding may put points on the frame's edge outside it.
    const glm::dvec2 at =
        glm::clamp(frame.from_first(p) + 0.5, glm::dvec2(0), glm::dvec2(frame.cells - 1));
    const int column = static_cast<int>(at.x), row = static_cast<int>(at.y);
    std::uint32_t& best = lowest[pins.height_m.index(column, row)];
    if (best != nobody) {
      const glm::dvec3& q = points_m[best];
      if (!(std::tie(p.z, p.x, p.y) < std::tie(q.z, q.x, q.y))) continue;
    }
    best = static_cast<std::uint32_t>(i);
  }
  tbb::parallel_for(0, frame.cells.y, [&](int row) {
    for (int column = 0; column < frame.cells.x; ++column) {
      const std::size_t cell = pins.height_m.index(column, row);
      if (lowest[cell] == nobody) continue;
      const glm::dvec3& p = points_m[lowest[cell]];
      const glm::dvec2 at = frame.from_first(p) - glm::dvec2(column, row);
      pins.height_m.values[cell] = static_cast<float>(p.z);
      pins.right_cells.values[cell] = static_cast<float>(at.x);
      pins.up_cells.values[cell] = static_cast<float>(at.y);
    }
  });
  return pins;
}

GroundSurface ground_below(SurfacePins lowest, const SurfaceRules& rules,
                           const std::function<void(double)>& progress) {
  GroundSurface ground;
  Raster surface = membrane_through(lowest, PinPlace::Middle);
  ground.pit_cells = drop_pits(surface, static_cast<float>(rules.pit_slope * rules.cell_m), lowest);
  if (ground.pit_cells > 0) surface = membrane_through(lowest, PinPlace::Middle);
  progress(0.2);
  if (rules.net_cells > 0) ground.object_cells = cut_by_net(rules, surface, lowest);
  const std::vector<std::uint8_t> is_object =
      objects_on(std::move(surface), rules, [&](double share) { progress(0.2 + 0.6 * share); });
  for (std::size_t i = 0; i < is_object.size(); ++i) {
    if (is_object[i] == 0 || std::isnan(lowest.height_m.values[i])) continue;
    lowest.height_m.values[i] = no_height;
    ++ground.object_cells;
  }
  ground.height_m = membrane_through(lowest, PinPlace::Measured);
  ground.slope = slope_of(ground.height_m, rules.cell_m);
  progress(1);
  return ground;
}

}  // namespace groundray
