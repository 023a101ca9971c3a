#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "apps/groundray/dem/dem_input.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_io.h"
#include "core/math.h"
#include "reconstruction/stereo/pinhole_pair.h"
#include "sensors/camera/lens/lens.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

StereoView view_of(const RecordedCamera& camera, const RecordedFrame& frame) {
  const auto lens = std::make_shared<const Lens>(camera.lens, camera.size_px);
  return {.size_px = camera.size_px,
          .X_DC = camera.X_DC.pose_at(camera.middle(frame)),
          .project = [lens](const glm::dvec3& p_C) { return lens->project(p_C); },
          .ray = [lens](glm::dvec2 pixel) -> std::optional<glm::dvec3> {
            const auto ray = lens->ray(pixel);
            if (!ray) return std::nullopt;
            return ray->direction;
          }};
}

// Reads the luminance of a radiance image.
ImageF light_of(const fs::path& file) {
  const ExrFile exr = read_exr(file);
  std::array<const ImageF*, 3> colours{};
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const ExrChannel* channel = exr.find(std::string(1, "RGB"[i]));
    if (channel != nullptr) colours[i] = std::get_if<ImageF>(&channel->image);
    if (colours[i] == nullptr)
      throw Error(
          "{}: it has no picture and no radiance (channels R, G, B): request one of these products "
          "for the camera",
          file.string());
  }
  constexpr std::array<float, 3> weights{0.2126f, 0.7152f, 0.0722f};  // ITU-R BT.709
  ImageF light(exr.width, exr.height, 1);
  const auto values = light.values();
  for (std::size_t k = 0; k < colours.size(); ++k) {
    const auto from = colours[k]->values();
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += weights[k] * from[i];
  }
  return light;
}

// Scales both images so that 99 % of their pixels are within 0 to 1, and applies a gamma of 2.2.
void encode(ImageF& left, ImageF& right) {
  constexpr double share = 0.99;
  std::vector<float> all(left.values().begin(), left.values().end());
  all.insert(all.end(), right.values().begin(), right.values().end());
  const auto at =
      all.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size() - 1));
  std::ranges::nth_element(all, at);
  const float white = *at > 0 ? *at : 1;
  for (ImageF* image : {&left, &right}) {
    for (float& value : image->values())
      value = static_cast<float>(math::pow(std::clamp(value / white, 0.0f, 1.0f), 1 / 2.2));
  }
}

void check_size(const fs::path& file, const ImageF& image, const RecordedCamera& camera) {
  if (image.width() == camera.size_px.x && image.height() == camera.size_px.y) return;
  throw Error(
      "{}: it has {} x {} px, but calibration/{}.yaml says {} x {}: is it another camera's?",
      file.string(), image.width(), image.height(), camera.name, camera.size_px.x,
      camera.size_px.y);
}

std::array<ImageF, 2> read_images(const ImagePair& pair) {
  const auto& cameras = pair.pair->cameras;
  const fs::path &left = cameras[0].frames[pair.left].file,
                 &right = cameras[1].frames[pair.right].file;
  const auto is_light = [](const fs::path& file) { return file.extension() == ".exr"; };
  if (is_light(left) != is_light(right)) {
    throw Error(
        "{}: the pair's images differ: this one is radiance (.exr), and {} is a picture (.png): "
        "was one removed? Request the product picture for both cameras",
        is_light(left) ? left.string() : right.string(),
        is_light(left) ? right.string() : left.string());
  }
  const auto read =
      is_light(left) ? light_of : [](const fs::path& file) { return grey_of(read_image8(file)); };
  std::array<ImageF, 2> images{read(left), read(right)};
  check_size(left, images[0], cameras[0]);
  check_size(right, images[1], cameras[1]);
  if (is_light(left)) encode(images[0], images[1]);
  return images;
}

void check_poses(const RecordedCamera& camera, const RecordedFrame& frame, double longest_gap_s) {
  const auto at = camera.middle(frame);
  const auto s = [](std::chrono::nanoseconds time) {
    return 1e-9 * static_cast<double>(time.count());
  };
  if (at < camera.X_DC.begin_time() || at > camera.X_DC.end_time()) {
    throw Error(
        "poses/{}.tum: it covers {:.9g} to {:.9g} s, but the image was exposed at {:.9g} s: was "
        "the file truncated?",
        camera.name, s(camera.X_DC.begin_time()), s(camera.X_DC.end_time()), s(at));
  }
  check_gap(fmt::format("poses/{}.tum", camera.name), camera.X_DC, at, at, longest_gap_s);
}

PointTally add_points(const ImagePair& images, const StereoOptions& options,
                      const MeasurementNoise& noise, std::uint32_t group, MeasuredPoints& to) {
  const auto& [left, right] = images.pair->cameras;
  const RecordedFrame& left_frame = left.frames[images.left];
  const RecordedFrame& right_frame = right.frames[images.right];
  check_poses(left, left_frame, noise.longest_pose_gap_s);
  check_poses(right, right_frame, noise.longest_pose_gap_s);
  const StereoTally tally =
      append({.views = {view_of(left, left_frame), view_of(right, right_frame)},
              .greys = read_images(images)},
             options, noise.points, group, to);
  return {.name = images.name, .rows = tally.matched(), .points = tally.points, .pixels = tally};
}

}  // namespace

std::vector<ImagePair> image_pairs(const std::vector<RecordedPair>& pairs, const FrameRange& frames,
                                   std::vector<std::string>& notes) {
  constexpr std::chrono::nanoseconds together{1000};
  std::vector<ImagePair> images;
  for (const RecordedPair& pair : pairs) {
    std::size_t alone = 0;
    const auto& rights = pair.cameras[1].frames;
    for (std::size_t i = 0; i < pair.cameras[0].frames.size(); ++i) {
      const RecordedFrame& left = pair.cameras[0].frames[i];
      if (!frames.contains(static_cast<std::size_t>(left.number))) continue;
      const auto right = std::ranges::find(rights, left.number, &RecordedFrame::number);
      if (right == rights.end() || std::chrono::abs(right->stamp - left.stamp) > together) {
        ++alone;
        continue;
      }
      images.push_back({.name = fmt::format("{}/{:06}", pair.name, left.number),
                        .pair = &pair,
                        .left = i,
                        .right = static_cast<std::size_t>(right - rights.begin())});
    }
    if (alone > 0)
      notes.push_back(fmt::format("{}: {} image{} no counterpart at {} time", pair.name, alone,
                                  alone == 1 ? " has" : "s have", alone == 1 ? "its" : "their"));
  }
  return images;
}

PointTally add_stereo_points(const ImagePair& images, const StereoOptions& options,
                             const MeasurementNoise& noise, std::uint32_t group,
                             MeasuredPoints& to) {
  try {
    return add_points(images, options, noise, group, to);
  } catch (const Error& fault) {
    const std::string what = fault.what();
    const bool is_memory = what.find("(most_bytes)") != std::string::npos;
    throw Error("{}: {}{}", images.name, what, is_memory ? " (--memory-mb allows more)" : "");
  }
}

}  // namespace groundray
