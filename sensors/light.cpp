#include "sensors/light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <utility>

namespace groundray {
namespace {

constexpr double least_air_share = 1e-4;  // of its strongest stretch; weaker air is left out

// The air that light goes through delays it as the receiver's waveforms have it.
ReceiverSpec receiver_in(const LightSpec& spec, const AtmosphereSpec& air) {
  ReceiverSpec receiver = spec.receiver;
  receiver.group_index = air.group_index;
  if (receiver.noise) receiver.noise->wavelength_m = 1e-9 * spec.wavelength_nm;
  return receiver;
}

// What of an echo's energy comes from one surface.
struct SurfaceShare {
  std::size_t begin = 0, end = 0;  // in the order of ranges
  double energy_j = 0;
};

// Puts each of at most `most` hits where as many are nearer, without a branch to mispredict; false
// if two are equally far.
template <std::size_t most>
bool sort_by_counting(std::span<const Hit> hits, std::vector<std::uint32_t>& order) {
  std::array<double, most> range_m;
  range_m.fill(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < hits.size(); ++i) range_m[i] = hits[i].range_m;
  std::array<std::int64_t, most> nearer{};
  for (std::size_t j = 0; j < hits.size(); ++j) {
    const double other_m = range_m[j];
#pragma omp simd
    for (std::size_t i = 0; i < most; ++i) nearer[i] += other_m < range_m[i] ? 1 : 0;
  }
  std::array<std::uint32_t, most + 1> sorted;
  std::uint64_t taken = 0;
  std::size_t met = 0;
  for (std::uint32_t i = 0; i < hits.size(); ++i) {
    sorted[static_cast<std::size_t>(nearer[i])] = i;  // misses are behind all others
    taken |= std::uint64_t{1} << nearer[i];
    met += hits[i] ? 1 : 0;
  }
  order.assign(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(met));
  return (~taken & ((std::uint64_t{1} << met) - 1)) == 0;
}

// Lists the hits by range, equal ones as they come.
void sort_hits(std::span<const Hit> hits, std::vector<std::uint32_t>& order) {
  if (hits.size() <= 16 && sort_by_counting<16>(hits, order)) return;
  if (hits.size() <= 32 && sort_by_counting<32>(hits, order)) return;
  order.clear();
  for (std::uint32_t i = 0; i < hits.size(); ++i) {
    if (hits[i]) order.push_back(i);
  }
  std::ranges::sort(order, {}, [&](std::uint32_t i) { return std::pair(hits[i].range_m, i); });
}

// exp(x) to 3e-11 of it for |x| below this.
constexpr double small_exponent = 0.05;
double exp_of_small(double x) {
  return 1 + x * (1 + x * (1. / 2 + x * (1. / 6 + x * (1. / 24 + x * (1. / 120)))));
}

}  // namespace

Light::Light(const LightSpec& spec, const AtmosphereSpec& air, const RangeGate& gate)
    : spec_(spec),
      gate_(gate),
      atmosphere_(air, spec.wavelength_nm),
      radar_(spec.optics),
      receiver_(spec.pulse, receiver_in(spec, air)),
      resolution_m_(speed_of_light_m_per_s * receiver_.pulse().fwhm_s() / 4),
      perpendicular_w_m2_(radar_.energy_area_j_m2() / std::numbers::pi *
                          receiver_.pulse().peak_per_s()),
      sun_w_(radar_.solar_power_w(spec.sun, 1)) {
  if (atmosphere_.backscatter_per_m_sr() > 0) sample_air(air);
}

void Light::sample_air(const AtmosphereSpec& air) {
  const double step_m = speed_of_light_m_per_s / air.group_index * receiver_.interval_s() / 2;
  constexpr double farthest_m = 1e4;
  std::vector<Arrival> arrivals;
  for (const SoftReturn& stretch : atmosphere_.soft_return(
           radar_, spec_.overlap, {step_m, std::min(gate_.far_m, farthest_m), least_air_share}))
    arrivals.push_back({stretch.range_m, stretch.energy_j});
  Waveform waveform;
  receiver_.sample(arrivals, waveform);
  const auto segments = waveform.segments();
  if (segments.empty()) return;
  first_air_bin_ = segments.front().bins.begin;
  air_w_.resize(static_cast<std::size_t>(segments.back().bins.end - first_air_bin_));
  for (const Waveform::Segment& segment : segments) {
    std::ranges::copy(waveform.power_w(segment),
                      air_w_.begin() + (segment.bins.begin - first_air_bin_));
  }
}

void Light::collect(std::span<const Ray> rays, std::span<const Hit> hits, const RetroBrdf& brdf,
                    Workspace& work) const noexcept {
  sort_hits(hits, work.order);
  const std::size_t count = work.order.size();
  work.arrivals.resize(count);
  if (count == 0) return;
  Arrival* const arrivals = work.arrivals.data();
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t i = work.order[k];
    const double cosine = std::max(-glm::dot(rays[i].direction, glm::dvec3(hits[i].normal)), 0.0);
    arrivals[k] = {hits[i].range_m, retro_brdf_cos(brdf, cosine)};
  }
  const double share = 1.0 / static_cast<double>(hits.size());
  const auto receive = [&](Arrival& arrival, double transmission) {
    arrival.energy_j =
        radar_.received_energy_j(share, arrival.energy_j, arrival.range_m, transmission);
  };
  const double nearest_m = arrivals[0].range_m;
  const double extinction_per_m = atmosphere_.extinction_per_m();
  if (extinction_per_m * (arrivals[count - 1].range_m - nearest_m) < small_exponent) {
    const double to_nearest = atmosphere_.transmission(nearest_m);  // one exponential serves all
    for (std::size_t k = 0; k < count; ++k) {
      const double exponent = extinction_per_m * (nearest_m - arrivals[k].range_m);
      receive(arrivals[k], to_nearest * exp_of_small(exponent));
    }
  } else {
    for (std::size_t k = 0; k < count; ++k)
      receive(arrivals[k], atmosphere_.transmission(arrivals[k].range_m));
  }
}

// Air behind a surface is not lit. It ends there at once, which is exact but for a pulse's length.
void Light::add_air(std::span<const Hit> hits, Workspace& work) const noexcept {
  work.air_w = air_w_;
  const float share = 1.0f / static_cast<float>(hits.size());
  for (const Arrival& arrival : work.arrivals) {
    const auto end = static_cast<std::int64_t>(
        std::ceil(receiver_.arrival_s(arrival.range_m) / receiver_.interval_s()));
    for (auto bin = static_cast<std::size_t>(std::max<std::int64_t>(end - first_air_bin_, 0));
         bin < work.air_w.size(); ++bin)
      work.air_w[bin] -= share * air_w_[bin];
  }
  work.waveform.add(first_air_bin_, work.air_w);
}

void Light::receive(std::span<const Ray> rays, std::span<const Hit> hits,
                    std::span<const double> bounds_m, const RetroBrdf& brdf, const RandomKey& key,
                    Workspace& work) const noexcept {
  collect(rays, hits, brdf, work);
  if (air_w_.empty()) {
    receiver_.sample(work.arrivals, work.waveform);
  } else {
    receiver_.sample(work.arrivals, work.waveform,
                     {first_air_bin_, first_air_bin_ + static_cast<std::int64_t>(air_w_.size())});
    add_air(hits, work);
  }
  const double lit = static_cast<double>(work.arrivals.size()) / static_cast<double>(hits.size());
  const double background_w = sun_w_ * std::numbers::pi * brdf.diffuse_per_sr * lit;
  receiver_.detect(work.waveform, gate_, {key, background_w}, work.detections);
  work.echoes.clear();
  for (const Detection& detection : work.detections)
    tell_truth(rays, hits, bounds_m, detection, work);
  if (work.echoes.empty()) work.reason = reason_for_none(hits, work);
}

// The hits within an echo, by range, fall into surfaces where they are farther apart than two
// surfaces can be told apart.
void Light::tell_truth(std::span<const Ray> rays, std::span<const Hit> hits,
                       std::span<const double> bounds_m, const Detection& detection,
                       Workspace& work) const noexcept {
  Echo& echo = work.echoes.emplace_back();
  echo.detection = detection;
  SurfaceShare best, second, now;
  double energy_j = 0;
  const auto close = [&](const SurfaceShare& surface) {
    if (surface.energy_j > best.energy_j) {
      second = best;
      best = surface;
    } else if (surface.energy_j > second.energy_j) {
      second = surface;
    }
  };
  const auto arrival_s = [&](const Arrival& a) { return receiver_.arrival_s(a.range_m); };
  const auto all_begin = work.arrivals.begin(), all_end = work.arrivals.end();
  const auto begin = std::ranges::lower_bound(all_begin, all_end, detection.begin_s, {}, arrival_s);
  const auto end = std::ranges::lower_bound(begin, all_end, detection.end_s, {}, arrival_s);
  double last_m = -std::numeric_limits<double>::infinity();
  for (auto arrival = begin; arrival != end; ++arrival) {
    const auto k = static_cast<std::size_t>(arrival - all_begin);
    if (arrival->range_m - last_m > resolution_m_) {
      close(now);
      now = {k, k, 0};
    }
    last_m = arrival->range_m;
    now.end = k + 1;
    now.energy_j += arrival->energy_j;
    energy_j += arrival->energy_j;
  }
  close(now);
  if (detection.kind == Detection::Kind::FalseAlarm || best.energy_j == 0) {
    echo.kind =
        detection.kind == Detection::Kind::FalseAlarm ? Echo::Kind::FalseAlarm : Echo::Kind::Air;
    return;
  }
  glm::dvec3 normal(0);
  const double per_energy = 1 / best.energy_j;
  for (std::size_t k = best.begin; k < best.end; ++k) {
    const std::uint32_t i = work.order[k];
    const double weight = work.arrivals[k].energy_j * per_energy;
    echo.range_m += weight * hits[i].range_m;
    echo.p_DQ += weight * (rays[i].origin + rays[i].direction * hits[i].range_m);
    normal += weight * glm::dvec3(hits[i].normal);
    echo.deviation_m = std::max(echo.deviation_m, hits[i].deviation_m);
    if (!bounds_m.empty()) echo.bound_m = std::max(echo.bound_m, bounds_m[i]);
  }
  echo.normal = glm::vec3(glm::normalize(normal));
  echo.share = static_cast<float>(best.energy_j / energy_j);
  echo.second_share = static_cast<float>(second.energy_j / energy_j);
}

NoReturn Light::reason_for_none(std::span<const Hit> hits, const Workspace& work) const noexcept {
  if (work.order.empty()) return NoReturn::Sky;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : work.order) {
    const double range_m = hits[i].range_m;
    if (gate_.near_m <= range_m && range_m <= gate_.far_m) nearest_m = std::min(nearest_m, range_m);
  }
  if (nearest_m == std::numeric_limits<double>::infinity()) return NoReturn::OutOfGate;
  float peak_w = 0;
  for (const Waveform::Segment& segment : work.waveform.segments())
    peak_w = std::max(peak_w, std::ranges::max(work.waveform.power_w(segment)));
  // Only the second of one echo is not reported at all.
  if (spec_.receiver.returns == ReceiverSpec::Returns::Second && peak_w > receiver_.threshold_w(0))
    return NoReturn::Blanked;
  const double left = atmosphere_.transmission(nearest_m);
  return left < 1 && peak_w / (left * left) > receiver_.threshold_w(0) ? NoReturn::Absorbed
                                                                       : NoReturn::BelowThreshold;
}

double Light::reported_m(double range_m) const noexcept {
  const double step_m = spec_.range_step_m;
  return step_m > 0 ? std::round(range_m / step_m) * step_m : range_m;
}

float Light::intensity(const Detection& detection) const noexcept {
  const IntensitySpec& spec = spec_.intensity;
  if (spec.scale == IntensitySpec::Scale::Power)
    return static_cast<float>(spec.gain * detection.power_w);
  const double reflectance =
      detection.power_w * detection.range_m * detection.range_m / perpendicular_w_m2_;
  if (spec.scale == IntensitySpec::Scale::Reflectance) return static_cast<float>(reflectance);
  if (reflectance <= 1) return static_cast<float>(std::round(100 * reflectance));
  const double above = std::log(reflectance) / std::log(spec.full_scale_reflectance);
  return static_cast<float>(std::min(std::round(101 + 154 * above), 255.0));
}

}  // namespace groundray
