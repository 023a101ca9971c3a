#include "sensors/camera/light_image.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/elementary.h"
#include "core/pack.h"
#include "sensors/camera/lens/pixel_patch.h"

namespace groundray::light_image {
namespace {

using std::chrono::nanoseconds;

constexpr int block_px = 4;  // side of the blocks of pixels that are traced in succession
constexpr std::size_t paths_at_once = 4096;

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
      times[i] = view_.begin + nanoseconds_of(from_s + view_.exposure_s * share[i]);
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

}  // namespace

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

}  // namespace groundray::light_image
