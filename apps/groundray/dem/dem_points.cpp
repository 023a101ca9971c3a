#include "apps/groundray/dem/dem_points.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>
#include <utility>

#include "apps/scene/readers/spec_io.h"
#include "apps/scene/yaml_reader.h"
#include "core/error.h"

namespace groundray {
namespace {

double squared(double x) { return x * x; }

// Errors of the point of one beam.
struct BeamErrors {
  PointErrors noise;
  float bias_sd_m = 0;
};

BeamErrors beam_errors(const glm::dvec3& beam_m, double range_sd_m, const PointNoise& noise) {
  if (noise.beams == BeamOrigin::Above) {
    return {{.sd_m = static_cast<float>(range_sd_m),
             .across_sd_m = static_cast<float>(noise.across_sd_m)},
            static_cast<float>(noise.position_sd_m)};
  }
  const double range_m = glm::length(beam_m);
  const glm::dvec3 along = range_m > 0 ? beam_m / range_m : glm::dvec3(0, 0, -1);
  const double foot2_m2 = squared(range_m * noise.divergence_rad.value_or(0) / 4);
  const glm::dmat3 covariance_m2 =
      glm::dmat3(foot2_m2) + (squared(range_sd_m) - foot2_m2) * glm::outerProduct(along, along);
  BeamErrors errors{.noise = point_errors(covariance_m2)};
  errors.noise.across_sd_m =
      static_cast<float>(std::hypot(errors.noise.across_sd_m, noise.across_sd_m));
  const double flat2 = std::max(0.0, 1 - squared(along.z));
  errors.bias_sd_m = static_cast<float>(
      std::hypot(noise.position_sd_m, range_m * noise.attitude_sd_rad * std::sqrt(flat2)));
  return errors;
}

}  // namespace

void check_gap(const std::string& name, const Trajectory& path, std::chrono::nanoseconds begin,
               std::chrono::nanoseconds end, double longest_s) {
  const auto& samples = path.samples();
  const auto s = [](std::chrono::nanoseconds at) { return 1e-9 * static_cast<double>(at.count()); };
  auto after = std::ranges::upper_bound(samples, begin, {}, &Trajectory::Sample::time);
  if (after == samples.begin() && after != samples.end()) ++after;
  for (; after != samples.end(); ++after) {
    const auto from = std::prev(after)->time, to = after->time;
    if (from > begin && from >= end) return;
    if (s(to - from) <= longest_s) continue;
    throw Error(
        "{}: the poses have a gap of {:.6g} s there, from {:.9g} to {:.9g} s, more than {:g} s: "
        "exclude it (--frames, --stereo-frames), or permit longer gaps by --pose-gap-s",
        name, s(to - from), s(from), s(to), longest_s);
  }
}

LidarPoints::LidarPoints(const ScanFiles& files, const ScanFile& scan, ScanTaking taking,
                         const PointNoise& noise, std::uint32_t group)
    : files_(files),
      scan_(scan),
      noise_(noise),
      group_(group),
      reader_(files, scan, std::move(taking)),
      tally_{.name = scan.name, .is_noiseless = true} {}

void LidarPoints::check(const PointInput& input) const {
  if (scan_.path)
    check_gap(scan_.name, files_.paths[*scan_.path], input.begin, input.end,
              noise_.longest_pose_gap_s);
  if (files_.are_posed || noise_.beams == BeamOrigin::Above) return;
  constexpr double far_m = 10'000;
  for (std::size_t i = 0; i < input.points_m.size(); ++i) {
    const double range_m = glm::distance(input.points_m[i], input.origins_m[i]);
    if (range_m <= far_m) continue;
    throw Error(
        "{}: a point is {:.4g} km from the sensor, which without poses is at the origin: are these "
        "map coordinates? Add --airborne or --poses",
        scan_.file.string(), range_m / 1000);
  }
}

void LidarPoints::count(const PointInput& input) {
  tally_.rows += input.rows;
  tally_.points += input.points_m.size();
  tally_.is_noiseless =
      tally_.is_noiseless && std::ranges::all_of(input.sd_m, [](float sd_m) { return sd_m == 0; });
  for (const std::string& note : input.notes) {
    if (std::ranges::find(tally_.notes, note) == tally_.notes.end()) tally_.notes.push_back(note);
  }
}

bool LidarPoints::next(LidarBlock& block) {
  PointInput input;
  if (!reader_.next(input)) return false;
  check(input);
  count(input);
  MeasuredPoints points;
  const std::size_t size = input.points_m.size();
  points.sd_m.reserve(size);
  points.bias_sd_m.reserve(size);
  points.lean.reserve(size);
  points.across_sd_m.reserve(size);
  for (std::size_t i = 0; i < size; ++i) {
    const BeamErrors errors =
        beam_errors(input.points_m[i] - input.origins_m[i], input.sd_m[i], noise_);
    points.sd_m.push_back(errors.noise.sd_m);
    points.lean.push_back(errors.noise.lean);
    points.bias_sd_m.push_back(errors.bias_sd_m);
    points.across_sd_m.push_back(errors.noise.across_sd_m);
  }
  points.p_m = std::move(input.points_m);
  points.groups.assign(size, group_);
  points.origins.assign(size, PointOrigin::Lidar);
  block = {.points = std::move(points), .origins_m = std::move(input.origins_m)};
  return true;
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
