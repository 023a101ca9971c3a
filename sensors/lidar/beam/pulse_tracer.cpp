#include "sensors/lidar/beam/pulse_tracer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

#include "core/math.h"

namespace groundray {
namespace {

RandomKey key_of(RandomKey sweep, std::int64_t pulse, RandomStream stream) {
  sweep.pulse = static_cast<std::uint32_t>(pulse);
  sweep.stream = stream;
  return sweep;
}

}  // namespace

void PulseTracer::lay_axes(const SweepPath& sweep, std::int64_t begin, const Settings& settings,
                           const RandomKey& key) {
  poses_.clear();
  const std::size_t count = pulses_.size();
  volley_of_.resize(count);
  axes_.resize(alone_ ? 0 : count);
  const bool needs_horizontals =
      settings.beam.sub_rays(0).size() > 1 || settings.angular_jitter_rad > 0;
  horizontals_.resize(needs_horizontals ? count : 0);
  for (const PulseBatch::Volley& volley : pulses_.volleys) {
    const std::chrono::nanoseconds time(std::llround(volley.time_s * 1e9));
    const Pose X_DS = sweep.X_DS.pose_at(time);
    const SensorPose pose{
        glm::mat3_cast(X_DS.rotation), X_DS.translation_m,
        static_cast<float>(1e-9 * static_cast<double>((time - sweep.stamp).count()))};
    for (std::size_t i = volley.begin; i < volley.end; ++i) {
      volley_of_[i] = static_cast<std::uint32_t>(poses_.size());
      const glm::dvec3& origin_m = pulses_.origin_m[i];
      Ray& axis = alone_ ? rays_[ranges_[i].first] : axes_[i];
      axis = {origin_m == glm::dvec3(0) ? pose.p_DS : pose.p_DS + pose.R_DS * origin_m,
              pose.R_DS * pulses_.direction[i], settings.far_m, time};
      if (needs_horizontals) horizontals_[i] = pose.R_DS * pulses_.horizontal[i];
    }
    poses_.push_back(pose);
  }
  if (settings.angular_jitter_rad == 0) return;
  for (std::size_t i = 0; i < count; ++i) {
    glm::dvec3& direction = (alone_ ? rays_[ranges_[i].first] : axes_[i]).direction;
    const auto pulse = begin + static_cast<std::int64_t>(i);
    const glm::dvec2 off = settings.angular_jitter_rad *
                           random_normal(key_of(key, pulse, RandomStream::AngularJitter));
    const glm::dvec3 vertical = glm::cross(direction, horizontals_[i]);
    direction = glm::normalize(direction + off.x * horizontals_[i] + off.y * vertical);
    horizontals_[i] =
        glm::normalize(horizontals_[i] - glm::dot(horizontals_[i], direction) * direction);
  }
}

void PulseTracer::add_sub_rays(std::size_t pulse, int level, const LaserBeam& beam,
                               const RandomKey& key, Ray* out) const {
  // Copies: `out` could alias them, and the compiler would reload them.
  const Ray axis = this->axis(pulse);
  const glm::dvec3 horizontal = horizontals_[pulse];
  const glm::dvec3 vertical = glm::cross(axis.direction, horizontal);
  const auto sub_rays = beam.sub_rays(level);
  LaserBeam::Rotation turn;
  const bool turns = beam.turn() == BeamSpec::Turn::EachPulse;
  if (turns) {
    const auto number = begin_ + static_cast<std::int64_t>(pulse);
    const double angle_rad =
        2 * std::numbers::pi * random_uniform(key_of(key, number, RandomStream::BeamTurn)).x;
    turn = {math::cos(angle_rad), math::sin(angle_rad)};
  }
  const auto lay = [&](const LaserBeam::SubRay& to, Ray& ray) {
    ray.origin = axis.origin + to.offset_m.x * horizontal + to.offset_m.y * vertical;
    ray.direction = axis.direction + to.slope.x * horizontal + to.slope.y * vertical;
    ray.direction *= to.per_length;
    ray.far_m = axis.far_m;
    ray.time = axis.time;
  };
  for (std::size_t i = 0; i < sub_rays.size(); ++i)
    turns ? lay(beam.turned(level, i, turn), out[i]) : lay(sub_rays[i], out[i]);
}

void PulseTracer::cast(const SweepPath& sweep, std::int64_t begin, std::int64_t end,
                       const Settings& settings, const RandomKey& key, const Scene& scene) {
  begin_ = begin;
  sweep.pattern.fill(sweep.number, begin, end, pulses_);
  const std::size_t count = pulses_.size();
  const std::size_t sub_rays = settings.beam.sub_rays(0).size();
  alone_ = sub_rays == 1;
  rays_.resize(count * sub_rays);
  ranges_.resize(count);
  const auto stride = static_cast<std::size_t>(std::clamp<std::int64_t>(
      sweep.pattern.neighbour_stride(), 1, static_cast<std::int64_t>(count)));
  // Pulses with similar directions are stored next to each other, so that packets of rays are
  // coherent.
  std::size_t first = 0;
  for (std::size_t column = 0; column < stride; ++column) {
    for (std::size_t i = column; i < count; i += stride, first += sub_rays)
      ranges_[i] = {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(sub_rays), 0};
  }
  lay_axes(sweep, begin, settings, key);
  for (std::size_t i = 0; i < count && !alone_; ++i)
    add_sub_rays(i, 0, settings.beam, key, &rays_[ranges_[i].first]);
  hits_.resize(rays_.size());
  scene.trace(rays_, hits_);
  if (settings.last_level > 0) refine(settings, key, scene);
}

bool PulseTracer::is_coarse(std::size_t pulse, const Settings& settings) const {
  const auto met = hits(pulse);
  const auto differ = [&](const glm::ivec2& pair) {
    const Hit& a = met[static_cast<std::size_t>(pair.x)];
    const Hit& b = met[static_cast<std::size_t>(pair.y)];
    if (!a || !b) return static_cast<bool>(a) != static_cast<bool>(b);
    return std::abs(a.range_m - b.range_m) > settings.resolution_m;
  };
  return std::ranges::any_of(settings.beam.neighbours(ranges_[pulse].level), differ) &&
         !(settings.planes &&
           settings.planes->plane_of(settings.beam, pulse_axis(pulse), rays(pulse), met));
}

void PulseTracer::refine(const Settings& settings, const RandomKey& key, const Scene& scene) {
  coarse_.clear();
  for (std::uint32_t i = 0; i < size(); ++i) {
    if (is_coarse(i, settings)) coarse_.push_back(i);
  }
  for (int level = 1; level <= settings.last_level && !coarse_.empty(); ++level) {
    const std::size_t sub_rays = settings.beam.sub_rays(level).size();
    const std::size_t before = rays_.size();
    rays_.resize(before + coarse_.size() * sub_rays);
    hits_.resize(rays_.size());
    std::size_t first = before;
    for (const std::uint32_t i : coarse_) {
      ranges_[i] = {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(sub_rays), level};
      add_sub_rays(i, level, settings.beam, key, &rays_[first]);
      first += sub_rays;
    }
    scene.trace(std::span(rays_).subspan(before), std::span(hits_).subspan(before));
    std::erase_if(coarse_, [&](std::uint32_t i) { return !is_coarse(i, settings); });
  }
}

void PulseTracer::cast_again(std::size_t pulse, int level, const LaserBeam& beam,
                             const RandomKey& key, const Scene& scene, std::vector<Ray>& rays,
                             std::vector<Hit>& hits) const {
  rays.resize(beam.sub_rays(level).size());
  hits.resize(rays.size());
  add_sub_rays(pulse, level, beam, key, rays.data());
  scene.trace(rays, hits);
}

}  // namespace groundray
