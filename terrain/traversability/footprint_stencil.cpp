#include "terrain/traversability/footprint_stencil.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/common.hpp>

#include "core/math.h"

namespace groundray {
namespace {

// Coordinates in cells that differ from whole numbers by less are whole, so that the samples beside
// a grid line are not used.
constexpr double snap_cells = 1e-9;

double snapped(double cells) noexcept {
  const double whole = std::round(cells);
  return std::abs(cells - whole) < snap_cells ? whole : cells;
}

// Makes the points of a vehicle at (0, 0) of grid coordinates: columns to the east, rows to the
// south.
class StencilMaker {
 public:
  StencilMaker(double heading_rad, double cell_m, int columns)
      : forward_(math::cos(heading_rad), math::sin(heading_rad)),
        cell_m_(cell_m),
        columns_(columns) {}

  glm::dvec2 to_grid(glm::dvec2 p_B) const noexcept {
    const glm::dvec2 p_m = p_B.x * forward_ + p_B.y * glm::dvec2(-forward_.y, forward_.x);
    return {p_m.x / cell_m_, -p_m.y / cell_m_};
  }
  glm::dvec2 to_B(glm::dvec2 p) const noexcept {
    const glm::dvec2 p_m = cell_m_ * glm::dvec2(p.x, -p.y);
    return {p_m.x * forward_.x + p_m.y * forward_.y, p_m.y * forward_.x - p_m.x * forward_.y};
  }

  StencilPoint at(glm::dvec2 p_B) {
    const glm::dvec2 p = to_grid(p_B);
    const glm::dvec2 place(snapped(p.x), snapped(p.y));
    const glm::ivec2 cell(glm::floor(place));
    const double across = place.x - cell.x, down = place.y - cell.y;
    StencilPoint point{.p_B = p_B};
    if (across + down <= 1) {
      add(point, 0, cell, 1 - across - down);
      add(point, 1, {cell.x + 1, cell.y}, across);
      add(point, 2, {cell.x, cell.y + 1}, down);
    } else {
      add(point, 0, cell + 1, across + down - 1);
      add(point, 1, {cell.x, cell.y + 1}, 1 - across);
      add(point, 2, {cell.x + 1, cell.y}, 1 - down);
    }
    share_samples(point);
    return point;
  }

  int reach() const noexcept { return reach_; }

 private:
  void add(StencilPoint& point, std::size_t i, glm::ivec2 sample, double weight) noexcept {
    if (std::abs(weight) < snap_cells) return;
    point.weights[i] = weight;
    point.offsets[i] = std::ptrdiff_t{sample.y} * columns_ + sample.x;
    reach_ = std::max({reach_, std::abs(sample.x), std::abs(sample.y)});
  }

  // Lets samples without weight be one that has some: they may be missing, and 0 NaN is NaN.
  static void share_samples(StencilPoint& point) noexcept {
    const auto used = std::ranges::max_element(point.weights) - point.weights.begin();
    for (std::size_t i = 0; i < point.weights.size(); ++i)
      if (point.weights[i] == 0) point.offsets[i] = point.offsets[static_cast<std::size_t>(used)];
  }

  glm::dvec2 forward_;
  double cell_m_;
  int columns_;
  int reach_ = 0;
};

// Calls `act` with the share of the way from `from` to `to` of each whole number between them.
void each_whole(double from, double to, const auto& act) {
  const double low = std::min(from, to), high = std::max(from, to);
  if (high - low < snap_cells) return;
  for (double whole = std::ceil(low - snap_cells); whole <= high + snap_cells; ++whole)
    act(std::clamp((whole - from) / (to - from), 0.0, 1.0));
}

// Adds the crossings of a side of the underbody with grid lines and diagonals.
void add_crossings(StencilMaker& maker, glm::dvec2 from_B, glm::dvec2 to_B,
                   std::vector<StencilPoint>& points) {
  const glm::dvec2 from = maker.to_grid(from_B), to = maker.to_grid(to_B);
  const auto add = [&](double share) { points.push_back(maker.at(glm::mix(from_B, to_B, share))); };
  each_whole(from.x, to.x, add);
  each_whole(from.y, to.y, add);
  each_whole(from.x + from.y, to.x + to.y, add);
}

// Adds the samples within the underbody.
void add_samples(StencilMaker& maker, glm::dvec2 half_m, double cell_m,
                 std::vector<StencilPoint>& points) {
  const double slack_m = snap_cells * cell_m;
  const int most = static_cast<int>(std::ceil(math::hypot(half_m.x, half_m.y) / cell_m));
  for (int row = -most; row <= most; ++row) {
    for (int column = -most; column <= most; ++column) {
      const glm::dvec2 p_B = maker.to_B({column, row});
      if (std::abs(p_B.x) <= half_m.x + slack_m && std::abs(p_B.y) <= half_m.y + slack_m)
        points.push_back(maker.at(p_B));
    }
  }
}

}  // namespace

double VehicleSize::half_diagonal_m() const noexcept {
  return math::hypot(std::max(length_m, wheelbase_m), std::max(width_m, track_m)) / 2;
}

FootprintStencil footprint_stencil(const VehicleSize& vehicle, double heading_rad, double cell_m,
                                   int columns) {
  StencilMaker maker(heading_rad, cell_m, columns);
  constexpr std::array<glm::dvec2, 4> corners{{{1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};
  FootprintStencil stencil;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    stencil.wheels[i] =
        maker.at(corners[i] * glm::dvec2(vehicle.wheelbase_m, vehicle.track_m) / 2.0);
  }
  const glm::dvec2 half_m = glm::dvec2(vehicle.length_m, vehicle.width_m) / 2.0;
  add_samples(maker, half_m, cell_m, stencil.underbody);
  for (const glm::dvec2& corner : corners) stencil.underbody.push_back(maker.at(corner * half_m));
  constexpr std::array<std::size_t, 5> around{0, 1, 3, 2, 0};
  for (std::size_t i = 0; i + 1 < around.size(); ++i) {
    add_crossings(maker, corners[around[i]] * half_m, corners[around[i + 1]] * half_m,
                  stencil.underbody);
  }
  stencil.reach = maker.reach();
  return stencil;
}

DiscStencil disc_stencil(double radius_m, double cell_m, int columns) {
  const double cells = radius_m / cell_m * (1 + snap_cells);
  DiscStencil disc{.offsets = {}, .places_m = {}, .reach = static_cast<int>(cells)};
  for (int row = -disc.reach; row <= disc.reach; ++row) {
    for (int column = -disc.reach; column <= disc.reach; ++column) {
      if (math::hypot(column, row) > cells) continue;
      disc.offsets.push_back(std::ptrdiff_t{row} * columns + column);
      disc.places_m.emplace_back(column * cell_m, -row * cell_m);
    }
  }
  return disc;
}

}  // namespace groundray
