#include "sensors/sky/lat_long_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace groundray {
namespace {

using std::numbers::pi;

// Returns cos a - cos b without cancellation.
double cosine_difference(double a_rad, double b_rad) {
  return 2 * std::sin((a_rad + b_rad) / 2) * std::sin((b_rad - a_rad) / 2);
}

}  // namespace

LatLongGrid::LatLongGrid(int width, int height, double center_azimuth_rad)
    : width_(width),
      height_(height),
      center_azimuth_rad_(center_azimuth_rad),
      column_rad_(2 * pi / width) {
  Violations broken("LatLongGrid");
  broken.unless(width > 0 && height > 0, "{} x {} px: both must be positive", width, height);
  broken.unless(std::isfinite(center_azimuth_rad), "center_azimuth_rad = {} must be finite",
                center_azimuth_rad);
  broken.throw_if_any();
  for (int row = 0; row <= height; ++row) {
    const double begin = row == 0 ? 0 : pi * (row - 0.5) / height;
    const double end = row == height ? pi : pi * (row + 0.5) / height;
    patch_rows_.push_back({begin, end, cosine_difference(0, begin), cosine_difference(end, pi),
                           cosine_difference(begin, end)});
  }
}

LatLongPlace LatLongGrid::place(const glm::dvec3& direction) const noexcept {
  const double azimuth = std::atan2(direction.x, direction.y);
  const double sine = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  const double polar = std::atan2(sine, direction.z);
  const double turns = (azimuth - center_azimuth_rad_) / (2 * pi) + 0.5;
  const double x = (turns - std::floor(turns)) * width_ - 0.5;
  const double y = polar / pi * height_ - 0.5;
  LatLongPlace place;
  const double left = std::floor(x);
  place.across = x - left;
  place.left = (static_cast<int>(left) + width_) % width_;
  place.right = (place.left + 1) % width_;
  place.patch_row = std::clamp(static_cast<int>(std::floor(y)) + 1, 0, height_);
  place.top = std::max(place.patch_row - 1, 0);
  place.bottom = std::min(place.patch_row, height_ - 1);
  const PatchRow& row = patch_rows_[static_cast<std::size_t>(place.patch_row)];
  place.down = std::clamp((polar - row.begin_rad) / (row.end_rad - row.begin_rad), 0.0, 1.0);
  // Measured from the nearer pole, so that positions close to it keep their precision.
  const double cap = sine * sine / (1 + std::abs(direction.z));  // 1 - |cos|
  const double sink = direction.z > 0 ? (cap - row.from_zenith) / row.depth
                                      : 1 - (cap - row.from_nadir) / row.depth;
  place.sink = std::clamp(sink, 0.0, 1.0);
  return place;
}

glm::dvec3 LatLongGrid::direction(int column, int patch_row,
                                  const glm::dvec2& fraction) const noexcept {
  const double azimuth = center_azimuth_rad_ + column_rad_ * (column + 0.5 + fraction.x) - pi;
  const PatchRow& row = patch_rows_[static_cast<std::size_t>(patch_row)];
  const double from_zenith = row.from_zenith + fraction.y * row.depth;
  const double from_nadir = row.from_nadir + (1 - fraction.y) * row.depth;
  const double cap = std::min(from_zenith, from_nadir);  // 1 - |cos|
  const double sine = std::sqrt(cap * (2 - cap));
  const double height = from_zenith < from_nadir ? 1 - from_zenith : from_nadir - 1;
  return {sine * std::sin(azimuth), sine * std::cos(azimuth), height};
}

double LatLongGrid::pixel_solid_angle_sr(int row) const noexcept {
  return column_rad_ * cosine_difference(pi * row / height_, pi * (row + 1) / height_);
}

}  // namespace groundray
