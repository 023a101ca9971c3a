#include "sensors/lidar/lidar_sweep.h"

#include <tbb/concurrent_queue.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "sensors/lidar/beam/pulse_tracer.h"
#include "sensors/lidar/scan_columns.h"

namespace groundray {
namespace {

constexpr std::size_t chunk_rays = 2048;    // traced at once by a thread
constexpr std::size_t most_rays = 262'144;  // limit if a whole chunk is refined to the last level
constexpr std::int64_t convergence_stride = 64;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

SweepPath path_of(const ScanPattern& pattern, const Trajectory& X_DS, std::int64_t number) {
  const std::chrono::nanoseconds stamp = pattern.stamp(number);
  const std::chrono::nanoseconds end = pattern.last_firing(number);
  if (stamp < X_DS.begin_time() || X_DS.end_time() < end) {
    throw Error(
        "lidar: sweep {} fires from {:.6f} s to {:.6f} s but the sensor's trajectory covers "
        "[{:.6f}, {:.6f}] s",
        number, 1e-9 * static_cast<double>(stamp.count()), 1e-9 * static_cast<double>(end.count()),
        1e-9 * static_cast<double>(X_DS.begin_time().count()),
        1e-9 * static_cast<double>(X_DS.end_time().count()));
  }
  return {pattern, X_DS, number, stamp};
}

// Returns the number of pulses in a chunk: whole firing sequences if these are short.
std::int64_t pulses_per_chunk(const ScanPattern& pattern, const LidarParts& lidar) {
  const std::size_t first = lidar.beam.sub_rays(0).size();
  const std::size_t last = lidar.beam.sub_rays(lidar.last_level).size();
  const auto most = static_cast<std::int64_t>(
      std::clamp<std::size_t>(std::max<std::size_t>(chunk_rays / first, 16), 1,
                              std::max<std::size_t>(most_rays / last, 1)));
  const std::int64_t stride = pattern.neighbour_stride();
  return stride < most ? most / stride * stride : most;
}

// With light, surfaces beyond the gate matter: they reflect sunlight, form edges that require
// refinement, and may return an echo that begins within the gate.
double rays_end_m(const LidarSpec& spec) {
  const bool on = spec.light || spec.no_returns == LidarSpec::NoReturns::Report;
  return on ? std::numeric_limits<double>::infinity() : spec.gate.far_m;
}

// Row of a scan with light.
struct LightRow {
  EchoRow row;
  Echo echo;
  std::uint32_t pulse;
  std::uint16_t second_label;
  glm::vec3 velocity_m_s;
};

// Some pulses of a sweep on their way through the pipeline. The buffers are reused.
struct Chunk {
  std::int64_t begin = 0, end = 0;  // pulses of the sweep
  std::size_t rows = 0;             // number of echoes
  std::size_t first_row = 0;
  PulseTracer cast;
  std::vector<double> bounds_m;  // error bounds of all hits, if requested
  // Only with light:
  EchoSimulator::Workspace work;
  std::vector<LightRow> light_rows;
  std::vector<WaveformRun> runs;
  std::vector<float> power_w;
  Convergence convergence;
  std::vector<Ray> rays_again;
  std::vector<Hit> hits_again;

  struct Missed {
    std::uint32_t pulse;  // index in the chunk
    NoReturn reason;
  };
  std::vector<Missed> missed;
};

// Computation of one sweep.
class Sweep {
 public:
  Sweep(const LidarParts& lidar, const Scene& scene, const Trajectory& X_DS, std::int64_t number,
        const RandomKey& key, const SweepWatch& watch)
      : lidar_(lidar),
        watch_(watch),
        spec_(lidar.spec),
        scene_(scene),
        path_(path_of(lidar.pattern, X_DS, number)),
        key_(key),
        pulses_(lidar.pattern.pulses(number)),
        settings_{lidar.beam, lidar.last_level, lidar.light ? lidar.light->resolution_m() : 0,
                  spec_.angular_jitter_rad, rays_end_m(spec_)} {
    if (lidar.light) brdfs_.emplace(scene, lidar.light->spec().wavelength_nm, lidar.beam);
    if (spec_.points == LidarSpec::Points::AtStamp) X_SD_ = inverse(X_DS.pose_at(path_.stamp));
  }

  LidarScan run();

 private:
  template <typename Finish>
  void stream(const Finish& finish);
  bool returns(const Hit& hit) const {
    return hit && spec_.gate.near_m <= hit.range_m && hit.range_m <= spec_.gate.far_m;
  }
  RandomKey key_of(std::int64_t pulse) const {
    RandomKey key = key_;
    key.pulse = static_cast<std::uint32_t>(pulse);
    return key;
  }
  void measure(Chunk& chunk) const;
  void measure_rays(Chunk& chunk) const;
  void measure_light(Chunk& chunk) const;
  void keep_waveform(std::uint32_t pulse, Chunk& chunk) const;
  void compare(std::size_t pulse, Chunk& chunk) const;
  void place(Chunk& chunk);
  void write(const Chunk& chunk, const ScanColumns& columns) const;
  void add_rows(std::size_t pulse, Chunk& chunk) const;
  void write_light();
  EchoRow row_of(const Echo& echo, const PulseTracer& cast, std::size_t pulse,
                 double reported_m) const;
  glm::vec3 reported_point(const PulseTracer& cast, std::size_t pulse, double reported_m) const;
  SurfaceTruth truth_at(const PulseTracer& cast, std::size_t pulse, std::uint32_t hit) const {
    return scene_.truth_of(cast.rays(pulse)[hit], cast.hits(pulse)[hit]);
  }
  double range_sd_m(const Echo& echo) const {
    return lidar_.light->reported_sd_m(
        std::hypot(echo.detection.range_sd_m, spec_.range_noise_sigma_m));
  }
  glm::vec3 velocity_m_s(const Ray& ray, const Hit& hit) const;
  glm::vec3 velocity_of(const Echo& echo, const PulseTracer& cast, std::size_t pulse) const;
  PointCloud no_returns() const;

  const LidarParts& lidar_;
  const SweepWatch& watch_;
  const LidarSpec& spec_;
  const Scene& scene_;
  SweepPath path_;
  RandomKey key_;
  std::int64_t pulses_;
  PulseTracer::Settings settings_;
  std::optional<RetroBrdfs> brdfs_;  // only with light
  Pose X_SD_;

  // Filled in firing order:
  std::size_t next_row_ = 0;
  bool is_stopped_ = false;
  struct PlacedRows {
    std::size_t first_row;
    std::vector<LightRow> rows;
  };
  std::vector<PlacedRows> light_rows_;
  LidarScan scan_;
  struct MissedPulse {
    std::uint32_t pulse;
    float time_s;
    std::uint16_t ring;
    glm::vec3 direction;
    NoReturn reason;
  };
  std::vector<MissedPulse> missed_;
};

void Sweep::measure(Chunk& chunk) const {
  chunk.cast.cast(path_, chunk.begin, chunk.end, settings_, key_, scene_);
  if (spec_.error_bound == LidarSpec::ErrorBound::Report) {
    chunk.bounds_m.resize(chunk.cast.all_rays().size());
    scene_.rays.bound_errors(chunk.cast.all_rays(), chunk.cast.all_hits(), chunk.bounds_m);
  }
  chunk.missed.clear();
  lidar_.light ? measure_light(chunk) : measure_rays(chunk);
}

void Sweep::measure_rays(Chunk& chunk) const {
  const auto hits = chunk.cast.all_hits();
  chunk.rows = static_cast<std::size_t>(
      std::ranges::count_if(hits, [this](const Hit& hit) { return returns(hit); }));
  if (spec_.no_returns == LidarSpec::NoReturns::Omit) return;
  for (std::uint32_t i = 0; i < chunk.cast.size(); ++i) {
    const Hit& hit = hits[chunk.cast.range(i).first];
    if (!returns(hit)) chunk.missed.push_back({i, hit ? NoReturn::OutOfGate : NoReturn::Sky});
  }
}

void Sweep::measure_light(Chunk& chunk) const {
  chunk.light_rows = {};  // Sweep::place has moved them away
  chunk.light_rows.reserve(chunk.cast.size());
  chunk.runs.clear();
  chunk.power_w.clear();
  chunk.convergence = {};
  const PulseTracer& cast = chunk.cast;
  for (std::uint32_t i = 0; i < cast.size(); ++i) {
    const std::int64_t pulse = chunk.begin + i;
    const auto bounds_m =
        chunk.bounds_m.empty()
            ? std::span<const double>()
            : std::span(chunk.bounds_m).subspan(cast.range(i).first, cast.range(i).count);
    lidar_.light->receive(cast.rays(i), cast.hits(i), bounds_m, *brdfs_, key_of(pulse), chunk.work);
    add_rows(i, chunk);
    if (chunk.work.echoes.empty()) chunk.missed.push_back({i, chunk.work.reason});
    if (spec_.waveforms == LidarSpec::WaveformOutput::Keep) keep_waveform(i, chunk);
    if (pulse % convergence_stride == 0) compare(i, chunk);
  }
  chunk.rows = chunk.light_rows.size();
}

void Sweep::keep_waveform(std::uint32_t pulse, Chunk& chunk) const {
  const Waveform& waveform = chunk.work.waveform;
  for (const Waveform::Segment& segment : waveform.segments()) {
    const auto power_w = waveform.power_w(segment);
    chunk.runs.push_back({static_cast<std::uint32_t>(chunk.begin) + pulse,
                          static_cast<std::uint32_t>(power_w.size()), chunk.power_w.size(),
                          static_cast<double>(segment.bins.begin) * waveform.interval_s()});
    chunk.power_w.insert(chunk.power_w.end(), power_w.begin(), power_w.end());
  }
}

// Compares the echoes with those of twice the sub-rays, both without noise.
void Sweep::compare(std::size_t pulse, Chunk& chunk) const {
  const PulseTracer& cast = chunk.cast;
  const int finer = cast.range(pulse).level + 1;
  if (finer >= lidar_.beam.levels()) return;
  const EchoSimulator& light = *lidar_.quiet_light;
  EchoSimulator::Workspace& work = chunk.work;
  light.receive(cast.rays(pulse), cast.hits(pulse), {}, *brdfs_, key_, work);
  const std::size_t echoes = work.echoes.size();
  const double first_m = echoes == 0 ? 0 : work.echoes[0].detection.range_m;
  cast.cast_again(pulse, finer, lidar_.beam, key_, scene_, chunk.rays_again, chunk.hits_again);
  light.receive(chunk.rays_again, chunk.hits_again, {}, *brdfs_, key_, work);
  Convergence& seen = chunk.convergence;
  ++seen.pulses;
  if (work.echoes.size() != echoes) {
    ++seen.changed;
  } else if (echoes > 0) {
    const double difference_m = std::abs(work.echoes[0].detection.range_m - first_m);
    ++seen.compared;
    seen.sum_squares_m2 += difference_m * difference_m;
    seen.largest_m = std::max(seen.largest_m, difference_m);
  }
}

// Called for one chunk at a time, in firing order.
void Sweep::place(Chunk& chunk) {
  chunk.first_row = next_row_;
  next_row_ += chunk.rows;
  if (lidar_.light) light_rows_.push_back({chunk.first_row, std::move(chunk.light_rows)});
  const PulseTracer& cast = chunk.cast;
  if (spec_.no_returns == LidarSpec::NoReturns::Report) {
    for (const Chunk::Missed& missed : chunk.missed) {
      missed_.push_back({static_cast<std::uint32_t>(chunk.begin) + missed.pulse,
                         cast.pose(missed.pulse).time_s, cast.pulses().ring[missed.pulse],
                         glm::vec3(cast.axis(missed.pulse).direction), missed.reason});
    }
  }
  Waveforms& waveforms = scan_.waveforms;
  for (WaveformRun run : chunk.runs) {
    run.first_sample += waveforms.power_w.size();
    waveforms.runs.push_back(run);
  }
  waveforms.power_w.insert(waveforms.power_w.end(), chunk.power_w.begin(), chunk.power_w.end());
  Convergence& all = scan_.convergence;
  all.pulses += chunk.convergence.pulses;
  all.changed += chunk.convergence.changed;
  all.compared += chunk.convergence.compared;
  all.sum_squares_m2 += chunk.convergence.sum_squares_m2;
  all.largest_m = std::max(all.largest_m, chunk.convergence.largest_m);
}

// Returns the point that the sensor reports, which does not account for angular jitter. Inline
// because it is called for every row.
inline glm::vec3 Sweep::reported_point(const PulseTracer& cast, std::size_t pulse,
                                       double reported_m) const {
  const PulseBatch& pulses = cast.pulses();
  const glm::dvec3 p_SQ = pulses.origin_m[pulse] + pulses.direction[pulse] * reported_m;
  if (spec_.points == LidarSpec::Points::AsFired) return glm::vec3(p_SQ);
  const PulseTracer::SensorPose& pose = cast.pose(pulse);
  return glm::vec3(X_SD_ * (pose.p_DS + pose.R_DS * p_SQ));
}

// Returns the velocity of the surface that a ray hits.
glm::vec3 Sweep::velocity_m_s(const Ray& ray, const Hit& hit) const {
  if (hit.object == 0) return glm::vec3(0);
  return glm::vec3(
      scene_.objects.velocity_m_s(hit.object, ray.origin + ray.direction * hit.range_m, ray.time));
}

glm::vec3 Sweep::velocity_of(const Echo& echo, const PulseTracer& cast, std::size_t pulse) const {
  if (echo.kind != Echo::Kind::Surface) return glm::vec3(0);
  const Hit& hit = cast.hits(pulse)[echo.hit];
  if (hit.object == 0) return glm::vec3(0);
  return glm::vec3(scene_.objects.velocity_m_s(hit.object, echo.p_DQ, cast.axis(pulse).time));
}

void Sweep::write(const Chunk& chunk, const ScanColumns& columns) const {
  std::size_t row = chunk.first_row;
  const PulseTracer& cast = chunk.cast;
  for (std::size_t i = 0; i < cast.size(); ++i) {
    const std::size_t at = cast.range(i).first;
    const Hit& hit = cast.all_hits()[at];
    if (!returns(hit)) continue;
    const Ray& ray = cast.all_rays()[at];
    double reported_m = hit.range_m;
    if (spec_.range_noise_sigma_m > 0) {
      reported_m += spec_.range_noise_sigma_m *
                    random_normal(key_of(chunk.begin + static_cast<std::int64_t>(i))).x;
    }
    const glm::vec3 direction(ray.direction);
    const float cos_incidence = -glm::dot(direction, hit.normal);
    columns.write(row, {.point = reported_point(cast, i, reported_m),
                        .intensity = cos_incidence,
                        .time_s = cast.pose(i).time_s,
                        .ring = cast.pulses().ring[i],
                        .range_m = hit.range_m,
                        .p_DQ = ray.origin + ray.direction * hit.range_m,
                        .normal = hit.normal,
                        .cos_incidence = cos_incidence,
                        .sin_incidence = glm::length(glm::cross(direction, hit.normal)),
                        .surface = scene_.truth_of(ray, hit),
                        .deviation_m = hit.deviation_m});
    if (columns.has_range_sd()) columns.write_range_sd(row, spec_.range_noise_sigma_m);
    if (columns.has_motion()) columns.write_velocity(row, velocity_m_s(ray, hit));
    if (columns.has_bounds()) columns.write_bound(row, chunk.bounds_m[at]);
    ++row;
  }
}

EchoRow Sweep::row_of(const Echo& echo, const PulseTracer& cast, std::size_t pulse,
                      double reported_m) const {
  const Ray& axis = cast.axis(pulse);
  const glm::vec3 direction(axis.direction);
  EchoRow row{.point = reported_point(cast, pulse, reported_m),
              .intensity = lidar_.light->intensity(echo.detection),
              .time_s = cast.pose(pulse).time_s,
              .ring = cast.pulses().ring[pulse],
              .range_m = echo.range_m,
              .p_DQ = echo.p_DQ,
              .normal = echo.normal,
              .cos_incidence = -glm::dot(direction, echo.normal),
              .sin_incidence = glm::length(glm::cross(direction, echo.normal)),
              .surface = truth_at(cast, pulse, echo.hit),
              .deviation_m = echo.deviation_m};
  if (echo.kind != Echo::Kind::Surface) {  // no ground truth exists
    row.p_DQ = axis.origin + axis.direction * echo.detection.range_m;
    row.range_m = nan;
    row.normal = glm::vec3(static_cast<float>(nan));
    row.cos_incidence = row.sin_incidence = static_cast<float>(nan);
    row.surface = {};
  }
  return row;
}

void Sweep::add_rows(std::size_t pulse, Chunk& chunk) const {
  const std::vector<Echo>& echoes = chunk.work.echoes;
  for (std::size_t k = 0; k < echoes.size(); ++k) {
    double measured_m = echoes[k].detection.range_m;
    if (spec_.range_noise_sigma_m > 0) {
      RandomKey key = key_of(chunk.begin + static_cast<std::int64_t>(pulse));
      key.sub_ray = static_cast<std::uint32_t>(k);
      measured_m += spec_.range_noise_sigma_m * random_normal(key).x;
    }
    const double reported_m = lidar_.light->reported_m(measured_m);
    EchoRow row = row_of(echoes[k], chunk.cast, pulse, reported_m);
    row.return_index = static_cast<std::uint8_t>(k + 1);
    row.return_count = static_cast<std::uint8_t>(echoes.size());
    chunk.light_rows.push_back(
        {row, echoes[k],
         static_cast<std::uint32_t>(chunk.begin) + static_cast<std::uint32_t>(pulse),
         echoes[k].second_share > 0 ? truth_at(chunk.cast, pulse, echoes[k].second_hit).label
                                    : std::uint16_t{0},
         velocity_of(echoes[k], chunk.cast, pulse)});
  }
}

void Sweep::write_light() {
  scan_.echoes = PointCloud(next_row_);
  const ScanColumns columns(scan_.echoes, spec_, scene_);
  tbb::parallel_for(std::size_t{0}, light_rows_.size(), [&](std::size_t chunk) {
    std::size_t row = light_rows_[chunk].first_row;
    for (const auto& [echo_row, echo, pulse, second_label, velocity_m_s] :
         light_rows_[chunk].rows) {
      columns.write(row, echo_row);
      if (columns.has_motion()) columns.write_velocity(row, velocity_m_s);
      columns.write_light(row, pulse, echo, second_label);
      if (columns.has_range_sd()) columns.write_range_sd(row, range_sd_m(echo));
      if (columns.has_bounds()) columns.write_bound(row, echo.bound_m);
      ++row;
    }
  });
}

PointCloud Sweep::no_returns() const {
  PointCloud cloud(missed_.size());
  if (spec_.no_returns == LidarSpec::NoReturns::Omit) return cloud;
  const auto fill = [&](const char* name, auto value) {
    using T = decltype(value(missed_.front()));
    std::ranges::transform(missed_, cloud.add<T>(name).begin(), value);
  };
  fill("pulse", [](const MissedPulse& m) { return m.pulse; });
  fill("time", [](const MissedPulse& m) { return m.time_s; });
  fill("ring", [](const MissedPulse& m) { return m.ring; });
  fill("dx", [](const MissedPulse& m) { return m.direction.x; });
  fill("dy", [](const MissedPulse& m) { return m.direction.y; });
  fill("dz", [](const MissedPulse& m) { return m.direction.z; });
  fill("reason", [](const MissedPulse& m) { return static_cast<std::uint8_t>(m.reason); });
  return cloud;
}

// Chunks are measured and written on any thread in any order; in between, each is placed in firing
// order. Only a few exist at a time. Without light a pulse has at most one echo, so that all rows
// are allocated in advance; with light they are collected first.
LidarScan Sweep::run() {
  const bool has_light = lidar_.light != nullptr;
  scan_.echoes = PointCloud(has_light ? 0 : static_cast<std::size_t>(pulses_));
  std::optional<ScanColumns> columns;
  if (!has_light) columns.emplace(scan_.echoes, spec_, scene_);
  stream([&](const Chunk& chunk) {
    if (columns) write(chunk, *columns);
  });
  if (is_stopped_) throw SweepStopped{};
  if (has_light) {
    write_light();
    scan_.waveforms.interval_s = lidar_.light->interval_s();
  } else {
    scan_.echoes.truncate(next_row_);
  }
  scan_.no_returns = no_returns();
  return std::move(scan_);
}

template <typename Finish>
void Sweep::stream(const Finish& finish) {
  const std::int64_t per_chunk = pulses_per_chunk(lidar_.pattern, lidar_);
  const auto live = 2 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  std::vector<Chunk> chunks(live);
  tbb::concurrent_bounded_queue<Chunk*> idle;
  for (Chunk& chunk : chunks) idle.push(&chunk);
  std::int64_t next = 0;
  const auto take = [&](tbb::flow_control& flow) -> Chunk* {
    const double share = static_cast<double>(next) / static_cast<double>(pulses_);
    is_stopped_ = next < pulses_ && watch_ && !watch_(share);
    if (is_stopped_ || next == pulses_) {
      flow.stop();
      return nullptr;
    }
    Chunk* chunk = nullptr;
    idle.pop(chunk);
    chunk->begin = next;
    chunk->end = next = std::min(next + per_chunk, pulses_);
    return chunk;
  };
  const auto measured = [&](Chunk* chunk) {
    measure(*chunk);
    return chunk;
  };
  const auto placed = [&](Chunk* chunk) {
    place(*chunk);
    return chunk;
  };
  const auto finished = [&](Chunk* chunk) {
    finish(*chunk);
    idle.push(chunk);
  };
  using tbb::filter_mode;
  tbb::parallel_pipeline(
      live, tbb::make_filter<void, Chunk*>(filter_mode::serial_in_order, take) &
                tbb::make_filter<Chunk*, Chunk*>(filter_mode::parallel, measured) &
                tbb::make_filter<Chunk*, Chunk*>(filter_mode::serial_in_order, placed) &
                tbb::make_filter<Chunk*, void>(filter_mode::parallel, finished));
}

}  // namespace

LidarScan scan_sweep(const LidarParts& lidar, const Scene& scene, const Trajectory& X_DS,
                     std::int64_t number, const RandomKey& key, const SweepWatch& watch) {
  return Sweep(lidar, scene, X_DS, number, key, watch).run();
}

}  // namespace groundray
