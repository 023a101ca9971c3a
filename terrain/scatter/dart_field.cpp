#include "terrain/scatter/dart_field.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <tuple>

#include "core/math.h"

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

using std::numbers::pi;
using std::numbers::sqrt3;

// Jamming limit: the coverage at which adsorption ends. Feder (1980), Hinrichsen et al. (1986) and
// the review by Evans, Random and cooperative sequential adsorption (1993), agree on these digits.
constexpr double jammed = 0.547;

// With x = coverage / jammed, the free fraction is (1 + a1 x + a2 x^2 + ...) (1 - x)^3. It vanishes
// at x = 1 as Pomeau (1980) and Swendsen (1981) showed. Its expansion to third order is exact if it
// equals 1 - 4 jammed x + s2 x^2 + s3 x^3 (Schaaf and Talbot's equation 31), which determines a1 to
// a3.
constexpr double s2 = 6 * sqrt3 / pi * jammed * jammed;
constexpr double s3 = (40 / (sqrt3 * pi) - 176 / (3 * pi * pi)) * jammed * jammed * jammed;
constexpr double a1 = 3 - 4 * jammed;
constexpr double a2 = s2 - 3 + 3 * a1;
constexpr double a3 = s3 + 1 - 3 * a1 + 3 * a2;

// With a4 = a5 = a6 = 0, as Schaaf and Talbot propose, coverages are up to 1.7 % too high. Our a4
// to a6 are fitted to the coverage of 120 squares of 1000 x 1000 diameters
// (docs/reference/scatter.md).
constexpr double a4 = -0.19349882;
constexpr double a5 = -0.05172045;
constexpr double a6 = -1.26902944;

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
    arrival_per_m2 -= math::log(u.x) / cell_m2;
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

double free_share(double coverage) noexcept {
  const double x = coverage / jammed;
  const double room = 1 - x;
  return (1 + x * (a1 + x * (a2 + x * (a3 + x * (a4 + x * (a5 + x * a6)))))) * room * room * room;
}

double thrown_for(double coverage) noexcept {
  // Simpson's rule; its error is below 1e-9 here.
  constexpr int steps = 256;
  const double step = coverage / steps;
  double sum = 1 / free_share(0) + 1 / free_share(coverage);
  for (int i = 1; i < steps; ++i) sum += (i % 2 == 1 ? 4 : 2) / free_share(i * step);
  return sum * step / 3;
}

}  // namespace groundray
