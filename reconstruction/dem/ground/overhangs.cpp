#include "reconstruction/dem/ground/overhangs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <tuple>

#include "core/error.h"

namespace groundray {
namespace {

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
