#include "apps/groundray/dem_points.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "sensors/spec_io.h"
#include "sensors/yaml_reader.h"

namespace groundray {
namespace {

double squared(double x) { return x * x; }

// What is known of the errors of one beam's point.
struct BeamErrors {
  float sd_m = 0, bias_sd_m = 0, across_sd_m = 0;
};

BeamErrors errors_of(const glm::dvec3& beam_m, double range_sd_m, const PointNoise& noise) {
  if (noise.beams == BeamOrigin::Above) {
    return {static_cast<float>(range_sd_m), static_cast<float>(noise.position_sd_m),
            static_cast<float>(noise.across_sd_m)};
  }
  const double range_m = glm::length(beam_m);
  const double down2 = range_m > 0 ? squared(beam_m.z / range_m) : 1;
  const double flat2 = std::max(0.0, 1 - down2);
  const double foot2_m2 = squared(range_m * noise.divergence_rad.value_or(0) / 4);
  const double sd2_m2 = squared(range_sd_m) * down2 + foot2_m2 * flat2;
  const double bias2_m2 =
      squared(noise.position_sd_m) + squared(range_m * noise.attitude_sd_rad) * flat2;
  const double across2_m2 =
      (squared(range_sd_m) * flat2 + foot2_m2 * (1 + down2)) / 2 + squared(noise.across_sd_m);
  return {static_cast<float>(std::sqrt(sd2_m2)), static_cast<float>(std::sqrt(bias2_m2)),
          static_cast<float>(std::sqrt(across2_m2))};
}

}  // namespace

void check_gap(const std::string& name, const Trajectory& path, std::chrono::nanoseconds time,
               double longest_s) {
  const auto& samples = path.samples();
  const auto after = std::ranges::upper_bound(samples, time, {}, &Trajectory::Sample::time);
  if (after == samples.begin() || after == samples.end()) return;  // at an end, or beyond
  const auto s = [](std::chrono::nanoseconds at) { return 1e-9 * static_cast<double>(at.count()); };
  const double gap_s = s(after->time - std::prev(after)->time);
  if (gap_s <= longest_s) return;
  throw Error(
      "{}: the poses have a gap of {:.6g} s there, from {:.9g} to {:.9g} s, more than {:g} s: "
      "leave it out (--frames, --stereo-frames), or say by --pose-gap-s what gap may be bridged",
      name, gap_s, s(std::prev(after)->time), s(after->time), longest_s);
}

MeasuredPoints lidar_points(const ScanFiles& files, const ScanFile& scan, const ScanTaking& taking,
                            const PointNoise& noise, std::uint32_t group, PointTally& tally) {
  if (scan.path)
    check_gap(scan.name, files.paths[*scan.path], scan.stamp, noise.longest_pose_gap_s);
  PointInput input = read_points(files, scan, taking);
  MeasuredPoints points;
  const std::size_t count = input.points_m.size();
  points.sd_m.reserve(count);
  points.bias_sd_m.reserve(count);
  points.across_sd_m.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const BeamErrors errors =
        errors_of(input.points_m[i] - input.origins_m[i], input.sd_m[i], noise);
    points.sd_m.push_back(errors.sd_m);
    points.bias_sd_m.push_back(errors.bias_sd_m);
    points.across_sd_m.push_back(errors.across_sd_m);
  }
  points.p_m = std::move(input.points_m);
  const bool is_noiseless =
      count > 0 && std::ranges::all_of(input.sd_m, [](float sd_m) { return sd_m == 0; });
  tally = {.name = scan.name, .rows = input.rows, .points = count, .is_noiseless = is_noiseless};
  points.groups.assign(count, group);
  points.origins.assign(count, PointOrigin::Lidar);
  return points;
}

void level_origin(ScanFiles& files) {
  const double height_m = std::exchange(files.georeference.origin_w_m.z, 0);
  if (height_m == 0) return;
  for (ScanFile& scan : files.scans) scan.X_DS.translation_m.z += height_m;
  for (Trajectory& path : files.paths) {
    auto samples = path.samples();
    for (Trajectory::Sample& sample : samples) sample.pose.translation_m.z += height_m;
    path = Trajectory(std::move(samples));
  }
}

std::optional<double> calibrated_divergence_rad(const std::filesystem::path& dataset,
                                                const ScanFile& scan) {
  const std::string sensor = scan.name.substr(0, scan.name.rfind('/'));
  const std::filesystem::path path = dataset / "calibration" / (sensor + ".yaml");
  if (!std::filesystem::is_regular_file(path)) return std::nullopt;
  yaml::Faults faults(path);
  const yaml::Node node = yaml::parse(yaml::read_file(path), path);
  yaml::Map root(node, "", faults);
  std::string text;
  root.read_text("lidar_file", yaml::Need::Required, text);
  root.close_partly();
  faults.throw_if_any();
  const LidarSpec lidar = parse_lidar(text, path);
  double width_rad = 0;
  if (lidar.light) {
    width_rad = glm::length(lidar.beam.divergence_rad) / std::numbers::sqrt2;
    const bool is_half_maximum = lidar.beam.profile == BeamSpec::Profile::Gaussian &&
                                 lidar.beam.width == BeamSpec::Width::FullWidthHalfMaximum;
    // exp(-2 x^2) is 1/2 at x = sqrt(ln 2 / 2).
    if (is_half_maximum) width_rad /= std::sqrt(std::numbers::ln2 / 2);
  }
  return std::hypot(width_rad, 4 * lidar.angular_jitter_rad);
}

}  // namespace groundray
