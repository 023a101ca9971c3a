#include "apps/view/recorded/echo_pixels.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <optional>
#include <system_error>

#include "apps/view/recorded/pixel_ray.h"
#include "core/error.h"
#include "core/folder_names.h"
#include "core/io/npy_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr double slack_m = 0.1, slack_share = 0.02;

// Returns an echo at a pixel of the image; std::nullopt if its pixel sees something nearer.
std::optional<EchoPixel> seen_echo(const RecordedSensor& camera, const RecordedFrame& frame,
                                   const RecordedImage& image, const glm::dvec3& p_D_m,
                                   glm::dvec2 pixel) {
  const auto seen = seen_pixel(camera, frame, pixel, nullptr);
  if (!seen) return std::nullopt;
  const glm::dvec3 from_lens_m = p_D_m - seen->origin_m;
  const auto recorded_m = image.distance_m(glm::ivec2(glm::round(pixel)));
  if (recorded_m && glm::length(from_lens_m) > *recorded_m * (1 + slack_share) + slack_m)
    return std::nullopt;
  const glm::dvec3 ahead = pose_at(camera, seen->time).rotation * glm::dvec3(0, 0, 1);
  return EchoPixel{pixel, glm::dot(from_lens_m, ahead)};
}

}  // namespace

std::map<std::string, fs::path> echo_files(const fs::path& stem) {
  const std::string begin = stem.filename().string() + "_";
  std::map<std::string, fs::path> files;
  std::error_code ignored;
  for (const std::string& file : names_in(stem.parent_path(), ignored)) {
    const fs::path path = stem.parent_path() / file;
    const std::string name = path.stem().string();
    if (path.extension() == ".npy" && name.starts_with(begin))
      files[name.substr(begin.size())] = path;
  }
  return files;
}

std::vector<EchoPixel> read_echo_pixels(const fs::path& file) {
  const PointCloud rows = read_npy(file).cloud;
  std::vector<EchoPixel> echoes;
  try {
    const auto u_px = rows.column<double>("u_px"), v_px = rows.column<double>("v_px"),
               depth_m = rows.column<double>("depth_m");
    const auto is_visible = rows.column<std::uint8_t>("is_visible");
    for (std::size_t i = 0; i < rows.rows(); ++i) {
      if (is_visible[i] != 0) echoes.push_back({{u_px[i], v_px[i]}, depth_m[i]});
    }
  } catch (const Error& fault) {
    throw Error("{}: it does not contain echoes in an image: {}", file.string(), fault.what());
  }
  return echoes;
}

std::vector<EchoPixel> echo_pixels(const RecordedSensor& camera, const RecordedFrame& frame,
                                   const RecordedImage& image, std::span<const glm::dvec3> p_D_m) {
  const glm::dvec2 end_px = glm::dvec2(image.size_px()) - 0.5;
  std::vector<std::optional<EchoPixel>> found(p_D_m.size());
  tbb::parallel_for(std::size_t{0}, p_D_m.size(), [&](std::size_t i) {
    const glm::dvec3& p = p_D_m[i];
    if (!std::isfinite(p.x + p.y + p.z)) return;
    const auto pixel = pixel_of(camera, frame, p);
    const bool is_inside =
        pixel && pixel->x >= -0.5 && pixel->y >= -0.5 && pixel->x < end_px.x && pixel->y < end_px.y;
    if (is_inside) found[i] = seen_echo(camera, frame, image, p, *pixel);
  });
  std::vector<EchoPixel> echoes;
  for (const auto& echo : found) {
    if (echo) echoes.push_back(*echo);
  }
  return echoes;
}

}  // namespace groundray
