#include "reconstruction/mesh/scan/beam_rows.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "reconstruction/mesh/scan/firing_lattice.h"

namespace groundray {
namespace {

constexpr std::int64_t most_rows = 1'000'000;
constexpr double clearness = 4;        // gaps between beams relative to those within
constexpr double one_beam_rad = 2e-3;  // elevations of a scanner with a single plane
constexpr double rounding_rad = 2e-7;  // of single precision
constexpr double jump_turns = 0.01;    // backward step of azimuth between rings
constexpr double most_spread = 0.5;    // of elevations in a ring, relative to the spacing of rings
constexpr std::size_t most_sectors = 36;    // of a turn, in which elevations of a ring are compared
constexpr std::size_t sector_returns = 16;  // of a ring, on average

/// Returns the distinct numbers in ascending order.
std::vector<std::int32_t> distinct_numbers(std::span<const std::int32_t> numbers) {
  std::vector<std::int32_t> sorted(numbers.begin(), numbers.end());
  std::ranges::sort(sorted);
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted;
}

/// Returns the median elevation of each ring; 0 for a ring without returns.
std::vector<double> medians(std::span<const std::int32_t> ring, std::size_t rings,
                            std::span<const double> elevations_rad) {
  std::vector<std::vector<double>> of_ring(rings);
  for (std::size_t i = 0; i < ring.size(); ++i)
    of_ring[static_cast<std::size_t>(ring[i])].push_back(elevations_rad[i]);
  std::vector<double> median(rings);
  for (std::size_t r = 0; r < rings; ++r) {
    if (!of_ring[r].empty()) median[r] = upper_median(of_ring[r]);
  }
  return median;
}

/// Returns the smallest gap between beams from sorted elevations: in descending order of all gaps,
/// those between beams precede the steepest drop. Nothing if no drop is steep enough.
std::optional<double> gap_between_beams(const std::vector<double>& sorted_rad) {
  std::vector<double> gaps;
  for (std::size_t i = 1; i < sorted_rad.size(); ++i)
    gaps.push_back(sorted_rad[i] - sorted_rad[i - 1]);
  std::ranges::sort(gaps, std::greater());
  std::optional<double> least_rad;
  double steepest = clearness;
  for (std::size_t i = 0; i < gaps.size() && 4 * (i + 2) <= sorted_rad.size(); ++i) {
    const double next_rad = i + 1 < gaps.size() ? gaps[i + 1] : 0;
    const double fall = gaps[i] / std::max(next_rad, rounding_rad);
    if (fall < steepest) continue;
    steepest = fall;
    least_rad = gaps[i];
  }
  return least_rad;
}

/// Numbers runs of returns, separated by backward jumps of azimuth or by a seam (in turns).
std::vector<std::int32_t> runs_of(std::span<const double> azimuths_rad, double sense, double seam) {
  std::vector<std::int32_t> run(azimuths_rad.size(), 0);
  double last = 0;
  for (std::size_t i = 0; i < run.size(); ++i) {
    const double turns = sense * (azimuths_rad[i] / two_pi - seam);
    const double place = turns - std::floor(turns);
    const double step = std::remainder(place - last, 1);
    const bool is_new = place < last - jump_turns || step < -jump_turns;
    if (i > 0) run[i] = run[i - 1] + (is_new ? 1 : 0);
    last = place;
  }
  return run;
}

/// Returns the median difference of elevation between consecutive runs, except for short ones.
double typical_gap(const std::vector<double>& median, const std::vector<std::size_t>& size,
                   std::size_t returns) {
  std::vector<double> apart;
  double last = 0;
  bool begun = false;
  for (std::size_t r = 0; r < median.size(); ++r) {
    if (4 * size[r] * median.size() < returns) continue;
    if (begun) apart.push_back(std::abs(median[r] - last));
    last = median[r];
    begun = true;
  }
  return apart.empty() ? 0 : upper_median(apart);
}

/// Returns the mean absolute deviation of elevations from the median of their ring and sector.
double ring_spread_rad(std::span<const std::int32_t> ring, std::size_t rings, std::size_t sectors,
                       std::span<const double> azimuths_rad,
                       std::span<const double> elevations_rad) {
  std::vector<std::int32_t> place(ring.size());
  for (std::size_t i = 0; i < place.size(); ++i) {
    const auto sector =
        static_cast<std::size_t>(azimuths_rad[i] / two_pi * static_cast<double>(sectors));
    place[i] = static_cast<std::int32_t>(static_cast<std::size_t>(ring[i]) * sectors +
                                         std::min(sector, sectors - 1));
  }
  const std::vector<double> median = medians(place, rings * sectors, elevations_rad);
  double sum = 0;
  for (std::size_t i = 0; i < place.size(); ++i)
    sum += std::abs(elevations_rad[i] - median[static_cast<std::size_t>(place[i])]);
  return sum / static_cast<double>(place.size());
}

/// Rings, and the spread of elevations within a ring relative to the spacing of consecutive rings:
/// over the whole ring, and within sectors of the turn. De-skewed points are seen from another
/// position than their pulse's, here from higher and there from lower, which spreads whole rings.
struct Turns {
  std::vector<std::int32_t> ring;  // of each return
  double spread = std::numeric_limits<double>::infinity();
  double local_spread = std::numeric_limits<double>::infinity();
  // Number per ring of steps between consecutive returns larger than half the spacing of rings.
  double jumps = 0;

  bool is_better_than(const Turns& other) const {
    return spread + jumps < other.spread + other.jumps;
  }
};

/// Treats runs as rings and joins consecutive runs at one elevation: rings with an offset in
/// azimuth pass the seam sooner or later than others.
Turns turns_of(std::vector<std::int32_t> run, std::span<const double> azimuths_rad,
               std::span<const double> elevations_rad) {
  const auto runs = static_cast<std::size_t>(run.back()) + 1;
  if (runs < 2 || run.size() < 8 * runs) return {};
  const std::vector<double> median = medians(run, runs, elevations_rad);
  std::vector<std::size_t> size(runs, 0);
  for (const std::int32_t r : run) ++size[static_cast<std::size_t>(r)];
  const double gap_rad = typical_gap(median, size, run.size());
  std::vector<std::int32_t> ring_of_run(runs, 0);
  std::size_t largest = 0;  // largest run of the current ring
  for (std::size_t r = 1; r < runs; ++r) {
    const bool is_new = std::abs(median[r] - median[largest]) > gap_rad / 4;
    ring_of_run[r] = ring_of_run[r - 1] + (is_new ? 1 : 0);
    if (is_new || size[r] > size[largest]) largest = r;
  }
  Turns turns{.ring = std::move(run)};
  for (std::int32_t& r : turns.ring) r = ring_of_run[static_cast<std::size_t>(r)];
  const auto rings = static_cast<std::size_t>(turns.ring.back()) + 1;
  if (gap_rad <= 0) return turns;
  std::size_t jumps = 0;
  for (std::size_t i = 1; i < turns.ring.size(); ++i) {
    jumps += turns.ring[i] == turns.ring[i - 1] &&
             std::abs(elevations_rad[i] - elevations_rad[i - 1]) > gap_rad / 2;
  }
  turns.jumps = static_cast<double>(jumps) / static_cast<double>(rings);
  const std::size_t sectors =
      std::clamp<std::size_t>(turns.ring.size() / (sector_returns * rings), 1, most_sectors);
  turns.spread = ring_spread_rad(turns.ring, rings, 1, azimuths_rad, elevations_rad) / gap_rad;
  turns.local_spread =
      ring_spread_rad(turns.ring, rings, sectors, azimuths_rad, elevations_rad) / gap_rad;
  return turns;
}

/// Keeps the order of rings that, with few exceptions, follow each other upwards or downwards,
/// since parallax may exchange the elevations of neighbours. Others are ordered by elevation.
BeamRows rows_in_order(std::vector<std::int32_t> ring, std::span<const double> elevations_rad) {
  const auto rings = static_cast<std::size_t>(ring.back()) + 1;
  const std::vector<double> median = medians(ring, rings, elevations_rad);
  std::size_t upwards = 0;
  for (std::size_t r = 1; r < rings; ++r) upwards += median[r] > median[r - 1];
  const std::size_t downwards = rings - 1 - upwards;
  if (5 * std::min(upwards, downwards) > rings)
    return rows_of_rings(ring, elevations_rad, RowOrder::Elevation);
  if (downwards > upwards) {
    for (std::int32_t& r : ring) r = static_cast<std::int32_t>(rings) - 1 - r;
  }
  return {std::move(ring), static_cast<int>(rings)};
}

}  // namespace

BeamRows rows_of_rings(std::span<const std::int32_t> rings, std::span<const double> elevations_rad,
                       RowOrder order) {
  BeamRows rows;
  if (rings.empty()) return rows;
  const std::vector<std::int32_t> numbers = distinct_numbers(rings);
  const std::int64_t span = std::int64_t{numbers.back()} - numbers.front() + 1;
  const std::int64_t count =
      order == RowOrder::Number ? span : static_cast<std::int64_t>(numbers.size());
  if (count > most_rows) {
    throw Error(
        "rings from {} to {} would make {} rows, more than the limit of {}: are they beam numbers?",
        numbers.front(), numbers.back(), count, most_rows);
  }
  rows.count = static_cast<int>(count);
  rows.row.reserve(rings.size());
  for (const std::int32_t ring : rings) {
    rows.row.push_back(
        order == RowOrder::Number
            ? ring - numbers.front()
            : static_cast<std::int32_t>(std::ranges::lower_bound(numbers, ring) - numbers.begin()));
  }
  if (order == RowOrder::Number) return rows;
  const std::vector<double> median = medians(rows.row, numbers.size(), elevations_rad);
  std::vector<std::int32_t> ring_of_row(numbers.size()), row_of_ring(numbers.size());
  std::iota(ring_of_row.begin(), ring_of_row.end(), 0);
  std::ranges::stable_sort(
      ring_of_row, {}, [&](std::int32_t ring) { return median[static_cast<std::size_t>(ring)]; });
  for (std::size_t r = 0; r < ring_of_row.size(); ++r)
    row_of_ring[static_cast<std::size_t>(ring_of_row[r])] = static_cast<std::int32_t>(r);
  for (std::int32_t& row : rows.row) row = row_of_ring[static_cast<std::size_t>(row)];
  return rows;
}

std::optional<BeamRows> rows_of_elevations(std::span<const double> elevations_rad) {
  BeamRows rows;
  if (elevations_rad.empty()) return rows;
  std::vector<double> sorted(elevations_rad.begin(), elevations_rad.end());
  std::ranges::sort(sorted);
  rows.row.assign(elevations_rad.size(), 0);
  rows.count = 1;
  if (sorted.back() - sorted.front() <= one_beam_rad) return rows;
  const std::optional<double> least_rad = gap_between_beams(sorted);
  if (!least_rad) return std::nullopt;
  std::vector<double> firsts;  // lowest elevation of each beam except the first
  double widest_rad = 0, first_rad = sorted.front();
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i] - sorted[i - 1] >= *least_rad) firsts.push_back(first_rad = sorted[i]);
    widest_rad = std::max(widest_rad, sorted[i] - first_rad);
  }
  if (widest_rad * clearness > *least_rad) return std::nullopt;
  for (std::size_t i = 0; i < elevations_rad.size(); ++i) {
    rows.row[i] = static_cast<std::int32_t>(std::ranges::upper_bound(firsts, elevations_rad[i]) -
                                            firsts.begin());
  }
  rows.count = static_cast<int>(firsts.size()) + 1;
  return rows;
}

std::optional<BeamRows> rows_of_turns(std::span<const double> azimuths_rad,
                                      std::span<const double> elevations_rad) {
  const std::size_t count = azimuths_rad.size();
  if (count == 0) return std::nullopt;
  std::size_t forwards = 0, backwards = 0;
  for (std::size_t i = 1; i < count; ++i) {
    const double turned = std::remainder(azimuths_rad[i] - azimuths_rad[i - 1], two_pi);
    ++(turned > 0 ? forwards : backwards);
  }
  if (std::max(forwards, backwards) * 10 < count * 9) return std::nullopt;
  const double sense = forwards > backwards ? 1 : -1;
  Turns best;
  // Rings may begin ahead, behind, to either side, or at the first return.
  for (const double seam : {0.0, 0.25, 0.5, 0.75, azimuths_rad[0] / two_pi - sense * 0.005}) {
    Turns turns = turns_of(runs_of(azimuths_rad, sense, seam), azimuths_rad, elevations_rad);
    if (turns.is_better_than(best)) best = std::move(turns);
  }
  if (!(best.local_spread <= most_spread)) return std::nullopt;
  return rows_in_order(std::move(best.ring), elevations_rad);
}

}  // namespace groundray
