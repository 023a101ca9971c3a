#include "apps/golden/compare/error_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <utility>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/html_text.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();
const Colour blank(0.85);
const glm::ivec2 enough_px(600, 160);

/// Returns the smallest of 1, 2, 4, 8 times a power of ten that is at least `value`.
double rounded_up(double value) {
  const double decade = math::pow(10.0, std::floor(math::log10(value)));
  for (const double digit : {1.0, 2.0, 4.0, 8.0}) {
    if (digit * decade >= value * (1 - 1e-9)) return digit * decade;
  }
  return 10 * decade;
}

glm::ivec2 square_cells(glm::dvec2 size, int most_cells) {
  const double cell = std::max(size.x, size.y) / most_cells;
  return glm::clamp(glm::ivec2(glm::ceil(size / cell)), glm::ivec2(1), glm::ivec2(most_cells));
}

/// Returns the upper corner; an empty side is widened.
glm::dvec2 widened(glm::dvec2 low, glm::dvec2 high) {
  const double longest = std::max({high.x - low.x, high.y - low.y, 1e-6});
  return glm::max(high, low + longest * 1e-3);
}

}  // namespace

Colour ErrorScale::colour(double error) const {
  const double size = std::min(std::abs(error) / end, 1.0);
  const Colour full = error < 0 ? Colour(0.13, 0.30, 0.65) : Colour(0.70, 0.09, 0.17);
  return glm::mix(Colour(0.97), full, std::sqrt(size));
}

ColourBar ErrorScale::bar(const std::string& label) const {
  ColourBar bar{.label = label, .colours = {}, .marks = {}};
  constexpr int steps = 64;
  const double from = is_signed ? -1 : 0;  // of the signed square root
  const auto error_at = [&](double root) { return root * std::abs(root) * end; };
  for (int i = 0; i < steps; ++i)
    bar.colours.push_back(colour(error_at(from + (1 - from) * (i + 0.5) / steps)));
  for (double root = from; root <= 1; root += 0.5) {
    bar.marks.emplace_back((root - from) / (1 - from), number_text(error_at(root)));
  }
  return bar;
}

ErrorScale error_scale_of(const std::vector<double>& errors) {
  std::vector<double> sizes;
  bool is_signed = false;
  for (const double error : errors) {
    if (!std::isfinite(error)) continue;
    sizes.push_back(std::abs(error));
    is_signed = is_signed || error < 0;
  }
  const double most = sizes.empty() ? 0 : *std::ranges::max_element(sizes);
  const double p99 = sizes.empty() ? 0 : quantile(std::move(sizes), 0.99);
  const double end = p99 > 0 ? p99 : most;
  return {.end = end > 0 ? rounded_up(end) : 1, .is_signed = is_signed};
}

ErrorMap::ErrorMap(glm::dvec2 low, glm::dvec2 high, int most_cells)
    : ErrorMap(low, widened(low, high), square_cells(widened(low, high) - low, most_cells)) {
  cell_px_ = glm::ivec2(2);
}

ErrorMap::ErrorMap(glm::dvec2 low, glm::dvec2 high, glm::ivec2 cells)
    : low_(low),
      high_(widened(low, high)),
      cell_px_(glm::max(enough_px / cells, glm::ivec2(1))),
      errors_(cells.x, cells.y, 1),
      paired_(cells.x, cells.y, 1),
      lonely_(cells.x, cells.y, 1) {
  std::ranges::fill(errors_.values(), none);
}

glm::ivec2 ErrorMap::cell_of(glm::dvec2 at) const {
  const glm::dvec2 share = (at - low_) / (high_ - low_);
  if (!(share.x >= 0 && share.x <= 1 && share.y >= 0 && share.y <= 1)) return glm::ivec2(-1);
  const glm::ivec2 cells(errors_.width(), errors_.height());
  const glm::ivec2 cell = glm::min(glm::ivec2(share * glm::dvec2(cells)), cells - 1);
  return {cell.x, cells.y - 1 - cell.y};  // the first row of a picture is the upper one
}

void ErrorMap::add(glm::dvec2 at, double error) {
  const glm::ivec2 cell = cell_of(at);
  if (cell.x < 0) return;
  double& now = errors_.at(cell.x, cell.y)[0];
  if (std::isnan(now) || std::abs(error) > std::abs(now)) now = error;
  paired_.at(cell.x, cell.y)[0] += 1;
}

void ErrorMap::add_unpaired(glm::dvec2 at) {
  const glm::ivec2 cell = cell_of(at);
  if (cell.x >= 0) lonely_.at(cell.x, cell.y)[0] += 1;
}

Colour ErrorMap::colour(glm::ivec2 cell, const ErrorScale& scale) const {
  const double error = errors_.at(cell.x, cell.y)[0];
  const float lonely = lonely_.at(cell.x, cell.y)[0], all = lonely + paired_.at(cell.x, cell.y)[0];
  if (all == 0) return blank;
  return (std::isnan(error) ? blank : scale.colour(error)) *
         (1.0 - static_cast<double>(lonely / all));
}

Picture ErrorMap::picture(const std::string& caption, const std::string& across,
                          const std::string& up, const std::string& bar) const {
  const auto values = errors_.values();
  const ErrorScale scale = error_scale_of({values.begin(), values.end()});
  Image8 image(errors_.width() * cell_px_.x, errors_.height() * cell_px_.y, 3);
  const bool has_lonely = std::ranges::any_of(lonely_.values(), [](float n) { return n > 0; });
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      paint(image, x, y, colour(glm::ivec2(x, y) / cell_px_, scale));
    }
  }
  return {.caption =
              fmt::format("{}; the largest in each cell; grey: nothing{}", caption,
                          has_lonely ? "; darker: missing or extra returns, black if all are" : ""),
          .image = std::move(image),
          .shown = Shown::Errors,
          .across = Axis{across, low_.x, high_.x},
          .up = Axis{up, low_.y, high_.y},
          .bar = scale.bar(bar)};
}

}  // namespace groundray::golden
