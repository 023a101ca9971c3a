#include "reconstruction/dem/ground/ground_filter.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "reconstruction/dem/ground/ground_surface.h"

namespace groundray {
namespace {

void check_filter_options(const GroundFilterOptions& o) {
  Violations broken("GroundFilterOptions");
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  const auto not_negative = [](double value) { return value >= 0 && std::isfinite(value); };
  broken.unless(positive(o.cell_m), "cell_m = {} must be positive and finite", o.cell_m);
  broken.unless(positive(o.slope), "slope = {} must be positive and finite", o.slope);
  broken.unless(not_negative(o.window_radius_m), "window_radius_m = {} must be 0 or more",
                o.window_radius_m);
  broken.unless(positive(o.threshold_m), "threshold_m = {} must be positive and finite",
                o.threshold_m);
  broken.unless(not_negative(o.scaling_m), "scaling_m = {} must be 0 or more", o.scaling_m);
  broken.unless(not_negative(o.net_m), "net_m = {} must be 0 (no nets) or more", o.net_m);
  broken.unless(positive(o.pit_slope), "pit_slope = {} must be positive and finite", o.pit_slope);
  broken.unless(!positive(o.cell_m) || o.window_radius_m <= 1000 * o.cell_m,
                "window_radius_m = {} is more than 1000 cells of {} m: is it in metres?",
                o.window_radius_m, o.cell_m);
  broken.unless(!positive(o.cell_m) || o.net_m <= 1000 * o.cell_m,
                "net_m = {} is more than 1000 cells of {} m: is it in metres?", o.net_m, o.cell_m);
  broken.throw_if_any();
}

struct Box {
  glm::dvec3 low_m{std::numeric_limits<double>::infinity()};
  glm::dvec3 high_m{-std::numeric_limits<double>::infinity()};
};

// Returns the points' bounds, and rejects invalid points.
Box checked_bounds(std::span<const glm::dvec3> points_m) {
  if (points_m.empty())
    throw Error(
        "filter_ground: there are no points: is the cloud empty, or were all points cropped?");
  if (points_m.size() >= std::numeric_limits<std::uint32_t>::max())
    throw Error("filter_ground: {} points exceed the limit of 4e9: filter them tile by tile",
                points_m.size());
  constexpr double most_m = 1e5;
  Box box;
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const glm::dvec3& p = points_m[i];
    const double off_m = std::max({std::abs(p.x), std::abs(p.y), 1e4 * std::abs(p.z)});
    if (!std::isfinite(p.x + p.y + p.z) || off_m > 1e4 * most_m) {
      throw Error(
          "filter_ground: point {} = ({}, {}, {}) must be finite, within 100 km of height 0 and a "
          "million km of the origin: remove returns without a hit, and use metres",
          i, p.x, p.y, p.z);
    }
    box.low_m = glm::min(box.low_m, p);
    box.high_m = glm::max(box.high_m, p);
  }
  return box;
}

// Returns whole cells from D's origin, so that tiles share their cells; at least two each way.
CellFrame frame_around(const Box& box, std::size_t points, double cell_m, std::size_t most_bytes) {
  constexpr double bytes_per_cell = 40, bytes_per_point = 5, always_cells = 2.5e6;
  const glm::dvec2 first = glm::floor(glm::dvec2(box.low_m) / cell_m);
  const glm::dvec2 cells =
      glm::max(glm::floor(glm::dvec2(box.high_m) / cell_m) - first + 1., glm::dvec2(2));
  const double all = cells.x * cells.y;
  const auto count = static_cast<double>(points);
  if (!(all <= std::max(always_cells, 64 * count)) || std::max(cells.x, cells.y) > 1e9) {
    throw Error(
        "filter_ground: {} points spread over {:g} x {:g} cells of {} m, more than 64 per point: "
        "remove distant points, or use a larger cell_m",
        points, cells.x, cells.y, cell_m);
  }
  const double bytes = bytes_per_cell * all + bytes_per_point * count;
  if (bytes > static_cast<double>(most_bytes)) {
    throw Error(
        "filter_ground: {} points over {:g} x {:g} cells of {} m take {:.1f} MB, more than the "
        "{:.1f} MB allowed: filter them tile by tile, or use a larger cell_m",
        points, cells.x, cells.y, cell_m, bytes * 1e-6, static_cast<double>(most_bytes) * 1e-6);
  }
  return {first * cell_m, cell_m, glm::ivec2(cells)};
}

GroundClass class_of(double height_m, double within_m) noexcept {
  if (height_m > within_m) return GroundClass::Above;
  return height_m < -within_m ? GroundClass::Below : GroundClass::Ground;
}

// Classifies points by their height above the surface.
void classify(std::span<const glm::dvec3> points_m, const CellFrame& frame,
              const GroundSurface& ground, double threshold_m, double scaling_m,
              GroundPoints& into) {
  into.classes.resize(points_m.size());
  into.height_m.resize(points_m.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points_m.size(), 1 << 14),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) {
                        const glm::vec2 at(frame.from_first(points_m[i]));
                        const double height_m =
                            points_m[i].z - between_cells(ground.height_m, at.x, at.y);
                        const double slope = between_cells(ground.slope, at.x, at.y);
                        into.height_m[i] = static_cast<float>(height_m);
                        into.classes[i] = class_of(height_m, threshold_m + scaling_m * slope);
                      }
                    });
}

GroundCounts counts_of(const GroundPoints& found, const SurfacePins& lowest) {
  const auto of = [&](GroundClass which) {
    return static_cast<std::size_t>(std::ranges::count(found.classes, which));
  };
  const auto empty = std::ranges::count_if(lowest.height_m.values,
                                           [](float height_m) { return std::isnan(height_m); });
  return {.ground = of(GroundClass::Ground),
          .above = of(GroundClass::Above),
          .below = of(GroundClass::Below),
          .cells = lowest.height_m.values.size(),
          .empty_cells = static_cast<std::size_t>(empty)};
}

void check_overhang_inputs(std::size_t points, const GroundPoints& ground, const GridFrame& frame,
                           double gap_m) {
  Violations broken("find_overhangs");
  broken.unless(
      ground.classes.size() == points && ground.height_m.size() == points,
      "{} points but {} classes and {} heights: was the ground computed from these points?", points,
      ground.classes.size(), ground.height_m.size());
  broken.unless(frame.samples.x > 0 && frame.samples.y > 0,
                "the frame has {} x {} samples: both must be positive", frame.samples.x,
                frame.samples.y);
  broken.unless(std::isfinite(frame.cells_per_m.x * frame.cells_per_m.y) &&
                    frame.cells_per_m.x * frame.cells_per_m.y != 0,
                "the frame has {} x {} cells per metre: both must be finite and not 0",
                frame.cells_per_m.x, frame.cells_per_m.y);
  broken.unless(gap_m > 0 && std::isfinite(gap_m), "gap_m = {} must be positive and finite", gap_m);
  broken.throw_if_any();
}

// Points of each cell: those of cell i are numbers[begins[i]] to before numbers[begins[i + 1]].
struct CellLists {
  std::vector<std::size_t> begins;
  std::vector<std::uint32_t> numbers;
};

CellLists listed(std::span<const glm::dvec3> points_m, const GroundPoints& ground,
                 const GridFrame& frame) {
  const glm::dvec2 end(frame.samples);
  const auto cell_of = [&](std::size_t i) -> std::optional<std::size_t> {
    const glm::dvec2 at = frame.to_grid(glm::dvec2(points_m[i])) + 0.5;
    const bool is_inside = at.x >= 0 && at.y >= 0 && at.x < end.x && at.y < end.y;
    if (!is_inside || ground.classes[i] == GroundClass::Below) return std::nullopt;
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(frame.samples.x) +
           static_cast<std::size_t>(at.x);
  };
  const auto cells =
      static_cast<std::size_t>(frame.samples.x) * static_cast<std::size_t>(frame.samples.y);
  CellLists lists;
  lists.begins.assign(cells + 2, 0);  // shifted by one while they are filled
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    if (const auto cell = cell_of(i)) ++lists.begins[*cell + 2];
  }
  for (std::size_t i = 2; i < lists.begins.size(); ++i) lists.begins[i] += lists.begins[i - 1];
  lists.numbers.resize(lists.begins.back());
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    if (const auto cell = cell_of(i))
      lists.numbers[lists.begins[*cell + 1]++] = static_cast<std::uint32_t>(i);
  }
  return lists;
}

}  // namespace

GroundPoints filter_ground(std::span<const glm::dvec3> points_m, const GroundFilterOptions& options,
                           const RunControl& work) {
  check_filter_options(options);
  const double cell_m = options.cell_m;
  const CellFrame frame =
      frame_around(checked_bounds(points_m), points_m.size(), cell_m, work.most_bytes);
  const SurfacePins lowest = lowest_points(points_m, frame);
  work.report(0.2);
  GroundSurface ground =
      ground_below(lowest, options, [&](double share) { work.report(0.2 + 0.6 * share); });
  GroundPoints found;
  classify(points_m, frame, ground, options.threshold_m, options.scaling_m, found);
  found.counts = counts_of(found, lowest);
  found.counts.object_cells = ground.object_cells;
  found.counts.pit_cells = ground.pit_cells;
  found.surface = HeightGrid(frame.cells, frame.origin_m + 0.5 * cell_m, glm::dvec2(cell_m),
                             std::move(ground.height_m.values));
  work.report(1);
  return found;
}

Overhangs find_overhangs(std::span<const glm::dvec3> points_m, const GroundPoints& ground,
                         const GridFrame& frame, double gap_m) {
  check_overhang_inputs(points_m.size(), ground, frame, gap_m);
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  CellLists lists = listed(points_m, ground, frame);
  const std::size_t cells = lists.begins.size() - 2;
  Overhangs found{std::vector<std::uint16_t>(cells, 0), std::vector<float>(cells, none),
                  std::vector<float>(cells, none)};
  tbb::parallel_for(std::size_t{0}, cells, [&](std::size_t cell) {
    const std::span<std::uint32_t> here(lists.numbers.data() + lists.begins[cell],
                                        lists.begins[cell + 1] - lists.begins[cell]);
    if (here.empty()) return;
    std::ranges::sort(here, {}, [&](std::uint32_t i) {
      return std::tuple(ground.classes[i] != GroundClass::Ground, ground.height_m[i], points_m[i].z,
                        i);
    });
    double top_m = 0;  // top of the surface so far, above the ground
    std::size_t surfaces = 0;
    for (const std::uint32_t i : here) {
      const double height_m = ground.height_m[i];
      const bool is_ground = ground.classes[i] == GroundClass::Ground;
      const bool is_clear = !is_ground && height_m - top_m > gap_m;
      if (is_clear && std::isnan(found.overhang_m[cell])) {
        found.overhang_m[cell] = static_cast<float>(points_m[i].z);
        found.clearance_m[cell] = static_cast<float>(height_m - top_m);
      }
      if (is_clear || surfaces == 0) ++surfaces;
      top_m = surfaces == 1 && is_ground ? height_m : std::max(top_m, height_m);
    }
    found.surfaces[cell] = static_cast<std::uint16_t>(
        std::min<std::size_t>(surfaces, std::numeric_limits<std::uint16_t>::max()));
  });
  return found;
}

}  // namespace groundray
