#include "sensors/lidar/echo_simulator.h"

#include <cmath>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/math.h"
#include "sensors/lidar/hit_order.h"

namespace groundray {
namespace {

constexpr double least_air_share = 1e-4;  // fraction of the strongest step; weaker air is omitted

// Returns the receiver's spec with the air's group index and the laser's wavelength.
ReceiverSpec receiver_in(const LightSpec& spec, const AtmosphereSpec& air) {
  ReceiverSpec receiver = spec.receiver;
  receiver.group_index = air.group_index;
  if (receiver.noise) receiver.noise->wavelength_m = 1e-9 * spec.wavelength_nm;
  return receiver;
}

// Returns a function that returns the share of a pulse's energy that a sub-ray has.
auto shares_of(const LitPulse& pulse) {
  const double equal = 1.0 / static_cast<double>(pulse.hits.size());
  return
      [shares = pulse.shares, equal](std::size_t i) { return shares.empty() ? equal : shares[i]; };
}

// Facets of one plane and those of parallel planes: their normals differ by less than 1e-3 rad.
constexpr double parallel_cosine = 1 - 5e-7;

// Returns whether two hits of one object, the nearer one first, belong to one surface. The plane of
// a hit predicts the range of the other; where it does not, their ranges count.
bool are_joined(const LitPulse& pulse, std::uint32_t near, std::uint32_t far, double resolution_m) {
  const auto point = [&](std::uint32_t i) {
    return pulse.rays[i].origin + pulse.rays[i].direction * pulse.hits[i].range_m;
  };
  const glm::dvec3 apart = point(far) - point(near);
  const auto predicts = [&](const glm::dvec3& normal, std::uint32_t other) {
    return std::abs(glm::dot(normal, apart)) <=
           resolution_m * std::abs(glm::dot(normal, pulse.rays[other].direction));
  };
  const glm::dvec3 near_normal(pulse.hits[near].normal), far_normal(pulse.hits[far].normal);
  if (glm::dot(near_normal, far_normal) > parallel_cosine) return predicts(near_normal, far);
  return pulse.hits[far].range_m - pulse.hits[near].range_m <= resolution_m ||
         (predicts(near_normal, far) && predicts(far_normal, near));
}

// Divides arrivals [begin, end), sorted by range, into surfaces.
void part_surfaces(const LitPulse& pulse, std::size_t begin, std::size_t end, double resolution_m,
                   EchoSimulator::Workspace& work) {
  work.surfaces.clear();
  work.surface_of.assign(end - begin, 0);
  if (begin == end) return;
  const auto hit_of = [&](std::size_t k) -> const Hit& { return pulse.hits[work.order[k]]; };
  const auto add = [&](std::size_t k, LitSurface& surface) {
    const double energy_j = work.arrivals[k].energy_j;
    surface.last = k;
    surface.energy_j += energy_j;
    if (energy_j > surface.strongest_j) {
      surface.strongest_j = energy_j;
      surface.strongest = k;
    }
  };
  const bool unresolved =
      work.arrivals[end - 1].range_m - work.arrivals[begin].range_m <= resolution_m;
  LitSurface nearest{.object = hit_of(begin).object};
  std::size_t k = begin;
  while (k < end && (unresolved || k == begin) && hit_of(k).object == nearest.object)
    add(k++, nearest);
  work.surfaces.push_back(nearest);
  for (; k < end; ++k) {
    const std::uint32_t object = hit_of(k).object;
    const auto continues = [&](const LitSurface& surface) {
      return surface.object == object && (unresolved || are_joined(pulse, work.order[surface.last],
                                                                   work.order[k], resolution_m));
    };
    std::size_t at = work.surfaces.size();
    while (at > 0 && !continues(work.surfaces[at - 1])) --at;
    if (at == 0) {
      work.surfaces.push_back({.object = object});
      at = work.surfaces.size();
    }
    add(k, work.surfaces[at - 1]);
    work.surface_of[k - begin] = static_cast<std::uint32_t>(at - 1);
  }
}

// The two surfaces with the most energy; one without energy represents none.
struct EnergyShares {
  LitSurface best, second;
  std::size_t best_number = 0;
  double energy_j = 0;
};
EnergyShares strongest_of(std::span<const LitSurface> surfaces) {
  EnergyShares shares;
  for (std::size_t n = 0; n < surfaces.size(); ++n) {
    shares.energy_j += surfaces[n].energy_j;
    if (surfaces[n].energy_j > shares.best.energy_j) {
      shares.second = shares.best;
      shares.best = surfaces[n];
      shares.best_number = n;
    } else if (surfaces[n].energy_j > shares.second.energy_j) {
      shares.second = surfaces[n];
    }
  }
  return shares;
}

// Bound of |x| within which exp_of_small has a relative error below 3e-11.
constexpr double small_exponent = 0.05;
double exp_of_small(double x) {
  return 1 + x * (1 + x * (1. / 2 + x * (1. / 6 + x * (1. / 24 + x * (1. / 120)))));
}

}  // namespace

RetroBrdfs::RetroBrdfs(const Scene& scene, double wavelength_nm, const LaserBeam& beam)
    : scene_(scene),
      by_material_(scene.materials.retro_brdfs(wavelength_nm)),
      is_plain_(scene.is_plain()),
      beam_(beam) {
  const auto check = [&](std::uint16_t material) {
    if (material >= by_material_.size()) {
      throw Error(
          "scene: a surface has material {}, but there are {} materials: a lidar with light needs "
          "all of them",
          material, by_material_.size());
    }
  };
  for (const ModelTruth& model : scene.models) std::ranges::for_each(model.materials, check);
  for (const CoverLayer& layer : scene.cover.layers()) check(layer.material);
  if (!scene.cover.empty()) return;
  check(scene.terrain.material);
  ground_ = by_material_[scene.terrain.material];
}

// The footprint of a sub-ray is modelled as a square; its variance is that of a Gaussian beam
// divided by the number of sub-rays.
RetroBrdfs::Reflection RetroBrdfs::varied_reflection(const Ray& ray, const Hit& hit, double cosine,
                                                     std::size_t sub_rays) const noexcept {
  const glm::dvec2 radius_m = beam_.radius_m(hit.range_m);
  const double width_m = std::sqrt(3 * radius_m.x * radius_m.y / static_cast<double>(sub_rays));
  const Appearance appearance = scene_.appearance_of(ray, hit, width_m, Filtering::Fast);
  Reflection sum;
  for (std::uint32_t i = 0; i < appearance.count; ++i) {
    const auto& [material, share, tint] = appearance.parts[i];
    const RetroBrdf& brdf = by_material_[material];
    const double weight = share;
    sum.retro_cos_per_sr += weight * tinted_retro_brdf_cos(brdf, cosine, tint.brightness);
    sum.albedo += weight * tinted_albedo(brdf, tint.brightness);
  }
  return sum;
}

EchoSimulator::EchoSimulator(const LightSpec& spec, const AtmosphereSpec& air,
                             const RangeGate& gate)
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

void EchoSimulator::sample_air(const AtmosphereSpec& air) {
  const double step_m = speed_of_light_m_per_s / air.group_index * receiver_.interval_s() / 2;
  constexpr double farthest_m = 1e4;
  std::vector<Arrival> arrivals;
  for (const SoftReturn& stretch :
       radar_.soft_return(atmosphere_, spec_.overlap,
                          {step_m, std::min(gate_.far_m, farthest_m), least_air_share}))
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

double EchoSimulator::even_spacing_m() const {
  constexpr double least_intervals = 1.0 / 16;
  const double least_s = least_intervals * receiver_.interval_s();
  return receiver_.pulse().even_spacing_s(least_s) / receiver_.arrival_s(1);
}

void EchoSimulator::collect(const LitPulse& pulse, const RetroBrdfs& brdfs, double extinction_per_m,
                            Workspace& work) const {
  sort_hits(pulse.hits, work.order);
  const std::size_t count = work.order.size();
  work.arrivals.resize(count);
  work.sunlit = 0;
  if (count == 0) return;
  work.seen.resize(count);
  Arrival* const arrivals = work.arrivals.data();
  double* const seen = work.seen.data();
  const auto share = shares_of(pulse);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t i = work.order[k];
    const Hit& hit = pulse.hits[i];
    const auto [retro_cos_per_sr, albedo] = brdfs.reflection_of(pulse.rays[i], hit, pulse.traced);
    arrivals[k] = {hit.range_m, retro_cos_per_sr};
    seen[k] = share(i) * overlap_share(spec_.overlap, hit.range_m);
    if (sun_w_ > 0) work.sunlit += share(i) * albedo * sun_cosine(hit.normal);
  }
  const auto receive = [&](std::size_t k, double transmission) {
    const auto [range_m, retro_cos_per_sr] = arrivals[k];
    const double energy_j =
        radar_.received_energy_j(seen[k], retro_cos_per_sr, range_m, transmission);
    arrivals[k].energy_j = seen[k] > 0 ? energy_j : 0;
  };
  const double nearest_m = arrivals[0].range_m;
  if (extinction_per_m * (arrivals[count - 1].range_m - nearest_m) < small_exponent) {
    const double to_nearest = math::exp(-extinction_per_m * nearest_m);  // one exponential for all
#pragma omp simd
    for (std::size_t k = 0; k < count; ++k)
      receive(k, to_nearest * exp_of_small(extinction_per_m * (nearest_m - arrivals[k].range_m)));
  } else {
    for (std::size_t k = 0; k < count; ++k)
      receive(k, math::exp(-extinction_per_m * arrivals[k].range_m));
  }
}

// Removes the return of the air behind each surface, which is not lit. It ends there abruptly,
// which is exact except within the length of a pulse.
void EchoSimulator::add_air(const LitPulse& pulse, Workspace& work) const {
  constexpr double rounding = 1e-12;  // of the sum of all shares
  work.air_w.resize(air_w_.size());
  const auto share = shares_of(pulse);
  double lit = 1;
  std::size_t bin = 0;
  const auto fill = [&](std::size_t end) {
    const float factor = lit > rounding ? static_cast<float>(lit) : 0.0f;
    for (; bin < end; ++bin) work.air_w[bin] = factor * air_w_[bin];
  };
  for (std::size_t k = 0; k < work.arrivals.size(); ++k) {
    const double end = std::ceil(receiver_.arrival_s(work.arrivals[k].range_m) / interval_s()) -
                       static_cast<double>(first_air_bin_);
    fill(static_cast<std::size_t>(std::clamp(end, 0.0, static_cast<double>(air_w_.size()))));
    lit -= share(work.order[k]);
  }
  fill(air_w_.size());
  work.waveform.add(first_air_bin_, work.air_w);
}

double EchoSimulator::air_energy_j(const Detection& detection,
                                   const Workspace& work) const noexcept {
  if (air_w_.empty()) return 0;
  const auto bin_of = [&](double time_s) {
    const double bin = time_s / interval_s() - static_cast<double>(first_air_bin_);
    return static_cast<std::ptrdiff_t>(
        std::clamp(std::round(bin), 0.0, static_cast<double>(work.air_w.size())));
  };
  const auto first = work.air_w.begin();
  return interval_s() *
         std::accumulate(first + bin_of(detection.begin_s), first + bin_of(detection.end_s), 0.0);
}

void EchoSimulator::receive(const LitPulse& pulse, const RetroBrdfs& brdfs, const RandomKey& key,
                            Workspace& work) const {
  collect(pulse, brdfs, atmosphere_.extinction_per_m(), work);
  if (air_w_.empty()) {
    receiver_.sample(work.arrivals, work.waveform);
  } else {
    receiver_.sample(work.arrivals, work.waveform,
                     {first_air_bin_, first_air_bin_ + static_cast<std::int64_t>(air_w_.size())});
    add_air(pulse, work);
  }
  receiver_.detect(work.waveform, gate_, {key, sun_w_ * work.sunlit}, work.detections);
  work.echoes.clear();
  for (const Detection& detection : work.detections) attribute_echo(pulse, detection, work);
  if (work.echoes.empty()) work.reason = reason_for_none(pulse, brdfs, work);
}

void EchoSimulator::attribute_echo(const LitPulse& pulse, const Detection& detection,
                                   Workspace& work) const {
  Echo& echo = work.echoes.emplace_back();
  echo.detection = detection;
  const auto arrival_s = [&](const Arrival& a) { return receiver_.arrival_s(a.range_m); };
  const auto all_begin = work.arrivals.begin(), all_end = work.arrivals.end();
  const auto begin = std::ranges::lower_bound(all_begin, all_end, detection.begin_s, {}, arrival_s);
  const auto end = std::ranges::lower_bound(begin, all_end, detection.end_s, {}, arrival_s);
  const auto first = static_cast<std::size_t>(begin - all_begin);
  part_surfaces(pulse, first, static_cast<std::size_t>(end - all_begin), resolution_m_, work);
  const auto [best, second, best_number, energy_j] = strongest_of(work.surfaces);
  const double air_j = air_energy_j(detection, work);
  if (detection.kind == Detection::Kind::FalseAlarm || best.energy_j <= air_j) {
    echo.kind =
        detection.kind == Detection::Kind::FalseAlarm ? Echo::Kind::FalseAlarm : Echo::Kind::Air;
    return;
  }
  // Local sums: the echo could alias the hits, and the compiler would store and reload it.
  double range_m = 0, bound_m = 0;
  glm::dvec3 p_DQ(0), normal(0);
  float deviation_m = 0;
  const double per_energy = 1 / best.energy_j;
  for (std::size_t k = 0; k < work.surface_of.size(); ++k) {
    if (work.surface_of[k] != best_number) continue;
    const std::uint32_t i = work.order[first + k];
    const double weight = work.arrivals[first + k].energy_j * per_energy;
    const Ray& ray = pulse.rays[i];
    const Hit& hit = pulse.hits[i];
    range_m += weight * hit.range_m;
    p_DQ += weight * (ray.origin + ray.direction * hit.range_m);
    normal += weight * glm::dvec3(hit.normal);
    deviation_m = std::max(deviation_m, hit.deviation_m);
    if (!pulse.bounds_m.empty()) bound_m = std::max(bound_m, pulse.bounds_m[i]);
  }
  echo.range_m = range_m;
  echo.p_DQ = p_DQ;
  echo.normal = glm::vec3(glm::normalize(normal));
  echo.deviation_m = deviation_m;
  echo.bound_m = bound_m;
  echo.share = static_cast<float>(best.energy_j / (energy_j + air_j));
  echo.second_share = static_cast<float>(second.energy_j / (energy_j + air_j));
  echo.hit = work.order[best.strongest];
  if (second.energy_j > 0) echo.second_hit = work.order[second.strongest];
}

// Overwrites the arrivals, which are no longer needed.
NoReturn EchoSimulator::reason_for_none(const LitPulse& pulse, const RetroBrdfs& brdfs,
                                        Workspace& work) const {
  if (work.order.empty()) return NoReturn::Sky;
  const auto outside = [&](const Arrival& arrival) {
    return arrival.range_m < gate_.near_m || gate_.far_m < arrival.range_m;
  };
  if (std::ranges::all_of(work.arrivals, outside)) return NoReturn::OutOfGate;
  const auto above_threshold = [&](const Waveform& waveform) {
    return std::ranges::any_of(waveform.segments(), [&](const Waveform::Segment& segment) {
      return std::ranges::max(waveform.power_w(segment)) > receiver_.threshold_w(0);
    });
  };
  // Returns::Second reports nothing if there is only one echo; all others report something.
  const bool second_alone = spec_.receiver.returns == ReceiverSpec::Returns::Second;
  if (second_alone && above_threshold(work.waveform)) return NoReturn::Blanked;
  if (atmosphere_.extinction_per_m() == 0) return NoReturn::BelowThreshold;
  collect(pulse, brdfs, 0, work);
  std::erase_if(work.arrivals, outside);
  receiver_.sample(work.arrivals, work.clear_waveform);
  return above_threshold(work.clear_waveform) ? NoReturn::Absorbed : NoReturn::BelowThreshold;
}

double EchoSimulator::reported_m(double range_m) const noexcept {
  const double step_m = spec_.range_step_m;
  return step_m > 0 ? std::round(range_m / step_m) * step_m : range_m;
}

double EchoSimulator::reported_sd_m(double sd_m) const noexcept {
  return math::hypot(sd_m, spec_.range_step_m / std::sqrt(12.0));
}

float EchoSimulator::intensity(const Detection& detection) const noexcept {
  const IntensitySpec& spec = spec_.intensity;
  if (spec.scale == IntensitySpec::Scale::Power)
    return static_cast<float>(spec.gain * detection.power_w);
  const double reflectance =
      detection.power_w * detection.range_m * detection.range_m / perpendicular_w_m2_;
  if (spec.scale == IntensitySpec::Scale::Reflectance) return static_cast<float>(reflectance);
  if (reflectance <= 1) return static_cast<float>(std::round(100 * reflectance));
  const double above = math::log(reflectance) / math::log(spec.full_scale_reflectance);
  return static_cast<float>(std::min(std::round(101 + 154 * above), 255.0));
}

}  // namespace groundray
