#pragma once

#include <string>
#include <vector>

#include "apps/golden/report.h"

namespace groundray::golden {

/// Marks of an axis.
struct Ticks {
  std::vector<double> values;
  double step = 1;  ///< from one to the next, also if there is only one
};

/// Returns the multiples of 1, 2 or 5 times a power of ten between two values, inclusive, at the
/// smallest step for which there are at most `most`; none if the values are equal or not finite.
/// @param most  at least 2.
Ticks ticks_between(double a, double b, int most);

/// Returns the text of one of several ticks: as many decimals as their step needs.
std::string tick_text(double value, double step);

/// Returns a histogram as an SVG element, with ticks and labels on both axes.
std::string histogram_svg(const Histogram& histogram);

/// Returns a picture as an SVG element, with the axes and the colour bar that it has. Small
/// pictures are enlarged by a whole factor.
std::string picture_svg(const Picture& picture);

}  // namespace groundray::golden
