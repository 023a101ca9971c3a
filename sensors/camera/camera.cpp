#include "sensors/camera/camera.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <mutex>
#include <utility>

#include "core/elementary.h"
#include "core/error.h"
#include "core/image/luminance.h"
#include "core/pack.h"
#include "sensors/camera/lens/pixel_patch.h"
#include "sensors/camera/path_spread.h"

namespace groundray {
namespace {

using std::chrono::nanoseconds;

constexpr int block_px = 4;  // side of the blocks of pixels that are traced in succession
constexpr int strip_px = 8;  // height of the strips that are rendered in parallel
constexpr std::size_t paths_at_once = 4096;

nanoseconds time_of(double seconds) { return nanoseconds(std::llround(seconds * 1e9)); }

// Maps the unit square to the unit disc; preserves areas and adjacency.
// @see Shirley and Chiu, A low distortion map between disk and square, JGT 2(3) (1997).
Vec2<Pack> on_disc(const Vec2<Pack>& u) {
  const Vec2<Pack> p = u * Pack(2.0) - Vec2<Pack>(Pack(1.0));
  const auto is_wide = abs(p.x) > abs(p.y);
  const Pack radius = select(is_wide, p.x, p.y);
  const Pack turn = select(is_wide, p.y / p.x / 8.0, 0.25 - p.x / p.y / 8.0);
  return on_circle(select(radius == 0.0, Pack(0.0), turn)) * radius;
}

// Rotates each lane's vector by the rotation of its pose.
Vec3<Pack> rotated(const std::array<Pose, pack_size>& poses, const Vec3<Pack>& v) {
  const Vec3<Pack> q = vectors_of([&](std::size_t i) {
    const glm::dquat& rotation = poses[i].rotation;
    return glm::dvec3(rotation.x, rotation.y, rotation.z);
  });
  const Pack w = pack_of([&](std::size_t i) { return poses[i].rotation.w; });
  const Vec3<Pack> across = cross_of(q, v);
  return v + (across * w + cross_of(q, across)) * Pack(2.0);
}

// Set of paths of a pixel: those that its light is the mean of, those of the pilot that chooses
// their number, or those that measure the light for automatic exposure. They share no random
// numbers, so that these choices do not bias the mean.
enum class Paths : std::uint32_t { OfMean, OfPilot, OfMeter };

// Returns the seed of a Sobol net of a pixel's paths in a frame.
std::uint32_t sequence_of(const RandomKey& key, std::uint32_t pixel, Paths paths,
                          std::uint32_t net) {
  return random_bits({.seed = key.seed,
                      .sensor = key.sensor,
                      .frame = key.frame,
                      .pulse = pixel,
                      .sub_ray = PathSums::nets * static_cast<std::uint32_t>(paths) + net,
                      .stream = RandomStream::Paths})[0];
}

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

// Image that is to be rendered.
struct View {
  const PathTracer& light;
  const Trajectory& X_DC;
  nanoseconds begin;
  const RandomKey& key;
  std::function<void()> check;
  double exposure_s;  // with the same middle as the shutter's
};

double luminance_at(const ImageF& image, int x, int y) {
  const auto rgb = image.at(x, y);
  return luminance({rgb[0], rgb[1], rgb[2]});
}

// Number of paths of each pixel.
using PathCounts = Image<int>;

// Light of an image and the spreads of its paths.
struct Means {
  ImageF radiance;
  PathSpreads spreads;
  ImageF coverage;

  Means(int width, int height, std::size_t labels)
      : radiance(width, height, 3),
        spreads{ImageF(width, height, 1), ImageF(width, height, 3), ImageF(width, height, 3)},
        coverage(labels == 0 ? ImageF() : ImageF(width, height, static_cast<int>(labels))) {}
};

// Renders the light of strips of rows, one after the other: one object for each thread.
class StripRenderer {
 public:
  StripRenderer(const Camera& camera, const View& view, std::span<const std::uint16_t> labels,
                Paths paths, Means& into)
      : spec_(camera.spec()),
        view_(view),
        labels_(labels),
        paths_(paths),
        width_(spec_.size_px.x),
        rays_(camera.lens()),
        into_(into) {}

  void render(int first, int end, const PathCounts& counts) {
    first_ = first;
    end_ = end;
    rays_.fill(first, end);
    sums_.assign(static_cast<std::size_t>(end - first) * static_cast<std::size_t>(width_), {});
    for (int top = first; top < end; top += block_px) {  // block by block: coherent rays
      for (int left = 0; left < width_; left += block_px) {
        for (int y = top; y < std::min(top + block_px, end); ++y) {
          for (int x = left; x < std::min(left + block_px, width_); ++x) {
            if (rays_.looks({x, y})) add_samples({x, y}, counts.at(x, y)[0]);
          }
        }
      }
    }
    trace();
    write_pixels();
  }

 private:
  PathSums& sums_of(const glm::ivec2& pixel) {
    return sums_[static_cast<std::size_t>(pixel.y - first_) * static_cast<std::size_t>(width_) +
                 static_cast<std::size_t>(pixel.x)];
  }
  void add_samples(const glm::ivec2& pixel, int count);
  void trace();
  void write_pixels();

  // Destination of a path.
  struct Target {
    glm::ivec2 pixel;
    std::uint32_t slot;  // of its PathSums
  };

  const CameraSpec& spec_;
  const View& view_;
  std::span<const std::uint16_t> labels_;
  Paths paths_;
  int width_, first_ = 0, end_ = 0;
  RayRows rays_;
  std::vector<PathSums> sums_;
  Means& into_;
  PathTracer::Workspace work_;
  std::vector<Target> targets_;  // of the paths
  std::vector<glm::vec3> radiance_;
  std::vector<std::uint16_t> seen_;  // label of each path's first hit
};

void StripRenderer::add_samples(const glm::ivec2& pixel, int count) {
  const PixelPatch patch = rays_.patch(pixel);
  const auto number = static_cast<std::uint32_t>(pixel.y * width_ + pixel.x);
  std::array<std::uint32_t, PathSums::nets> sequences;
  for (std::uint32_t net = 0; net < PathSums::nets; ++net)
    sequences[net] = sequence_of(view_.key, number, paths_, net);
  const ShutterSpec& shutter = spec_.shutter;
  const double from_s = shutter.row_s * pixel.y + (shutter.exposure_s - view_.exposure_s) / 2;
  for (int first = 0; first < count; first += static_cast<int>(pack_size)) {
    std::array<PathSums::Place, pack_size> places;
    for (std::size_t i = 0; i < pack_size; ++i)
      places[i] = PathSums::place(
          static_cast<std::uint32_t>(std::min(first + static_cast<int>(i), count - 1)),
          static_cast<std::uint32_t>(count));
    const PackOfWords seeds([&](auto i) { return sequences[places[std::size_t{i}].net]; });
    const PackOfWords indices([&](auto i) { return places[std::size_t{i}].index; });
    SobolPairsOf<PackOfWords> numbers(seeds, indices);
    Vec3<Pack> direction = patch.directions(numbers.next() - Pack(0.5));
    Vec3<Pack> origin(Pack(0.0));
    if (spec_.aperture && spec_.aperture->focus_m) {
      const ApertureSpec& aperture = *spec_.aperture;
      const Vec2<Pack> on_lens =
          on_disc(numbers.next()) * Pack(aperture.focal_length_m / aperture.f_number / 2);
      const auto refracts = direction.z > 0.0;
      origin = select(refracts, {on_lens.x, on_lens.y, Pack(0.0)}, origin);
      direction = select(refracts, unit_of(direction - origin * (direction.z / *aperture.focus_m)),
                         direction);
    } else {
      numbers.skip();  // a pupil changes no other random number
    }
    const Pack share = numbers.next().x;
    std::array<nanoseconds, pack_size> times;
    std::array<Pose, pack_size> poses;  // X_DC
    for (std::size_t i = 0; i < pack_size; ++i) {
      times[i] = view_.begin + time_of(from_s + view_.exposure_s * share[i]);
      poses[i] = view_.X_DC.pose_at(times[i]);
    }
    const Vec3<Pack> begin =
        vectors_of([&](std::size_t i) { return poses[i].translation_m; }) + rotated(poses, origin);
    const Vec3<Pack> along = rotated(poses, direction);
    const auto is_imaged = dot_of(direction, direction) > 0.0;
    for (std::size_t i = 0; i < pack_size && first + static_cast<int>(i) < count; ++i) {
      if (!is_imaged[i]) continue;
      work_.add({vector_at(begin, i), vector_at(along, i), std::numeric_limits<double>::infinity(),
                 times[i]},
                {sequences[places[i].net], places[i].index, numbers.pairs()[i]});
      targets_.push_back({pixel, places[i].slot});
      if (targets_.size() == paths_at_once) trace();
    }
  }
}

void StripRenderer::trace() {
  radiance_.resize(targets_.size());
  seen_.resize(labels_.empty() ? 0 : targets_.size());
  view_.light.trace(work_, radiance_, seen_);
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const auto& [pixel, slot] = targets_[i];
    sums_of(pixel).add(slot, glm::dvec3(radiance_[i]));
    if (labels_.empty()) continue;
    const auto label = std::ranges::lower_bound(labels_, seen_[i]);
    if (label != labels_.end() && *label == seen_[i])
      into_.coverage.at(pixel.x, pixel.y)[static_cast<std::size_t>(label - labels_.begin())] += 1;
  }
  targets_.clear();
}

void StripRenderer::write_pixels() {
  for (int y = first_; y < end_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const PathSums& sums = sums_of({x, y});
      const double count = sums.count();
      if (count == 0) continue;
      const glm::dvec3 mean = sums.mean(), between = sums.between_nets(),
                       within = sums.within_nets();
      for (glm::length_t k = 0; k < 3; ++k) {
        const auto channel = static_cast<std::size_t>(k);
        into_.radiance.at(x, y)[channel] = static_cast<float>(mean[k]);
        into_.spreads.between.at(x, y)[channel] = static_cast<float>(between[k]);
        into_.spreads.within.at(x, y)[channel] = static_cast<float>(within[k]);
      }
      into_.spreads.paths.at(x, y)[0] = static_cast<float>(count);
      if (labels_.empty()) continue;
      for (float& share : into_.coverage.at(x, y)) share /= static_cast<float>(count);
    }
  }
}

bool has_paths(const PathCounts& counts, int first, int end) {
  const auto width = static_cast<std::size_t>(counts.width());
  const std::span<const int> rows = std::span(counts.values())
                                        .subspan(width * static_cast<std::size_t>(first),
                                                 width * static_cast<std::size_t>(end - first));
  return std::ranges::any_of(rows, [](int count) { return count > 0; });
}

Means render(const Camera& camera, const View& view, const PathCounts& counts, Paths paths,
             std::span<const std::uint16_t> labels) {
  const int width = counts.width(), height = counts.height();
  Means means(width, height, labels.size());
  tbb::enumerable_thread_specific<StripRenderer> renderers(
      [&] { return StripRenderer(camera, view, labels, paths, means); });
  tbb::parallel_for(0, (height + strip_px - 1) / strip_px, [&](int strip) {
    if (view.check) view.check();
    const int first = strip * strip_px, end = std::min(first + strip_px, height);
    if (!has_paths(counts, first, end)) return;
    renderers.local().render(first, end, counts);
  });
  return means;
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
  return time_of(spec_.shutter.row_s * (spec_.size_px.y - 1) + spec_.shutter.exposure_s);
}

nanoseconds Camera::middle_of(double row) const noexcept {
  return time_of(spec_.shutter.row_s * row + spec_.shutter.exposure_s / 2);
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
  const auto strips = static_cast<std::size_t>((spec_.size_px.y + strip_px - 1) / strip_px);
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
