#include "apps/view/recorded/pixel_ray.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace groundray {
namespace {

const CameraFacts& camera_facts(const RecordedSensor& camera) {
  if (!camera.camera)
    throw Error("'{}' is not a camera: only pixels of cameras have rays", camera.name);
  return *camera.camera;
}

// Returns the distance of the surface along a pixel's ray, as recorded for the pixel's centre.
std::optional<double> range_m(const RecordedImage& image, glm::dvec2 pixel,
                              const glm::dvec3& direction_C) {
  const glm::ivec2 centre(glm::round(pixel));
  const glm::ivec2 size_px = image.size_px();
  if (centre.x < 0 || centre.y < 0 || centre.x >= size_px.x || centre.y >= size_px.y)
    return std::nullopt;
  std::optional<double> range_m = image.distance_m(centre);
  if (!range_m) {
    if (const auto depth_m = image.depth_m(centre)) range_m = *depth_m / direction_C.z;
  }
  if (!range_m || !std::isfinite(*range_m) || *range_m <= 0) return std::nullopt;
  return range_m;
}

}  // namespace

std::optional<SeenPixel> seen_pixel(const RecordedSensor& camera, const RecordedFrame& frame,
                                    glm::dvec2 pixel, const RecordedImage* image) {
  const CameraFacts& facts = camera_facts(camera);
  const auto ray = facts.lens.ray(pixel);
  if (!ray) return std::nullopt;
  const double last_row = facts.lens.size_px().y - 1;
  SeenPixel seen;
  seen.time = frame.stamp + facts.middle_of_row(std::clamp(pixel.y, 0.0, last_row));
  const Pose X_DC = pose_at(camera, seen.time);
  seen.origin_m = X_DC.translation_m;
  seen.direction = glm::normalize(X_DC.rotation * ray->direction);
  if (image != nullptr) {
    if (const auto range = range_m(*image, pixel, ray->direction))
      seen.p_D_m = seen.origin_m + *range * seen.direction;
  }
  return seen;
}

std::optional<glm::dvec2> pixel_of(const RecordedSensor& camera, const RecordedFrame& frame,
                                   const glm::dvec3& p_D) {
  const CameraFacts& facts = camera_facts(camera);
  const double last_row = facts.lens.size_px().y - 1;
  double row = last_row / 2;
  std::optional<glm::dvec2> pixel;
  constexpr int most_rounds = 20;
  for (int round = 0; round < most_rounds; ++round) {
    const Pose X_DC = pose_at(camera, frame.stamp + facts.middle_of_row(row));
    pixel = facts.lens.project(inverse(X_DC) * p_D);
    if (!pixel) return std::nullopt;
    const double next = std::clamp(pixel->y, 0.0, last_row);
    const bool stays = std::abs(next - row) * facts.row_s < 1e-9;
    row = next;
    if (stays) break;
  }
  return pixel;
}

}  // namespace groundray
