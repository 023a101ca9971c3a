#include "sensors/lidar.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <numeric>

#include "core/error.h"

namespace groundray {
namespace {

constexpr std::size_t chunk_pulses =
    4096;  // traced at once by a thread; a multiple of every packet width

// A row of the scan to be.
struct Echo {
  double range_m;
  glm::dvec3 p_DQ;
  glm::vec3 p_SQ;
  glm::vec3 normal;
  float incidence_rad;
  float time_s;
  std::uint16_t ring;
};

// What the echoes of one volley share.
struct HeadPose {
  glm::dmat3 R_SH;
  glm::dmat3 R_DH;
  glm::dvec3 p_DS;
  float time_s;
};

std::chrono::nanoseconds to_nanoseconds(double seconds) {
  return std::chrono::nanoseconds(std::llround(seconds * 1e9));
}

glm::dmat3 turn_about_z(double angle_rad) {
  const double sine = std::sin(angle_rad);
  const double cosine = std::cos(angle_rad);
  return {{cosine, sine, 0}, {-sine, cosine, 0}, {0, 0, 1}};
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
    const glm::dmat3 R_SH = turn_about_z(pattern_.spin_rad(time_s));
    return {R_SH, glm::mat3_cast(X_DS.rotation) * R_SH, X_DS.translation_m,
            static_cast<float>(1e-9 * static_cast<double>((time - stamp_).count()))};
  }

 private:
  const ScanPattern& pattern_;
  const Trajectory& X_DS_;
  std::int64_t first_;
  std::size_t sequences_;
  std::chrono::nanoseconds stamp_;
};

// What one thread needs to cast a chunk. Rays are kept beam by beam, each beam's in order of
// azimuth: neighbours of a packet are then alike.
struct Chunk {
  std::vector<HeadPose> heads;
  std::vector<Ray> rays;
  std::vector<Hit> hits;
};

}  // namespace

Lidar::Lidar(const LidarSpec& spec)
    : pattern_(spec.pattern), gate_(spec.gate), range_noise_sigma_m_(spec.range_noise_sigma_m) {
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
  const auto shots = pattern_.shots();
  const auto volleys = pattern_.volleys();
  const std::size_t per_chunk = std::max<std::size_t>(1, chunk_pulses / shots.size());
  const std::size_t chunks = (sweep.sequences() + per_chunk - 1) / per_chunk;
  std::vector<std::vector<Echo>> echoes(chunks);

  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk_number) {
    const std::size_t begin = chunk_number * per_chunk;
    const std::size_t count = std::min(per_chunk, sweep.sequences() - begin);
    Chunk chunk{std::vector<HeadPose>(count * volleys.size()),
                std::vector<Ray>(count * shots.size()), std::vector<Hit>(count * shots.size())};
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t v = 0; v < volleys.size(); ++v) {
        const HeadPose& head = chunk.heads[k * volleys.size() + v] =
            sweep.head(begin + k, volleys[v]);
        for (auto s = static_cast<std::size_t>(volleys[v].begin);
             s < static_cast<std::size_t>(volleys[v].end); ++s) {
          chunk.rays[s * count + k] = {head.p_DS + head.R_DH * shots[s].origin_m,
                                       head.R_DH * shots[s].direction, gate_.far_m};
        }
      }
    }
    scene.rays.trace(chunk.rays, chunk.hits);
    auto& out = echoes[chunk_number];
    out.reserve(chunk.rays.size());
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t v = 0; v < volleys.size(); ++v) {
        const HeadPose& head = chunk.heads[k * volleys.size() + v];
        for (auto s = static_cast<std::size_t>(volleys[v].begin);
             s < static_cast<std::size_t>(volleys[v].end); ++s) {
          const Hit& hit = chunk.hits[s * count + k];
          if (!hit || hit.range_m < gate_.near_m) continue;
          const Ray& ray = chunk.rays[s * count + k];
          double reported_m = hit.range_m;
          if (range_noise_sigma_m_ > 0) {
            const auto pulse = static_cast<std::uint32_t>((begin + k) * shots.size() + s);
            reported_m +=
                range_noise_sigma_m_ *
                random_normal({seed, sensor_number, static_cast<std::uint32_t>(number), pulse}).x;
          }
          const glm::vec3 direction(ray.direction);
          out.push_back(
              {hit.range_m, ray.origin + ray.direction * hit.range_m,
               glm::vec3(head.R_SH * (shots[s].origin_m + shots[s].direction * reported_m)),
               hit.normal,
               std::atan2(glm::length(glm::cross(direction, hit.normal)),
                          -glm::dot(direction, hit.normal)),
               head.time_s, shots[s].ring});
        }
      }
    }
  });

  std::vector<std::size_t> first_row(chunks + 1, 0);
  for (std::size_t i = 0; i < chunks; ++i) first_row[i + 1] = first_row[i] + echoes[i].size();
  PointCloud cloud(first_row.back());
  const auto x = cloud.add<float>("x");
  const auto y = cloud.add<float>("y");
  const auto z = cloud.add<float>("z");
  const auto intensity = cloud.add<float>("intensity");
  const auto time_s = cloud.add<float>("time");
  const auto ring = cloud.add<std::uint16_t>("ring");
  const auto return_index = cloud.add<std::uint8_t>("return_index");
  const auto return_count = cloud.add<std::uint8_t>("return_count");
  const auto world_x = cloud.add<double>("world_x");
  const auto world_y = cloud.add<double>("world_y");
  const auto world_z = cloud.add<double>("world_z");
  const auto range_true = cloud.add<double>("range_true");
  const auto nx = cloud.add<float>("nx");
  const auto ny = cloud.add<float>("ny");
  const auto nz = cloud.add<float>("nz");
  const auto incidence = cloud.add<float>("incidence");
  const auto label = cloud.add<std::uint16_t>("label");
  const auto instance = cloud.add<std::uint32_t>("instance");
  const auto error_estimate = cloud.add<float>("error_estimate");
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk_number) {
    std::size_t row = first_row[chunk_number];
    for (const Echo& echo : echoes[chunk_number]) {
      x[row] = echo.p_SQ.x;
      y[row] = echo.p_SQ.y;
      z[row] = echo.p_SQ.z;
      intensity[row] = std::cos(echo.incidence_rad);
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
      incidence[row] = echo.incidence_rad;
      label[row] = scene.terrain.label;
      instance[row] = scene.terrain.instance;
      error_estimate[row] = 0;
      ++row;
    }
  });
  return cloud;
}

}  // namespace groundray
