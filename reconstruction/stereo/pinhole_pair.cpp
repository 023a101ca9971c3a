#include "reconstruction/stereo/pinhole_pair.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/image/luminance.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr double most_turn_deg = 60;
constexpr double least_from_axis_deg = 45;
constexpr double most_pixels = 1 << 26;
constexpr int look_steps = 128;  // steps between the rays sampled along each side of an image

double angle_deg(const glm::dvec3& a, const glm::dvec3& b) {
  return glm::degrees(math::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)));
}

double turn_deg(const glm::dquat& a, const glm::dquat& b) {
  const glm::dquat turn = glm::conjugate(a) * b;
  const double sine = glm::length(glm::dvec3(turn.x, turn.y, turn.z));
  return glm::degrees(2 * math::atan2(sine, std::abs(turn.w)));
}

void check_view(const char* name, const StereoView& view, Violations& broken) {
  broken.unless(view.size_px.x > 0 && view.size_px.y > 0,
                "the {} image has {} x {} px: both must be positive", name, view.size_px.x,
                view.size_px.y);
  broken.unless(view.project && view.ray, "the {} view has no lens: set project and ray", name);
}

// Returns the rotation half-way between both cameras, turned so that x lies along the baseline p_LR
// (D).
glm::dquat common_turn(const glm::dquat& half_way, const glm::dvec3& p_LR) {
  const glm::dvec3 towards = glm::conjugate(half_way) * p_LR;
  const double quarters = std::round(math::atan2(towards.y, towards.x) * 2 / std::numbers::pi);
  const double half_angle_rad = quarters * std::numbers::pi / 4;
  const glm::dquat rolled = quarters == 0 ? half_way
                                          : half_way * glm::dquat(math::cos(half_angle_rad), 0, 0,
                                                                  math::sin(half_angle_rad));
  // The least rotation that takes x to a unit vector other than its opposite.
  const glm::dvec3 v = glm::normalize(glm::conjugate(rolled) * p_LR);
  return glm::normalize(rolled * glm::normalize(glm::dquat(1 + v.x, 0, -v.z, v.y)));
}

// Returns the focal length of a pinhole whose pixels on the axis are as large, as solid angles, as
// those of the view; by central differences.
std::optional<double> focal_px(const StereoView& view) {
  constexpr double step = 1e-5;
  const auto right = view.project({step, 0, 1}), left = view.project({-step, 0, 1});
  const auto lower = view.project({0, step, 1}), upper = view.project({0, -step, 1});
  if (!right || !left || !lower || !upper) return std::nullopt;
  const glm::dvec2 by_x = (*right - *left) / (2 * step), by_y = (*lower - *upper) / (2 * step);
  const double focal_px = std::sqrt(std::abs(by_x.x * by_y.y - by_x.y * by_y.x));
  if (!(focal_px > 0 && std::isfinite(focal_px))) return std::nullopt;
  return focal_px;
}

// Field of an image on the plane z = 1 of the pinholes' frame.
struct Field {
  glm::dvec2 least{std::numeric_limits<double>::infinity()};
  glm::dvec2 most{-std::numeric_limits<double>::infinity()};
  std::vector<std::optional<glm::dvec2>> looks;  // nothing for rays that point away from the plane
};

// Samples a camera's rays all over its image, including its boundary, and rotates them to the frame
// R.
Field field_of(const StereoView& view, const glm::dquat& R_RC, double most_tangent) {
  Field field;
  const glm::dvec2 last(view.size_px - 1);
  for (int row = 0; row <= look_steps; ++row) {
    for (int column = 0; column <= look_steps; ++column) {
      const auto ray = view.ray(last * glm::dvec2(column, row) / double{look_steps});
      if (!ray || !std::isfinite(ray->x + ray->y + ray->z)) continue;
      const glm::dvec3 turned = R_RC * *ray;
      auto& look = field.looks.emplace_back();
      if (!(turned.z > 0)) continue;
      look = glm::dvec2(turned) / turned.z;
      const glm::dvec2 within = glm::clamp(*look, -most_tangent, most_tangent);
      // Rays beyond the limit in one direction do not extend the other.
      if (std::abs(look->y) <= most_tangent) {
        field.least.x = std::min(field.least.x, within.x);
        field.most.x = std::max(field.most.x, within.x);
      }
      if (std::abs(look->x) <= most_tangent) {
        field.least.y = std::min(field.least.y, within.y);
        field.most.y = std::max(field.most.y, within.y);
      }
    }
  }
  return field;
}

double lost_share(const Field& field, const glm::dvec2& least, const glm::dvec2& most) {
  const auto is_lost = [&](const std::optional<glm::dvec2>& look) {
    return !look || look->x < least.x || look->y < least.y || look->x > most.x || look->y > most.y;
  };
  const auto lost = std::ranges::count_if(field.looks, is_lost);
  return field.looks.empty() ? 1
                             : static_cast<double>(lost) / static_cast<double>(field.looks.size());
}

// Returns whether the fields allow a point to be seen by both cameras: its disparity is 0 at
// infinity and otherwise positive, so it lies no further left in the left image than in the right
// one.
bool share_something(const Field& left, const Field& right) {
  return left.most.x > right.least.x &&
         std::min(left.most.y, right.most.y) > std::max(left.least.y, right.least.y);
}

void frame_image(const Field& left, const Field& right, PinholePair& pair, Violations& broken) {
  constexpr double margin = 1e-9;  // in tangents: sizes that are whole except for rounding stay so
  const glm::dvec2 least(std::min(left.least.x, right.least.x),
                         std::max(left.least.y, right.least.y));
  const glm::dvec2 most(std::max(left.most.x, right.most.x), std::min(left.most.y, right.most.y));
  const glm::dvec2 size = glm::ceil((most - least) * pair.focal_px - margin * pair.focal_px) + 1.0;
  broken.unless(
      size.x * size.y <= most_pixels,
      "the rectified images would have {} x {} px, more than {} in total: limit the field of view",
      size.x, size.y, most_pixels);
  if (!(size.x * size.y <= most_pixels)) return;
  pair.size_px = glm::ivec2(size);
  pair.centre_px = (size - 1.0) / 2.0 - pair.focal_px * (least + most) / 2.0;
  pair.lost_share = {lost_share(left, least - margin, most + margin),
                     lost_share(right, least - margin, most + margin)};
}

void check_mounting(const StereoView& left, const StereoView& right, const glm::dquat& half_way,
                    Violations& broken) {
  const double turned_deg = turn_deg(left.X_DC.rotation, right.X_DC.rotation);
  broken.unless(turned_deg <= most_turn_deg,
                "the cameras are turned by {:.1f} deg from each other: at most {}", turned_deg,
                most_turn_deg);
  const glm::dvec3 p_LR =
      glm::conjugate(half_way) * (right.X_DC.translation_m - left.X_DC.translation_m);
  const double baseline_m = glm::length(p_LR);
  broken.unless(baseline_m > 0 && std::isfinite(baseline_m),
                "the cameras are {} m apart: stereo needs two positions", baseline_m);
  const double off_axis_deg = angle_deg({0, 0, 1}, p_LR);
  broken.unless(!(baseline_m > 0) || (off_axis_deg >= least_from_axis_deg &&
                                      off_axis_deg <= 180 - least_from_axis_deg),
                "the right camera is ({:.4g}, {:.4g}, {:.4g}) m (right, down, ahead) from the left "
                "one, {:.1f} deg from the viewing direction: it must be at least {} deg from it",
                p_LR.x, p_LR.y, p_LR.z, off_axis_deg, least_from_axis_deg);
}

constexpr double lobes = 3;

double sinc(double x) {
  const double turn = std::numbers::pi * x;
  return std::abs(turn) < 1e-8 ? 1 : math::sin(turn) / turn;
}

// Returns the width of a pinhole's pixel on the axis in pixels of the camera, at least 1.
double scale_of(const PinholePair& pair, StereoSide side, const StereoView& view) {
  const auto at = [&](double x, double y) {
    return source_px(pair, side, view, pair.centre_px + glm::dvec2(x, y));
  };
  const auto left = at(-0.5, 0), right = at(0.5, 0), upper = at(0, -0.5), lower = at(0, 0.5);
  if (!left || !right || !upper || !lower) return 1;
  return std::max({1.0, glm::distance(*left, *right), glm::distance(*upper, *lower)});
}

// Weights of the pixels around a position in one direction.
struct Taps {
  int first = 0;
  std::vector<double> weights;

  void set(double place, double scale) {
    const int reach = static_cast<int>(std::ceil(lobes * scale));
    first = static_cast<int>(std::floor(place)) - reach + 1;
    weights.resize(2 * static_cast<std::size_t>(reach));
    double sum = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const double x = (first + static_cast<double>(i) - place) / scale;
      weights[i] = std::abs(x) < lobes ? sinc(x) * sinc(x / lobes) : 0;
      sum += weights[i];
    }
    for (double& weight : weights) weight /= sum;
  }
};

double weighted(const ImageF& grey, const Taps& columns, const Taps& rows) {
  double sum = 0;
  for (std::size_t j = 0; j < rows.weights.size(); ++j) {
    const int row = std::clamp(rows.first + static_cast<int>(j), 0, grey.height() - 1);
    double along = 0;
    for (std::size_t i = 0; i < columns.weights.size(); ++i) {
      const int column = std::clamp(columns.first + static_cast<int>(i), 0, grey.width() - 1);
      along += columns.weights[i] * static_cast<double>(grey.at(column, row)[0]);
    }
    sum += rows.weights[j] * along;
  }
  return sum;
}

}  // namespace

PinholePair pinhole_pair(const StereoView& left, const StereoView& right, double most_field_rad) {
  Violations broken("stereo pair to rectify");
  check_view("left", left, broken);
  check_view("right", right, broken);
  broken.unless(most_field_rad > 0 && most_field_rad < std::numbers::pi,
                "most_field_rad = {} must be above 0 and below pi", most_field_rad);
  const glm::dquat half_way = half_way_between(left.X_DC.rotation, right.X_DC.rotation);
  check_mounting(left, right, half_way, broken);
  broken.throw_if_any();

  const auto left_focal_px = focal_px(left), right_focal_px = focal_px(right);
  broken.unless(left_focal_px.has_value(), "the left lens does not image its axis");
  broken.unless(right_focal_px.has_value(), "the right lens does not image its axis");
  broken.throw_if_any();
  const glm::dvec3 p_LR = right.X_DC.translation_m - left.X_DC.translation_m;
  const glm::dquat R_DR = common_turn(half_way, p_LR);
  PinholePair pair{.focal_px = (*left_focal_px + *right_focal_px) / 2,
                   .X_DL = {R_DR, left.X_DC.translation_m},
                   .X_DR = {R_DR, right.X_DC.translation_m},
                   .baseline_m = glm::length(p_LR)};
  const auto field = [&](const StereoView& view) {
    return field_of(view, glm::normalize(glm::conjugate(R_DR) * view.X_DC.rotation),
                    math::tan(most_field_rad / 2));
  };
  const Field left_field = field(left), right_field = field(right);
  broken.unless(share_something(left_field, right_field),
                "within {:.0f} deg the fields of view do not overlap: are the poses right?",
                glm::degrees(most_field_rad));
  broken.throw_if_any();
  frame_image(left_field, right_field, pair, broken);
  broken.throw_if_any();
  return pair;
}

std::optional<glm::dvec2> source_px(const PinholePair& pair, StereoSide side,
                                    const StereoView& view, glm::dvec2 pixel) {
  const glm::dvec3 look((pixel - pair.centre_px) / pair.focal_px, 1);
  return view.project(glm::conjugate(view.X_DC.rotation) * (pair.X_D(side).rotation * look));
}

RectifiedImage resample(const ImageF& grey, const PinholePair& pair, StereoSide side,
                        const StereoView& view) {
  if (grey.channels() != 1 || grey.width() != view.size_px.x || grey.height() != view.size_px.y) {
    throw Error(
        "the {} image has {} x {} px and {} channels, but its camera {} x {} px: it must be grey "
        "and of the camera's size",
        side == StereoSide::Left ? "left" : "right", grey.width(), grey.height(), grey.channels(),
        view.size_px.x, view.size_px.y);
  }
  RectifiedImage result{{pair.size_px.x, pair.size_px.y, 1}, {pair.size_px.x, pair.size_px.y, 1}};
  const double scale = scale_of(pair, side, view);
  constexpr double rounding = 1e-6;  // of positions at the boundary
  const glm::dvec2 last(view.size_px - 1);
  tbb::parallel_for(0, pair.size_px.y, [&](int row) {
    Taps columns, rows;
    for (int column = 0; column < pair.size_px.x; ++column) {
      const auto place = source_px(pair, side, view, {column, row});
      if (!place || !(place->x >= -rounding && place->y >= -rounding &&
                      place->x <= last.x + rounding && place->y <= last.y + rounding))
        continue;
      columns.set(place->x, scale);
      rows.set(place->y, scale);
      const double value = weighted(grey, columns, rows);
      if (!std::isfinite(value)) continue;
      result.grey.at(column, row)[0] = static_cast<float>(value);
      result.seen.at(column, row)[0] = 1;
    }
  });
  return result;
}

ImageF grey_of(const Image8& image) {
  if (image.channels() < 1 || image.channels() > 4)
    throw Error("image of {} channels: only 1 to 4 channels can be converted to grey",
                image.channels());
  ImageF grey(image.width(), image.height(), 1);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto value = image.at(x, y);
      const double light =
          image.channels() < 3 ? value[0] : luminance(glm::dvec3(value[0], value[1], value[2]));
      grey.at(x, y)[0] = static_cast<float>(light / 255);
    }
  }
  return grey;
}

}  // namespace groundray
