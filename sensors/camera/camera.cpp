#include "sensors/camera/camera.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/image/luminance.h"
#include "sensors/camera/light_image.h"

namespace groundray {
namespace {

using light_image::Means;
using light_image::PathCounts;
using light_image::Paths;
using light_image::View;
using std::chrono::nanoseconds;

void check_camera(const CameraSpec& spec) {
  Violations broken("camera");
  broken.unless(spec.rate_hz > 0 && std::isfinite(spec.rate_hz), "rate_hz = {} must be positive",
                spec.rate_hz);
  broken.unless(std::isfinite(spec.first_s), "first_s = {} must be finite", spec.first_s);
  broken.unless(spec.shutter.exposure_s > 0 && spec.shutter.exposure_s <= 3600,
                "exposure_s = {} must be positive and at most 3600", spec.shutter.exposure_s);
  broken.unless(spec.shutter.row_s >= 0 && spec.shutter.row_s <= 1,
                "row_s = {} must be from 0 to 1", spec.shutter.row_s);
  const SamplingSpec& sampling = spec.sampling;
  const auto is_power = [](int n) {
    return n >= 1 && n <= 1 << 20 && std::has_single_bit(static_cast<unsigned>(n));
  };
  broken.unless(is_power(sampling.samples), "samples = {} must be a power of two up to 2^20",
                sampling.samples);
  broken.unless(is_power(sampling.most_samples) && sampling.most_samples >= sampling.samples,
                "most_samples = {} must be a power of two, from samples up to 2^20",
                sampling.most_samples);
  broken.unless(sampling.relative_error >= 0 && std::isfinite(sampling.relative_error),
                "relative_error = {} must be 0 or more", sampling.relative_error);
  if (spec.aperture) {
    const ApertureSpec& aperture = *spec.aperture;
    broken.unless(aperture.focal_length_m > 0 && std::isfinite(aperture.focal_length_m),
                  "focal_length_m = {} must be positive", aperture.focal_length_m);
    broken.unless(aperture.f_number > 0 && std::isfinite(aperture.f_number),
                  "f_number = {} must be positive", aperture.f_number);
    broken.unless(!aperture.focus_m || *aperture.focus_m > aperture.focal_length_m,
                  "focus_m = {} must be more than focal_length_m = {}",
                  aperture.focus_m.value_or(0), aperture.focal_length_m);
    broken.unless(aperture.transmission > 0 && aperture.transmission <= 1,
                  "transmission = {} must be more than 0 and at most 1", aperture.transmission);
    const glm::dvec3& v = aperture.vignetting;
    broken.unless(std::isfinite(v.x + v.y + v.z), "vignetting = [{}, {}, {}] must be finite", v.x,
                  v.y, v.z);
  }
  broken.throw_if_any();
}

double luminance_at(const ImageF& image, int x, int y) {
  const auto rgb = image.at(x, y);
  return luminance({rgb[0], rgb[1], rgb[2]});
}

// Chooses numbers of paths, at most most_samples, that reduce the standard errors of the means to
// the requested ones, estimated from a pilot.
PathCounts counts_from_pilot(const Camera& camera, const View& view, const PathCounts& fewest) {
  const Means pilot = render(camera, view, fewest, Paths::OfPilot, {});
  const ImageF errors = standard_errors(pilot.spreads);
  const SamplingSpec& sampling = camera.spec().sampling;
  PathCounts counts = fewest;
  for (int y = 0; y < counts.height(); ++y) {
    for (int x = 0; x < counts.width(); ++x) {
      double error = luminance_at(errors, x, y);
      const double most = sampling.relative_error * luminance_at(pilot.radiance, x, y);
      int& count = counts.at(x, y)[0];
      for (; count < sampling.most_samples && !(error <= most); count *= 2)
        error /= std::numbers::sqrt2;
    }
  }
  return counts;
}

}  // namespace

struct Camera::Directions {
  std::once_flag asked_for;
  std::vector<glm::dvec3> all;
};

Camera::Camera(const CameraSpec& spec)
    : spec_((check_camera(spec), spec)),
      lens_(spec.lens, spec.size_px),
      directions_(std::make_shared<Directions>()) {}

std::span<const glm::dvec3> Camera::directions() const {
  std::vector<glm::dvec3>& all = directions_->all;
  const auto find = [&] {
    const auto width = static_cast<std::size_t>(spec_.size_px.x);
    all.resize(width * static_cast<std::size_t>(spec_.size_px.y));
    // Isolated: a thread that waits here must not take up another task that waits for this result.
    tbb::this_task_arena::isolate([&] {
      tbb::parallel_for(0, spec_.size_px.y, [&](int row) {
        std::vector<PixelRay> rays(width);
        lens_.fill(row, row + 1, rays);
        std::ranges::transform(rays, all.begin() + static_cast<std::ptrdiff_t>(width) * row,
                               &PixelRay::direction);
      });
    });
  };
  std::call_once(directions_->asked_for, find);
  return all;
}

nanoseconds Camera::duration() const noexcept {
  return light_image::nanoseconds_of(spec_.shutter.row_s * (spec_.size_px.y - 1) +
                                     spec_.shutter.exposure_s);
}

nanoseconds Camera::middle_of(double row) const noexcept {
  return light_image::nanoseconds_of(spec_.shutter.row_s * row + spec_.shutter.exposure_s / 2);
}

Exposure Camera::expose(const PathTracer& light, const Trajectory& X_DC, nanoseconds begin,
                        const RandomKey& key, std::span<const std::uint16_t> labels,
                        const std::function<void()>& check,
                        std::optional<double> exposure_s) const {
  check_cover(X_DC, begin);
  const double shutter_s = spec_.shutter.exposure_s;
  const View view{light, X_DC,  begin,
                  key,   check, std::min(exposure_s.value_or(shutter_s), shutter_s)};
  PathCounts counts(spec_.size_px.x, spec_.size_px.y, 1);
  std::ranges::fill(counts.values(), spec_.sampling.samples);
  if (spec_.sampling.most_samples > spec_.sampling.samples)
    counts = counts_from_pilot(*this, view, counts);
  Means means = render(*this, view, counts, Paths::OfMean, labels);
  ImageF errors = standard_errors(means.spreads);
  return {std::move(means.radiance), std::move(errors), std::move(means.spreads.paths),
          std::move(means.coverage)};
}

std::size_t Camera::checks() const noexcept {
  const auto strips = static_cast<std::size_t>((spec_.size_px.y + light_image::strip_px - 1) /
                                               light_image::strip_px);
  return spec_.sampling.most_samples > spec_.sampling.samples ? 2 * strips : strips;
}

std::vector<MeteredPixel> Camera::meter(const PathTracer& light, const Trajectory& X_DC,
                                        nanoseconds begin, const RandomKey& key) const {
  constexpr double most_pixels = 3072;
  constexpr int paths = 16;
  check_cover(X_DC, begin);
  const int width = spec_.size_px.x, height = spec_.size_px.y;
  const auto step =
      static_cast<int>(std::ceil(std::sqrt(double{1} * width * height / most_pixels)));
  PathCounts counts(width, height, 1);
  const int left = std::min(step, width) / 2, top = std::min(step, height) / 2;
  for (int y = top; y < height; y += step)
    for (int x = left; x < width; x += step) counts.at(x, y)[0] = paths;
  const View view{light, X_DC, begin, key, {}, spec_.shutter.exposure_s};
  const Means means = render(*this, view, counts, Paths::OfMeter, {});
  std::vector<MeteredPixel> all;
  for (int y = top; y < height; y += step) {
    for (int x = left; x < width; x += step) {
      const auto rgb = means.radiance.at(x, y);
      if (means.spreads.paths.at(x, y)[0] > 0) all.push_back({{x, y}, {rgb[0], rgb[1], rgb[2]}});
    }
  }
  return all;
}

void Camera::check_cover(const Trajectory& X_DC, nanoseconds begin) const {
  if (X_DC.begin_time() <= begin && begin + duration() <= X_DC.end_time()) return;
  const auto seconds = [](nanoseconds time) { return 1e-9 * static_cast<double>(time.count()); };
  throw Error(
      "camera: an image is exposed from {:.6f} s to {:.6f} s but the camera's trajectory covers "
      "[{:.6f}, {:.6f}] s",
      seconds(begin), seconds(begin + duration()), seconds(X_DC.begin_time()),
      seconds(X_DC.end_time()));
}

std::vector<std::uint16_t> labels_of(const Scene& scene) {
  std::vector<std::uint16_t> labels{0};
  if (scene.cover.empty()) labels.push_back(scene.terrain.label);
  for (const CoverLayer& layer : scene.cover.layers()) labels.push_back(layer.label);
  for (const ModelTruth& model : scene.models) labels.push_back(model.label);
  std::ranges::sort(labels);
  labels.erase(std::ranges::unique(labels).begin(), labels.end());
  return labels;
}

}  // namespace groundray
