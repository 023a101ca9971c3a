#include "reconstruction/stereo/rectified_image.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "core/error.h"
#include "core/image/luminance.h"

namespace groundray {
namespace {

constexpr double lobes = 3;

double sinc(double x) {
  const double turn = std::numbers::pi * x;
  return std::abs(turn) < 1e-8 ? 1 : std::sin(turn) / turn;
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
