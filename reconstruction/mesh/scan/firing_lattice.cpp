#include "reconstruction/mesh/scan/firing_lattice.h"

#include <utility>

#include "core/math.h"

namespace groundray {
namespace {

constexpr double most_steps = 1e6;       // in a turn, or over the whole range
constexpr int most_missing = 16;         // at least one in this many pulses is present
constexpr std::size_t enough = 512;      // differences, to determine a ring's step
constexpr double window_steps = 16;      // over which the phase is treated as constant
constexpr std::size_t least_pulses = 6;  // to determine the phase of a window

Phasor unit(double turns) { return phasor_of(two_pi * (turns - std::round(turns))); }

/// Returns the mean cosine of the phases of differences with respect to a step.
double coherence_of(std::span<const double> differences, double step) {
  double sum = 0;
  for (const double d : differences) sum += unit(d / step).real();
  return sum / static_cast<double>(differences.size());
}

/// Step of a ring, extent of its pulses, and evenness of its steps.
struct RingStep {
  double step = 0, reach = 0, evenness = 0;
};

/// Determines the step of a ring from its differences, of which there is at least one.
RingStep step_of(std::vector<double>& differences) {
  const double median = upper_median(differences);
  std::vector<double> near;
  for (const double d : differences) {
    if (d <= 3.5 * median && near.size() < enough) near.push_back(d);
  }
  std::vector<double> coherence;
  for (int parts = 1; parts <= most_missing; ++parts) {
    coherence.push_back(coherence_of(near, median / parts));
    if (parts == 1 && coherence[0] > 0.7) break;
  }
  const double most = std::ranges::max(coherence);
  const auto found = std::ranges::find_if(coherence, [&](double c) { return c >= 0.7 * most; });
  const double step = median / static_cast<double>(most > 0.3 ? found - coherence.begin() + 1 : 1);
  double sum = 0, count = 0;  // the mean is more precise than the median of rounded values
  for (const double d : differences) {
    const double steps = std::round(d / step);
    if (steps < 1 || steps > 3 || std::abs(d / step - steps) > 0.2) continue;
    sum += d;
    count += steps;
  }
  const double mean = count > 0 ? sum / count : step;
  return {mean, mean * static_cast<double>(differences.size()), coherence_of(near, mean)};
}

/// Returns the coarsest step that is not rare: surplus pulses of finer rings can be left out,
/// whereas with a finer step coarser rings would lack pulses.
double coarsest(std::vector<RingStep> rings) {
  std::ranges::sort(rings, {},
                    [](const RingStep& ring) { return std::pair(ring.step, ring.reach); });
  double reach = 0, passed = 0;
  for (const RingStep& ring : rings) reach += ring.reach;
  std::size_t found = 0;
  while (found + 1 < rings.size() && (passed += rings[found].reach) < 0.9 * reach) ++found;
  std::vector<double> like;
  for (const RingStep& ring : rings) {
    if (std::abs(ring.step / rings[found].step - 1) < 0.25) like.push_back(ring.step);
  }
  return upper_median(like);
}

/// Returns the steps of the rings with enough differences, or of all if none has.
std::vector<RingStep> ring_steps(std::span<const double> coordinates,
                                 std::span<const std::int32_t> rings, int ring_count,
                                 double extent) {
  std::vector<std::vector<double>> of_ring(static_cast<std::size_t>(ring_count));
  for (std::size_t i = 0; i < rings.size(); ++i)
    of_ring[static_cast<std::size_t>(rings[i])].push_back(coordinates[i]);
  std::vector<RingStep> steps;
  std::vector<double> differences;
  for (const std::size_t least : {std::size_t{15}, std::size_t{1}}) {
    for (std::vector<double>& values : of_ring) {
      std::ranges::sort(values);
      differences.clear();
      for (std::size_t i = 1; i < values.size(); ++i) {
        const double d = values[i] - values[i - 1];
        if (d > extent / (2 * most_steps)) differences.push_back(d);
      }
      if (differences.size() < least) continue;
      steps.push_back(step_of(differences));
    }
    if (!steps.empty()) break;
  }
  return steps;
}

/// Estimates the phase of each ring, and the common phase along the scan.
class PhaseTrack {
 public:
  PhaseTrack(std::span<const double> coordinates, std::span<const std::int32_t> rings,
             int ring_count, double first, double extent, double turn, double step)
      : coordinates_(coordinates),
        rings_(rings),
        first_(first),
        turn_(turn),
        step_(step),
        windows_(std::max<std::size_t>(
            1, static_cast<std::size_t>(std::ceil(extent / (window_steps * step))))),
        width_(std::max(extent, step) / static_cast<double>(windows_)),
        ring_phase_(static_cast<std::size_t>(ring_count), Phasor(0)),
        phasor_(windows_),
        phase_(windows_ + 1) {
    factor();
    unwrap();
  }

  /// Returns the position of a pulse in steps; its number is the nearest integer.
  double steps(std::size_t pulse) const {
    const double place = coordinates_[pulse] - first_;
    const double ring = phase_rad(ring_phase_[static_cast<std::size_t>(rings_[pulse])]) / two_pi;
    return place / step_ - phase_at(place / width_ - 0.5) - ring;
  }

  /// Returns the step corrected by the drift of the phase, which is then constant along the scan.
  double refined_step() const {
    const double moved = phase_[windows_ - 1] - phase_[0];
    if (windows_ < 2) return step_;
    const double way = width_ * static_cast<double>(windows_ - 1);
    return way / (way / step_ - moved);
  }

  std::int64_t period() const { return period_; }

 private:
  std::size_t window_of(double place) const {
    return std::min(static_cast<std::size_t>(std::max(place / width_, 0.0)), windows_ - 1);
  }

  void factor();
  void unwrap();

  /// Returns the phase in turns at a position, in windows from the centre of the first.
  double phase_at(double window) const {
    const double cell = std::floor(window);
    const double share = window - cell;
    const auto value = [&](double k) {
      if (turn_ > 0 && k < 0) return phase_[windows_ - 1] - (phase_[windows_] - phase_[0]);
      return phase_[static_cast<std::size_t>(
          std::clamp(k, 0.0, static_cast<double>(turn_ > 0 ? windows_ : windows_ - 1)))];
    };
    return (1 - share) * value(cell) + share * value(cell + 1);
  }

  std::span<const double> coordinates_;
  std::span<const std::int32_t> rings_;
  double first_, turn_, step_;
  std::size_t windows_;
  double width_;
  std::vector<Phasor> ring_phase_, phasor_;
  std::vector<double> phase_;  // of each window in turns, unwrapped; then the first again
  std::int64_t period_ = 0;
};

/// Estimates the phases as factors of a rank-one matrix, rings by windows, of sums of phasors.
void PhaseTrack::factor() {
  std::vector<std::size_t> of_ring(ring_phase_.size()), of_window(windows_);
  std::vector<Phasor> at(coordinates_.size());
  std::vector<std::size_t> window(coordinates_.size());
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double place = coordinates_[i] - first_;
    at[i] = unit(place / step_);
    window[i] = window_of(place);
    ++of_ring[static_cast<std::size_t>(rings_[i])];
    ++of_window[window[i]];
  }
  ring_phase_[static_cast<std::size_t>(std::ranges::max_element(of_ring) - of_ring.begin())] = 1;
  for (int pass = 0; pass < 4; ++pass) {
    std::ranges::fill(phasor_, Phasor(0));
    for (std::size_t i = 0; i < at.size(); ++i)
      phasor_[window[i]] += at[i] * std::conj(ring_phase_[static_cast<std::size_t>(rings_[i])]);
    std::ranges::fill(ring_phase_, Phasor(0));
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Phasor sum = phasor_[window[i]];
      const double length = length_of(sum);
      if (length > 0)
        ring_phase_[static_cast<std::size_t>(rings_[i])] += at[i] * std::conj(sum) / length;
    }
    for (Phasor& phase : ring_phase_) {
      if (phase != 0.0) phase /= length_of(phase);
    }
  }
  for (std::size_t w = 0; w < windows_; ++w) {
    if (of_window[w] < least_pulses) phasor_[w] = 0;  // too few pulses
  }
}

void PhaseTrack::unwrap() {
  double last = 0;
  bool begun = false;
  for (std::size_t w = 0; w < windows_; ++w) {
    if (phasor_[w] != 0.0) {
      const double turns = phase_rad(phasor_[w]) / two_pi;
      const double next = begun ? turns - std::round(turns - last) : turns;
      if (!begun) std::fill_n(phase_.begin(), w, next);
      begun = true;
      last = next;
    }
    phase_[w] = last;
  }
  if (turn_ <= 0) return;
  period_ = std::llround(turn_ / step_ - (last - phase_[0]));
  phase_[windows_] = phase_[0] + turn_ / step_ - static_cast<double>(period_);
}

}  // namespace

FiringLattice number_firings(std::span<const double> coordinates,
                             std::span<const std::int32_t> rings, int ring_count, double turn) {
  FiringLattice lattice;
  if (coordinates.empty()) return lattice;
  const auto [low, high] = std::ranges::minmax(coordinates);
  const double first = turn > 0 ? 0 : low;
  const double extent = turn > 0 ? turn : high - low;
  const auto steps = ring_steps(coordinates, rings, ring_count, extent);
  double even = 0, reach = 0;
  for (const RingStep& ring : steps) {
    even += ring.evenness * ring.reach;
    reach += ring.reach;
  }
  lattice.evenness = reach > 0 ? even / reach : 1;
  lattice.step = steps.empty() ? (extent > 0 ? extent / 360 : 1) : coarsest(steps);
  for (int pass = 0; pass < 2; ++pass) {
    const PhaseTrack track(coordinates, rings, ring_count, first, extent, turn, lattice.step);
    lattice.step = track.refined_step();
  }
  const PhaseTrack track(coordinates, rings, ring_count, first, extent, turn, lattice.step);
  lattice.period = track.period();
  double sum = 0;
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const double place = track.steps(i);
    const double number = std::round(place);
    lattice.number.push_back(static_cast<std::int64_t>(number));
    lattice.off.push_back(static_cast<float>(place - number));
    sum += math::cos(two_pi * (place - number));
  }
  lattice.coherence = sum / static_cast<double>(coordinates.size());
  return lattice;
}

}  // namespace groundray
