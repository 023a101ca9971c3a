#include "terrain/scatter/dart_field.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <tuple>

namespace groundray {
namespace {

constexpr std::size_t unknown = std::numeric_limits<std::size_t>::max();

bool comes_before(const Dart& a, const Dart& b) {
  // Breaks ties between equal arrivals in the same way for all cells.
  const auto order = [](const Dart& dart) {
    return std::tuple(dart.arrival_per_m2, dart.cell.y, dart.cell.x, dart.number);
  };
  return order(a) < order(b);
}

}  // namespace

glm::dvec4 draw(const DartLattice& lattice, glm::ivec2 cell, std::uint32_t number,
                DartDraw what) noexcept {
  const auto bits = random_bits({.seed = lattice.seed,
                                 .sensor = lattice.layer,
                                 .frame = static_cast<std::uint32_t>(cell.x),
                                 .pulse = static_cast<std::uint32_t>(cell.y),
                                 .sub_ray = number * 2 + static_cast<std::uint32_t>(what),
                                 .stream = RandomStream::Scatter});
  return (glm::dvec4(bits[0], bits[1], bits[2], bits[3]) + 0.5) * 0x1p-32;
}

DartField::DartField(const DartLattice& lattice, glm::ivec2 first, glm::ivec2 size)
    : lattice_(lattice),
      first_(first),
      size_(size),
      near_(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y),
            Run{unknown, unknown}) {}

DartField::Run DartField::in_cell(glm::ivec2 cell) {
  const glm::ivec2 at = cell - first_;
  if (0 <= at.x && at.x < size_.x && 0 <= at.y && at.y < size_.y) {
    Run& run = near_[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(size_.x) +
                     static_cast<std::size_t>(at.x)];
    if (run.begin == unknown) run = throw_into(cell);
    return run;
  }
  const std::uint64_t key =
      std::uint64_t{static_cast<std::uint32_t>(cell.y)} << 32 | static_cast<std::uint32_t>(cell.x);
  const auto [entry, is_new] = far_.try_emplace(key);
  if (is_new) entry->second = throw_into(cell);
  return entry->second;
}

DartField::Run DartField::throw_into(glm::ivec2 cell) {
  const std::size_t begin = darts_.size();
  const double cell_m2 = lattice_.side_m * lattice_.side_m;
  double arrival_per_m2 = 0;
  for (std::uint32_t number = 0; number < max_darts; ++number) {
    const glm::dvec4 u = draw(lattice_, cell, number, DartDraw::Dart);
    arrival_per_m2 -= std::log(u.x) / cell_m2;
    if (!(arrival_per_m2 < lattice_.per_m2)) break;
    darts_.push_back({cell, number, {u.z, u.w}, arrival_per_m2, u.y});
  }
  states_.resize(darts_.size(), State::Unknown);
  return {begin, darts_.size()};
}

bool DartField::stands(std::size_t index) {
  if (lattice_.min_distance_m == 0) return true;
  if (states_[index] == State::Unknown) {
    const Dart dart = darts_[index];  // a copy: evaluating other darts may move them
    states_[index] = is_free(dart) ? State::Stands : State::Falls;
  }
  return states_[index] == State::Stands;
}

bool DartField::is_free(const Dart& dart) {
  const double reach = lattice_.min_distance_m / lattice_.side_m;
  // Most darts are blocked, and most of these from their own cell.
  if (is_blocked_from(dart.cell, dart, reach)) return false;
  const glm::ivec2 low = dart.cell + glm::ivec2(glm::floor(dart.at - reach));
  const glm::ivec2 high = dart.cell + glm::ivec2(glm::floor(dart.at + reach));
  for (int y = low.y; y <= high.y; ++y) {
    for (int x = low.x; x <= high.x; ++x) {
      if (glm::ivec2(x, y) != dart.cell && is_blocked_from({x, y}, dart, reach)) return false;
    }
  }
  return true;
}

bool DartField::is_blocked_from(glm::ivec2 cell, const Dart& dart, double reach) {
  const auto [begin, end] = in_cell(cell);
  for (std::size_t i = begin; i < end && comes_before(darts_[i], dart); ++i) {
    // In units of cells, so that the result does not depend on the lattice's position in D.
    const glm::dvec2 apart = glm::dvec2(darts_[i].cell - dart.cell) + (darts_[i].at - dart.at);
    if (glm::dot(apart, apart) < reach * reach && stands(i)) return true;
  }
  return false;
}

}  // namespace groundray
