#include "sensors/sky/direction_sampler.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <numbers>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/math.h"

namespace groundray {
namespace {

using std::numbers::pi;

// Returns cos a - cos b without cancellation.
double cosine_difference(double a_rad, double b_rad) {
  return 2 * math::sin((a_rad + b_rad) / 2) * math::sin((b_rad - a_rad) / 2);
}

// Interval of a cumulative sum that contains a fraction of the total, and the position in it.
struct Pick {
  int index;
  double fraction;
};

Pick pick(std::span<const double> sums, double uniform) {
  const double target = uniform * sums.back();
  const auto after = std::upper_bound(sums.begin() + 1, sums.end() - 1, target);
  const auto index = after - sums.begin() - 1;
  const double begin = *(after - 1), end = *after;
  const double fraction = end > begin ? (target - begin) / (end - begin) : 0.5;
  return {static_cast<int>(index), std::clamp(fraction, 0.0, 1.0)};
}

// Returns the x in [0, 1] below which a density that is linear from `a` to `b` has the fraction
// `uniform` of its area: the root of a x + (b - a) x^2 / 2 = uniform (a + b) / 2, in a form without
// cancellation.
double linear_quantile(double a, double b, double uniform) {
  const double root = std::sqrt(std::max(a * a + uniform * (b * b - a * a), 0.0));
  return a + root > 0 ? std::min(uniform * (a + b) / (a + root), 1.0) : uniform;
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
  const double azimuth = math::atan2(direction.x, direction.y);
  const double sine = std::sqrt(direction.x * direction.x + direction.y * direction.y);
  const double polar = math::atan2(sine, direction.z);
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
  return {sine * math::sin(azimuth), sine * math::cos(azimuth), height};
}

double LatLongGrid::pixel_solid_angle_sr(int row) const noexcept {
  return column_rad_ * cosine_difference(pi * row / height_, pi * (row + 1) / height_);
}

DirectionSampler::DirectionSampler(const LatLongGrid& grid, std::vector<float> weights)
    : grid_(grid), weights_(std::move(weights)) {
  const int width = grid_.width(), height = grid_.height();
  const std::size_t stride = static_cast<std::size_t>(width) + 1;
  if (weights_.size() != (stride - 1) * static_cast<std::size_t>(height)) {
    throw Error("DirectionSampler: {} weights for {} x {} pixels", weights_.size(), width, height);
  }
  columns_.assign(stride * static_cast<std::size_t>(height + 1), 0);
  rows_.assign(static_cast<std::size_t>(height) + 2, 0);
  for (int row = 0; row <= height; ++row) {
    double* sums = columns_.data() + stride * static_cast<std::size_t>(row);
    const int top = std::max(row - 1, 0), bottom = std::min(row, height - 1);
    for (int column = 0; column < width; ++column) {
      const Corners c = corners(top, bottom, column, (column + 1) % width);
      sums[column + 1] =
          sums[column] + (c.top_left + c.top_right + c.bottom_left + c.bottom_right) / 4;
    }
    const auto index = static_cast<std::size_t>(row);
    rows_[index + 1] = rows_[index] + sums[width] * grid_.patch_solid_angle_sr(row);
  }
  if (!(rows_.back() > 0) || !std::isfinite(rows_.back())) {
    throw Error("DirectionSampler: the weights add up to {}, but must be finite and positive",
                rows_.back());
  }
}

DirectionSampler::Corners DirectionSampler::corners(int top, int bottom, int left,
                                                    int right) const noexcept {
  const auto width = static_cast<std::size_t>(grid_.width());
  const float* upper = weights_.data() + width * static_cast<std::size_t>(top);
  const float* lower = weights_.data() + width * static_cast<std::size_t>(bottom);
  return {upper[left], upper[right], lower[left], lower[right]};
}

// Returns the patch's probability over its solid angle, times the weight here over the patch's
// mean. The mean cancels: the density is the bilinear weight over the total.
double DirectionSampler::density(const Corners& c, int column, int patch_row, double across,
                                 double sink) const noexcept {
  const double mean = (c.top_left + c.top_right + c.bottom_left + c.bottom_right) / 4;
  if (mean <= 0) return 0;
  const auto row = static_cast<std::size_t>(patch_row);
  const double* sums = columns_.data() + row * (static_cast<std::size_t>(grid_.width()) + 1);
  const double share = (sums[column + 1] - sums[column]) / sums[grid_.width()] *
                       ((rows_[row + 1] - rows_[row]) / rows_.back());
  const double here = glm::mix(glm::mix(c.top_left, c.top_right, across),
                               glm::mix(c.bottom_left, c.bottom_right, across), sink);
  return share / grid_.patch_solid_angle_sr(patch_row) * (here / mean);
}

DirectionSample DirectionSampler::sample(const glm::dvec2& uniform) const noexcept {
  const Pick row = pick(rows_, uniform.y);
  const std::size_t stride = static_cast<std::size_t>(grid_.width()) + 1;
  const Pick column =
      pick({columns_.data() + stride * static_cast<std::size_t>(row.index), stride}, uniform.x);
  const Corners c = corners(std::max(row.index - 1, 0), std::min(row.index, grid_.height() - 1),
                            column.index, (column.index + 1) % grid_.width());
  const double sink =
      linear_quantile(c.top_left + c.top_right, c.bottom_left + c.bottom_right, row.fraction);
  const double across =
      linear_quantile(glm::mix(c.top_left, c.bottom_left, sink),
                      glm::mix(c.top_right, c.bottom_right, sink), column.fraction);
  return {grid_.direction(column.index, row.index, {across, sink}),
          density(c, column.index, row.index, across, sink)};
}

double DirectionSampler::pdf_per_sr(const glm::dvec3& direction) const noexcept {
  const LatLongPlace at = grid_.place(direction);
  return density(corners(at.top, at.bottom, at.left, at.right), at.left, at.patch_row, at.across,
                 at.sink);
}

}  // namespace groundray
