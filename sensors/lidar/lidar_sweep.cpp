#include <tbb/concurrent_queue.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/math.h"
#include "sensors/lidar/beam/pulse_tracer.h"
#include "sensors/lidar/lidar.h"
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
std::int64_t pulses_per_chunk(const ScanPattern& pattern, const LaserBeam& beam, int last_level) {
  const std::size_t first = beam.sub_rays(0).size();
  const std::size_t last = beam.sub_rays(last_level).size();
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

}  // namespace

// Computation of one sweep.
class Lidar::Sweep {
 public:
  Sweep(const Lidar& lidar, const Scene& scene, const Trajectory& X_DS, std::int64_t number,
        const RandomKey& key, const SweepWatch& watch)
      : lidar_(lidar),
        watch_(watch),
        spec_(lidar.spec_),
        scene_(scene),
        path_(path_of(lidar.pattern_, X_DS, number)),
        key_(key),
        pulses_(lidar.pattern_.pulses(number)),
        any_moves_(scene.objects.any_moves()),
        settings_{lidar.beam_,
                  lidar.last_level_,
                  lidar.light_ ? lidar.light_->resolution_m() : 0,
                  spec_.angular_jitter_rad,
                  rays_end_m(spec_),
                  lidar.planes_ ? &*lidar.planes_ : nullptr} {
    if (lidar.light_) brdfs_.emplace(scene, lidar.light_->spec().wavelength_nm, lidar.beam_);
    if (spec_.points == LidarSpec::Points::AtStamp) X_SD_ = inverse(X_DS.pose_at(path_.stamp));
  }

  LidarScan run();

 private:
  // Pulse without an echo.
  struct MissedPulse {
    std::uint32_t pulse;
    float time_s;
    std::uint16_t ring;
    glm::vec3 direction;
    NoReturn reason;
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
    std::vector<EchoRow> light_rows;
    std::vector<WaveformRun> runs;
    std::vector<float> power_w;
    Convergence convergence;
    FootprintSamples samples;  // of a pulse on a plane
    std::vector<Ray> rays_again;
    std::vector<Hit> hits_again;
    std::vector<MissedPulse> missed;  // if requested
  };

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
  void receive(const EchoSimulator& light, std::size_t pulse, const LitPulse& lit,
               Chunk& chunk) const;
  void keep_waveform(std::uint32_t pulse, Chunk& chunk) const;
  void compare(std::size_t pulse, Chunk& chunk) const;
  void place(Chunk& chunk);
  void write(const Chunk& chunk, const ScanColumns& columns) const;
  void add_rows(std::size_t pulse, Chunk& chunk) const;
  void miss(std::size_t pulse, NoReturn reason, Chunk& chunk) const;
  void write_light();
  EchoRow row_of(const Echo& echo, const PulseTracer& cast, std::size_t pulse,
                 double reported_m) const;
  glm::vec3 reported_point(const PulseTracer& cast, std::size_t pulse, double reported_m) const;
  SurfaceTruth truth_at(const PulseTracer& cast, std::size_t pulse, std::uint32_t hit) const {
    return scene_.truth_of(cast.rays(pulse)[hit], cast.hits(pulse)[hit]);
  }
  // Returns the velocity of the surface that a ray hits.
  glm::vec3 velocity_m_s(const Hit& hit, const glm::dvec3& p_DQ,
                         std::chrono::nanoseconds time) const {
    if (!any_moves_ || hit.object == 0) return glm::vec3(0);
    return glm::vec3(scene_.objects.velocity_m_s(hit.object, p_DQ, time));
  }
  PointCloud no_returns() const;

  const Lidar& lidar_;
  const SweepWatch& watch_;
  const LidarSpec& spec_;
  const Scene& scene_;
  SweepPath path_;
  RandomKey key_;
  std::int64_t pulses_;
  bool any_moves_;
  PulseTracer::Settings settings_;
  std::optional<RetroBrdfs> brdfs_;  // only with light
  Pose X_SD_;

  // Filled in firing order:
  std::size_t next_row_ = 0;
  bool is_stopped_ = false;
  struct PlacedRows {
    std::size_t first_row;
    std::vector<EchoRow> rows;
  };
  std::vector<PlacedRows> light_rows_;
  LidarScan scan_;
  std::vector<MissedPulse> missed_;
};

void Lidar::Sweep::measure(Chunk& chunk) const {
  chunk.cast.cast(path_, chunk.begin, chunk.end, settings_, key_, scene_);
  if (spec_.error_bound == LidarSpec::ErrorBound::Report) {
    chunk.bounds_m.resize(chunk.cast.all_rays().size());
    scene_.rays.bound_errors(chunk.cast.all_rays(), chunk.cast.all_hits(), chunk.bounds_m);
  }
  chunk.missed.clear();
  lidar_.light_ ? measure_light(chunk) : measure_rays(chunk);
}

void Lidar::Sweep::measure_rays(Chunk& chunk) const {
  const auto hits = chunk.cast.all_hits();
  chunk.rows = static_cast<std::size_t>(
      std::ranges::count_if(hits, [this](const Hit& hit) { return returns(hit); }));
  if (spec_.no_returns == LidarSpec::NoReturns::Omit) return;
  for (std::uint32_t i = 0; i < chunk.cast.size(); ++i) {
    const Hit& hit = hits[chunk.cast.range(i).first];
    if (!returns(hit)) miss(i, hit ? NoReturn::OutOfGate : NoReturn::Sky, chunk);
  }
}

void Lidar::Sweep::measure_light(Chunk& chunk) const {
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
    receive(*lidar_.light_, i, {cast.rays(i), cast.hits(i), {}, bounds_m, cast.range(i).count},
            chunk);
    add_rows(i, chunk);
    if (chunk.work.echoes.empty()) miss(i, chunk.work.reason, chunk);
    if (spec_.waveforms == LidarSpec::WaveformOutput::Keep) keep_waveform(i, chunk);
    if (pulse % convergence_stride == 0) compare(i, chunk);
  }
  chunk.rows = chunk.light_rows.size();
}

// Finds the echoes of a pulse: by a quadrature if its footprint lies on a plane, otherwise from the
// traced sub-rays.
void Lidar::Sweep::receive(const EchoSimulator& light, std::size_t pulse, const LitPulse& lit,
                           Chunk& chunk) const {
  const RandomKey key = key_of(chunk.begin + static_cast<std::int64_t>(pulse));
  EchoSimulator::Workspace& work = chunk.work;
  if (!lidar_.planes_) return light.receive(lit, *brdfs_, key, work);
  const PulseAxis axis = chunk.cast.pulse_axis(pulse);
  const auto plane = lidar_.planes_->plane_of(lidar_.beam_, axis, lit.rays, lit.hits);
  if (!plane) return light.receive(lit, *brdfs_, key, work);
  FootprintSamples& samples = chunk.samples;
  lidar_.planes_->sample(axis, *plane, lit.rays, lit.hits, samples);
  light.receive({samples.rays, samples.hits, samples.shares, {}, lit.traced}, *brdfs_, key, work);
  for (Echo& echo : work.echoes) {
    echo.hit = samples.traced[echo.hit];
    echo.second_hit = samples.traced[echo.second_hit];
    if (!lit.bounds_m.empty()) echo.bound_m = std::ranges::max(lit.bounds_m);
  }
}

void Lidar::Sweep::miss(std::size_t pulse, NoReturn reason, Chunk& chunk) const {
  if (spec_.no_returns == LidarSpec::NoReturns::Omit) return;
  const PulseTracer& cast = chunk.cast;
  chunk.missed.push_back(
      {static_cast<std::uint32_t>(chunk.begin) + static_cast<std::uint32_t>(pulse),
       cast.pose(pulse).time_s, cast.pulses().ring[pulse], glm::vec3(cast.axis(pulse).direction),
       reason});
}

void Lidar::Sweep::keep_waveform(std::uint32_t pulse, Chunk& chunk) const {
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
void Lidar::Sweep::compare(std::size_t pulse, Chunk& chunk) const {
  const PulseTracer& cast = chunk.cast;
  const int finer = cast.range(pulse).level + 1;
  if (finer >= lidar_.beam_.levels()) return;
  const EchoSimulator& light = *lidar_.quiet_light_;
  receive(light, pulse, {cast.rays(pulse), cast.hits(pulse), {}, {}, cast.range(pulse).count},
          chunk);
  const std::vector<Echo> coarse = chunk.work.echoes;
  cast.cast_again(pulse, finer, lidar_.beam_, key_, scene_, chunk.rays_again, chunk.hits_again);
  receive(light, pulse, {chunk.rays_again, chunk.hits_again, {}, {}, chunk.rays_again.size()},
          chunk);
  const std::vector<Echo>& fine = chunk.work.echoes;
  Convergence& seen = chunk.convergence;
  ++seen.pulses;
  if (fine.size() != coarse.size()) {
    ++seen.changed;
    return;
  }
  for (std::size_t k = 0; k < fine.size(); ++k) {
    seen.range_m.add(fine[k].detection.range_m - coarse[k].detection.range_m);
    seen.share.add(fine[k].share - coarse[k].share);
    if (fine[k].kind == Echo::Kind::Surface && coarse[k].kind == Echo::Kind::Surface)
      seen.true_m.add(fine[k].range_m - coarse[k].range_m);
  }
}

// Called for one chunk at a time, in firing order.
void Lidar::Sweep::place(Chunk& chunk) {
  chunk.first_row = next_row_;
  next_row_ += chunk.rows;
  if (lidar_.light_) light_rows_.push_back({chunk.first_row, std::move(chunk.light_rows)});
  missed_.insert(missed_.end(), chunk.missed.begin(), chunk.missed.end());
  Waveforms& waveforms = scan_.waveforms;
  for (WaveformRun run : chunk.runs) {
    run.first_sample += waveforms.power_w.size();
    waveforms.runs.push_back(run);
  }
  waveforms.power_w.insert(waveforms.power_w.end(), chunk.power_w.begin(), chunk.power_w.end());
  scan_.convergence.add(chunk.convergence);
}

// Returns the point that the sensor reports, which does not account for angular jitter. Inline
// because it is called for every row.
inline glm::vec3 Lidar::Sweep::reported_point(const PulseTracer& cast, std::size_t pulse,
                                              double reported_m) const {
  const PulseBatch& pulses = cast.pulses();
  const glm::dvec3 p_SQ = pulses.origin_m[pulse] + pulses.direction[pulse] * reported_m;
  if (spec_.points == LidarSpec::Points::AsFired) return glm::vec3(p_SQ);
  const PulseTracer::SensorPose& pose = cast.pose(pulse);
  return glm::vec3(X_SD_ * (pose.p_DS + pose.R_DS * p_SQ));
}

void Lidar::Sweep::write(const Chunk& chunk, const ScanColumns& columns) const {
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
    const glm::dvec3 p_DQ = ray.origin + ray.direction * hit.range_m;
    columns.write(row, {.point = reported_point(cast, i, reported_m),
                        .intensity = cos_incidence,
                        .time_s = cast.pose(i).time_s,
                        .ring = cast.pulses().ring[i],
                        .range_m = hit.range_m,
                        .p_DQ = p_DQ,
                        .normal = hit.normal,
                        .cos_incidence = cos_incidence,
                        .sin_incidence = glm::length(glm::cross(direction, hit.normal)),
                        .surface = scene_.truth_of(ray, hit),
                        .deviation_m = hit.deviation_m,
                        .range_sd_m = static_cast<float>(spec_.range_noise_sigma_m),
                        .velocity_m_s = velocity_m_s(hit, p_DQ, ray.time),
                        .bound_m = chunk.bounds_m.empty() ? 0 : chunk.bounds_m[at]});
    ++row;
  }
  columns.complete(chunk.first_row, row);
}

EchoRow Lidar::Sweep::row_of(const Echo& echo, const PulseTracer& cast, std::size_t pulse,
                             double reported_m) const {
  const Ray& axis = cast.axis(pulse);
  const glm::vec3 direction(axis.direction);
  EchoRow row{.point = reported_point(cast, pulse, reported_m),
              .intensity = lidar_.light_->intensity(echo.detection),
              .time_s = cast.pose(pulse).time_s,
              .ring = cast.pulses().ring[pulse],
              .range_m = echo.range_m,
              .p_DQ = echo.p_DQ,
              .normal = echo.normal,
              .cos_incidence = -glm::dot(direction, echo.normal),
              .sin_incidence = glm::length(glm::cross(direction, echo.normal)),
              .surface = truth_at(cast, pulse, echo.hit),
              .deviation_m = echo.deviation_m,
              .power_w = static_cast<float>(echo.detection.power_w),
              .width_s = static_cast<float>(echo.detection.width_s),
              .snr = static_cast<float>(echo.detection.snr),
              .kind = echo.kind,
              .share = echo.share,
              .second_share = echo.second_share,
              .bound_m = echo.bound_m};
  if (echo.second_share > 0) row.second_label = truth_at(cast, pulse, echo.second_hit).label;
  if (reports_range_sd(spec_)) {
    row.range_sd_m = static_cast<float>(lidar_.light_->reported_sd_m(
        math::hypot(echo.detection.range_sd_m, spec_.range_noise_sigma_m)));
  }
  if (echo.kind == Echo::Kind::Surface) {
    row.velocity_m_s = velocity_m_s(cast.hits(pulse)[echo.hit], echo.p_DQ, axis.time);
  } else {  // no ground truth exists
    row.p_DQ = axis.origin + axis.direction * echo.detection.range_m;
    row.range_m = nan;
    row.normal = glm::vec3(static_cast<float>(nan));
    row.cos_incidence = row.sin_incidence = static_cast<float>(nan);
    row.surface = {};
  }
  return row;
}

void Lidar::Sweep::add_rows(std::size_t pulse, Chunk& chunk) const {
  const std::vector<Echo>& echoes = chunk.work.echoes;
  for (std::size_t k = 0; k < echoes.size(); ++k) {
    double measured_m = echoes[k].detection.range_m;
    if (spec_.range_noise_sigma_m > 0) {
      RandomKey key = key_of(chunk.begin + static_cast<std::int64_t>(pulse));
      key.sub_ray = static_cast<std::uint32_t>(k);
      measured_m += spec_.range_noise_sigma_m * random_normal(key).x;
    }
    const double reported_m = lidar_.light_->reported_m(measured_m);
    EchoRow row = row_of(echoes[k], chunk.cast, pulse, reported_m);
    row.return_index = static_cast<std::uint8_t>(k + 1);
    row.return_count = static_cast<std::uint8_t>(echoes.size());
    row.pulse = static_cast<std::uint32_t>(chunk.begin) + static_cast<std::uint32_t>(pulse);
    chunk.light_rows.push_back(row);
  }
}

void Lidar::Sweep::write_light() {
  scan_.echoes = PointCloud(next_row_);
  const ScanColumns columns(scan_.echoes, spec_, scene_);
  tbb::parallel_for(std::size_t{0}, light_rows_.size(), [&](std::size_t chunk) {
    std::size_t row = light_rows_[chunk].first_row;
    for (const EchoRow& echo : light_rows_[chunk].rows) columns.write(row++, echo);
    columns.complete(light_rows_[chunk].first_row, row);
  });
}

PointCloud Lidar::Sweep::no_returns() const {
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
LidarScan Lidar::Sweep::run() {
  const bool has_light = lidar_.light_.has_value();
  scan_.echoes = PointCloud(has_light ? 0 : static_cast<std::size_t>(pulses_));
  std::optional<ScanColumns> columns;
  if (!has_light) columns.emplace(scan_.echoes, spec_, scene_);
  stream([&](const Chunk& chunk) {
    if (columns) write(chunk, *columns);
  });
  if (is_stopped_) throw SweepStopped{};
  if (has_light) {
    write_light();
    scan_.waveforms.interval_s = lidar_.light_->interval_s();
  } else {
    scan_.echoes.truncate(next_row_);
  }
  scan_.no_returns = no_returns();
  return std::move(scan_);
}

template <typename Finish>
void Lidar::Sweep::stream(const Finish& finish) {
  const std::int64_t per_chunk =
      pulses_per_chunk(lidar_.pattern_, lidar_.beam_, lidar_.last_level_);
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

LidarScan Lidar::scan(const Scene& scene, const Trajectory& X_DS, std::int64_t number, Seed seed,
                      std::uint32_t sensor_number, const SweepWatch& watch) const {
  return Sweep(*this, scene, X_DS, number,
               {seed, sensor_number, static_cast<std::uint32_t>(number)}, watch)
      .run();
}

}  // namespace groundray
