#include "apps/python/placed_returns.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "core/error.h"

namespace groundray::python {
namespace {

using std::chrono::nanoseconds;

// Returns the time at which each echo's pulse fired, since the stamp.
std::vector<double> times_s(const Sweep& sweep) {
  const auto column = sweep.cloud.column<float>("time");
  return {column.begin(), column.end()};
}

// Returns the sensor's pose at each of these times. They are clamped, because as floats they may
// lie just outside the trajectory.
std::vector<Pose> poses_at(const Sweep& sweep, std::span<const double> all_s) {
  const Trajectory& X_DS = sweep.source.X_DS;
  std::vector<Pose> poses;
  poses.reserve(all_s.size());
  for (const double time_s : all_s) {
    const nanoseconds time = sweep.source.stamp + nanoseconds(std::llround(time_s * 1e9));
    poses.push_back(X_DS.pose_at(std::clamp(time, X_DS.begin_time(), X_DS.end_time())));
  }
  return poses;
}

// Returns the points in S at the time at which each pulse fired.
std::vector<glm::dvec3> points_as_fired(const Sweep& sweep, std::span<const Pose> poses) {
  const auto x = sweep.cloud.column<float>("x");
  const auto y = sweep.cloud.column<float>("y");
  const auto z = sweep.cloud.column<float>("z");
  std::vector<glm::dvec3> p_S(sweep.cloud.rows());
  for (std::size_t i = 0; i < p_S.size(); ++i) p_S[i] = {x[i], y[i], z[i]};
  if (sweep.source.points == LidarSpec::Points::AsFired) return p_S;
  const Pose X_DS = sweep.source.X_DS.pose_at(sweep.source.stamp);
  for (std::size_t i = 0; i < p_S.size(); ++i) p_S[i] = inverse(poses[i]) * (X_DS * p_S[i]);
  return p_S;
}

std::vector<float> sds_of(const Sweep& sweep, std::optional<double> range_sd_m) {
  if (!range_sd_m && sweep.cloud.has("range_sd")) {
    const auto column = sweep.cloud.column<float>("range_sd");
    return {column.begin(), column.end()};
  }
  const double sd_m = range_sd_m.value_or(sweep.source.range_noise_sigma_m);
  return std::vector<float>(sweep.cloud.rows(), static_cast<float>(sd_m));
}

}  // namespace

void check_scans(const char* who, const std::vector<const Sweep*>& scans) {
  if (scans.empty()) throw Error("{}: scans is empty; give at least one", who);
  const auto none = std::ranges::find(scans, nullptr);
  if (none != scans.end())
    throw Error("{}: scan {} of scans is None; leave it out", who, none - scans.begin());
}

PlacedReturns placed_returns(const Sweep& sweep, std::optional<double> range_sd_m) {
  const std::vector<Pose> poses = poses_at(sweep, times_s(sweep));
  PlacedReturns returns{.points_m = points_as_fired(sweep, poses),
                        .sd_m = sds_of(sweep, range_sd_m)};
  returns.origins_m.reserve(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    returns.points_m[i] = poses[i] * returns.points_m[i];
    returns.origins_m.push_back(poses[i].translation_m);
  }
  return returns;
}

OrganisedScan organised(const Sweep& sweep, std::optional<double> range_sd_m, ReturnChoice choice) {
  ScanReturns returns;
  returns.times_s = times_s(sweep);
  const std::vector<Pose> poses = poses_at(sweep, returns.times_s);
  returns.p_S = points_as_fired(sweep, poses);
  const auto rings = sweep.cloud.column<std::uint16_t>("ring");
  returns.rings.assign(rings.begin(), rings.end());
  const auto intensity = sweep.cloud.column<float>("intensity");
  returns.intensity.assign(intensity.begin(), intensity.end());
  const auto labels = sweep.cloud.column<std::uint16_t>("label");
  returns.labels.assign(labels.begin(), labels.end());
  returns.sd_m = sds_of(sweep, range_sd_m);
  return place(organise(returns, choice).scan, sweep.source.X_DS, sweep.source.stamp,
               returns.times_s);
}

}  // namespace groundray::python
