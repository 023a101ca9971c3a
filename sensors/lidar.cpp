#include "sensors/lidar.h"

#include <tbb/concurrent_queue.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "core/error.h"

namespace groundray {
namespace {

constexpr std::size_t chunk_pulses =
    4096;  // traced at once by a thread; a multiple of every packet width

// What a row says, besides what holds for all.
struct Echo {
  double range_m;
  glm::dvec3 p_DQ;
  glm::vec3 p_SQ;
  glm::vec3 normal;
  float cos_incidence;
  float sin_incidence;
  float time_s;
  std::uint16_t ring;
  float deviation_m;
};

// What the echoes of one volley share.
struct HeadPose {
  double cos_spin, sin_spin;
  glm::dmat3 R_DH;
  glm::dvec3 p_DS;
  float time_s;
};

std::chrono::nanoseconds to_nanoseconds(double seconds) {
  return std::chrono::nanoseconds(std::llround(seconds * 1e9));
}

// One sweep being made. Chunks of firing sequences are independent of each other and of the order
// in which they are cast.
class Sweep {
 public:
  Sweep(const ScanPattern& pattern, const Trajectory& X_DS, std::int64_t number)
      : pattern_(pattern),
        X_DS_(X_DS),
        first_(pattern.first_sequence(number)),
        sequences_(static_cast<std::size_t>(pattern.first_sequence(number + 1) - first_)),
        stamp_(pattern.stamp(number)) {
    if (stamp_ < X_DS.begin_time() || X_DS.end_time() < pattern.last_firing(number)) {
      throw Error(
          "lidar: sweep {} fires from {:.6f} s to {:.6f} s but the sensor's trajectory covers "
          "[{:.6f}, {:.6f}] s",
          number, 1e-9 * static_cast<double>(stamp_.count()),
          1e-9 * static_cast<double>(pattern.last_firing(number).count()),
          1e-9 * static_cast<double>(X_DS.begin_time().count()),
          1e-9 * static_cast<double>(X_DS.end_time().count()));
    }
  }

  std::size_t sequences() const { return sequences_; }

  HeadPose head(std::size_t sequence, const ScanPattern::Volley& volley) const {
    const double time_s =
        pattern_.firing_time_s(first_ + static_cast<std::int64_t>(sequence), volley);
    const std::chrono::nanoseconds time = to_nanoseconds(time_s);
    const Pose X_DS = X_DS_.pose_at(time);
    const double spin_rad = pattern_.spin_rad(time_s);
    const double cosine = std::cos(spin_rad);
    const double sine = std::sin(spin_rad);
    const glm::dmat3 R_DS = glm::mat3_cast(X_DS.rotation);
    return {cosine,
            sine,
            {R_DS[0] * cosine + R_DS[1] * sine, R_DS[1] * cosine - R_DS[0] * sine, R_DS[2]},
            X_DS.translation_m,
            static_cast<float>(1e-9 * static_cast<double>((time - stamp_).count()))};
  }

 private:
  const ScanPattern& pattern_;
  const Trajectory& X_DS_;
  std::int64_t first_;
  std::size_t sequences_;
  std::chrono::nanoseconds stamp_;
};

// The columns of a scan, to be filled row by row.
struct Rows {
  Rows(PointCloud& cloud, LidarSpec::ErrorBound with)
      : x(cloud.add<float>("x")),
        y(cloud.add<float>("y")),
        z(cloud.add<float>("z")),
        intensity(cloud.add<float>("intensity")),
        time_s(cloud.add<float>("time")),
        ring(cloud.add<std::uint16_t>("ring")),
        return_index(cloud.add<std::uint8_t>("return_index")),
        return_count(cloud.add<std::uint8_t>("return_count")),
        world_x(cloud.add<double>("world_x")),
        world_y(cloud.add<double>("world_y")),
        world_z(cloud.add<double>("world_z")),
        range_true(cloud.add<double>("range_true")),
        nx(cloud.add<float>("nx")),
        ny(cloud.add<float>("ny")),
        nz(cloud.add<float>("nz")),
        incidence(cloud.add<float>("incidence")),
        label(cloud.add<std::uint16_t>("label")),
        instance(cloud.add<std::uint32_t>("instance")),
        error_estimate(cloud.add<float>("error_estimate")) {
    if (with == LidarSpec::ErrorBound::Report) error_bound = cloud.add<float>("error_bound");
  }

  void write(std::size_t row, const Echo& echo, const SurfaceTruth& surface) const {
    x[row] = echo.p_SQ.x;
    y[row] = echo.p_SQ.y;
    z[row] = echo.p_SQ.z;
    intensity[row] = echo.cos_incidence;
    time_s[row] = echo.time_s;
    ring[row] = echo.ring;
    return_index[row] = 1;
    return_count[row] = 1;
    world_x[row] = echo.p_DQ.x;
    world_y[row] = echo.p_DQ.y;
    world_z[row] = echo.p_DQ.z;
    range_true[row] = echo.range_m;
    nx[row] = echo.normal.x;
    ny[row] = echo.normal.y;
    nz[row] = echo.normal.z;
    incidence[row] = std::atan2(echo.sin_incidence, echo.cos_incidence);
    label[row] = surface.label;
    instance[row] = surface.instance;
    // The surface may be this much higher or lower; along the beam that is this much.
    error_estimate[row] =
        echo.deviation_m == 0 ? 0 : echo.deviation_m * echo.normal.z / echo.cos_incidence;
  }

  std::span<float> x, y, z, intensity, time_s;
  std::span<std::uint16_t> ring;
  std::span<std::uint8_t> return_index, return_count;
  std::span<double> world_x, world_y, world_z, range_true;
  std::span<float> nx, ny, nz, incidence;
  std::span<std::uint16_t> label;
  std::span<std::uint32_t> instance;
  std::span<float> error_estimate;
  std::span<float> error_bound;  // empty if nobody asked
};

// A few firing sequences on their way through the pipeline. Its buffers are used again and again.
struct Chunk {
  std::size_t begin = 0;  // first sequence, of the sweep
  std::size_t count = 0;
  std::size_t echoes = 0;  // how many of its pulses return
  std::size_t first_row = 0;
  std::vector<HeadPose> heads;  // by sequence and volley
  std::vector<Ray> rays;        // by shot and sequence: neighbours in azimuth make alike packets
  std::vector<Hit> hits;
  std::vector<double> bounds_m;  // of the hits' ranges, if somebody asked
};

// Calls `act(sequence in the chunk, shot, head)` for every pulse of a chunk, in firing order.
template <typename Act>
void for_each_pulse(const ScanPattern& pattern, const Chunk& chunk, const Act& act) {
  const auto volleys = pattern.volleys();
  for (std::size_t k = 0; k < chunk.count; ++k) {
    for (std::size_t v = 0; v < volleys.size(); ++v) {
      const HeadPose& head = chunk.heads[k * volleys.size() + v];
      for (int shot = volleys[v].begin; shot < volleys[v].end; ++shot) {
        act(k, static_cast<std::size_t>(shot), head);
      }
    }
  }
}

void cast(const Sweep& sweep, const ScanPattern& pattern, const RayTracer& tracer, double far_m,
          Chunk& chunk) {
  const auto shots = pattern.shots();
  chunk.heads.clear();
  for (std::size_t k = 0; k < chunk.count; ++k) {
    for (const ScanPattern::Volley& volley : pattern.volleys()) {
      chunk.heads.push_back(sweep.head(chunk.begin + k, volley));
    }
  }
  chunk.rays.resize(chunk.count * shots.size());
  chunk.hits.resize(chunk.rays.size());
  const auto volleys = pattern.volleys();
  auto* ray = chunk.rays.data();
  for (std::size_t v = 0; v < volleys.size(); ++v) {
    for (int shot = volleys[v].begin; shot < volleys[v].end; ++shot) {
      const auto& [direction, origin_m, ring] = shots[static_cast<std::size_t>(shot)];
      const bool central = origin_m == glm::dvec3(0);
      for (std::size_t k = 0; k < chunk.count; ++k) {
        const HeadPose& head = chunk.heads[k * volleys.size() + v];
        *ray++ = {central ? head.p_DS : head.p_DS + head.R_DH * origin_m, head.R_DH * direction,
                  far_m};
      }
    }
  }
  tracer.trace(chunk.rays, chunk.hits);
}

float rounded_up(double value) {
  const auto nearest = static_cast<float>(value);
  return nearest < value ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
                         : nearest;
}

// Writes the echoes of a chunk, in firing order.
void write(const ScanPattern& pattern, double near_m, double range_noise_sigma_m,
           const RandomKey& sweep_key, const SurfaceTruth& surface, const Chunk& chunk,
           const Rows& rows) {
  const auto shots = pattern.shots();
  std::size_t row = chunk.first_row;
  for_each_pulse(pattern, chunk, [&](std::size_t k, std::size_t shot, const HeadPose& head) {
    const Hit& hit = chunk.hits[shot * chunk.count + k];
    if (!hit || hit.range_m < near_m) return;
    const Ray& ray = chunk.rays[shot * chunk.count + k];
    double reported_m = hit.range_m;
    if (range_noise_sigma_m > 0) {
      RandomKey key = sweep_key;
      key.pulse = static_cast<std::uint32_t>((chunk.begin + k) * shots.size() + shot);
      reported_m += range_noise_sigma_m * random_normal(key).x;
    }
    const glm::dvec3 p_HQ = shots[shot].origin_m + shots[shot].direction * reported_m;
    const glm::vec3 p_SQ(head.cos_spin * p_HQ.x - head.sin_spin * p_HQ.y,
                         head.sin_spin * p_HQ.x + head.cos_spin * p_HQ.y, p_HQ.z);
    const glm::vec3 direction(ray.direction);
    rows.write(row++,
               {hit.range_m, ray.origin + ray.direction * hit.range_m, p_SQ, hit.normal,
                -glm::dot(direction, hit.normal), glm::length(glm::cross(direction, hit.normal)),
                head.time_s, shots[shot].ring, hit.deviation_m},
               surface);
    if (rows.error_bound.empty()) return;
    rows.error_bound[row - 1] = rounded_up(chunk.bounds_m[shot * chunk.count + k]);
  });
}

// Cuts the sequences into chunks and takes each through `measure`, which counts its echoes, and
// `finish`, which writes them. Both run on any thread in any order; in between each chunk learns,
// in firing order, where its rows begin. Few chunks are alive at a time. Returns the number of
// rows.
template <typename Measure, typename Finish>
std::size_t stream_chunks(std::size_t sequences, std::size_t per_chunk, const Measure& measure,
                          const Finish& finish) {
  const auto live = 2 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  std::vector<Chunk> chunks(live);
  tbb::concurrent_bounded_queue<Chunk*> idle;
  for (Chunk& chunk : chunks) idle.push(&chunk);
  std::size_t next_sequence = 0;
  std::size_t next_row = 0;
  const auto take = [&](tbb::flow_control& flow) -> Chunk* {
    if (next_sequence == sequences) {
      flow.stop();
      return nullptr;
    }
    Chunk* chunk = nullptr;
    idle.pop(chunk);
    chunk->begin = next_sequence;
    chunk->count = std::min(per_chunk, sequences - next_sequence);
    next_sequence += chunk->count;
    return chunk;
  };
  const auto measured = [&](Chunk* chunk) {
    measure(*chunk);
    return chunk;
  };
  const auto placed = [&](Chunk* chunk) {
    chunk->first_row = next_row;
    next_row += chunk->echoes;
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
  return next_row;
}

}  // namespace

Lidar::Lidar(const LidarSpec& spec)
    : pattern_(spec.pattern),
      gate_(spec.gate),
      range_noise_sigma_m_(spec.range_noise_sigma_m),
      error_bound_(spec.error_bound) {
  Violations broken(spec.model.empty() ? "lidar" : spec.model);
  broken.unless(gate_.near_m >= 0 && gate_.near_m < gate_.far_m,
                "range gate [{}, {}] m is empty or begins below 0: are near and far swapped?",
                gate_.near_m, gate_.far_m);
  broken.unless(range_noise_sigma_m_ >= 0 && std::isfinite(range_noise_sigma_m_),
                "range noise of {} m must be finite and not negative", range_noise_sigma_m_);
  broken.throw_if_any();
}

PointCloud Lidar::scan(const Scene& scene, const Trajectory& X_DS, std::int64_t number, Seed seed,
                       std::uint32_t sensor_number) const {
  const Sweep sweep(pattern_, X_DS, number);
  const std::size_t per_chunk = std::max<std::size_t>(1, chunk_pulses / pattern_.shots().size());
  const RandomKey key{seed, sensor_number, static_cast<std::uint32_t>(number)};
  PointCloud cloud(sweep.sequences() * pattern_.shots().size());
  const Rows rows(cloud, error_bound_);
  const std::size_t count = stream_chunks(
      sweep.sequences(), per_chunk,
      [&](Chunk& chunk) {
        cast(sweep, pattern_, scene.rays, gate_.far_m, chunk);
        if (error_bound_ == LidarSpec::ErrorBound::Report) {
          chunk.bounds_m.resize(chunk.rays.size());
          scene.rays.bound_errors(chunk.rays, chunk.hits, chunk.bounds_m);
        }
        chunk.echoes = static_cast<std::size_t>(std::ranges::count_if(
            chunk.hits, [&](const Hit& hit) { return hit && hit.range_m >= gate_.near_m; }));
      },
      [&](const Chunk& chunk) {
        write(pattern_, gate_.near_m, range_noise_sigma_m_, key, scene.terrain, chunk, rows);
      });
  cloud.truncate(count);
  return cloud;
}

}  // namespace groundray
