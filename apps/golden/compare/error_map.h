#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "apps/golden/report.h"
#include "core/image/image.h"

namespace groundray::golden {

/// Scale of colours for errors, from blue (negative) through white to red, by the square root of
/// the magnitude; larger errors have the colours of the ends.
struct ErrorScale {
  double end = 1;         ///< magnitude at the ends
  bool is_signed = true;  ///< if false, the bar begins at 0

  Colour colour(double error) const;
  /// @param label  quantity and unit.
  ColourBar bar(const std::string& label) const;
};

/// Returns a scale whose ends are at least the 99th percentile of the magnitudes of finite values.
ErrorScale error_scale_of(const std::vector<double>& errors);

/// Rectangle of positions, cut into cells, with the error of largest magnitude in each.
class ErrorMap {
 public:
  /// @param low, high  corners; the longer side gets `most_cells`, cells are square. An empty side
  ///                   is widened to one cell.
  ErrorMap(glm::dvec2 low, glm::dvec2 high, int most_cells);

  /// As above, with cells of any shape; few are drawn several pixels wide or high.
  ErrorMap(glm::dvec2 low, glm::dvec2 high, glm::ivec2 cells);

  /// Adds an error; does nothing outside the rectangle.
  void add(glm::dvec2 at, double error);
  /// Counts a point without a partner.
  void add_unpaired(glm::dvec2 at);

  /// Returns the picture, with axes and colour bar. Cells are darkened by the share of points
  /// without a partner, to black; cells without points are grey.
  /// @param across, up  labels of the axes; the first coordinate is across.
  Picture picture(const std::string& caption, const std::string& across, const std::string& up,
                  const std::string& bar) const;

 private:
  glm::ivec2 cell_of(glm::dvec2 at) const;
  Colour colour(glm::ivec2 cell, const ErrorScale& scale) const;

  glm::dvec2 low_, high_;
  glm::ivec2 cell_px_{1};
  Image<double> errors_;          ///< NaN: none
  Image<float> paired_, lonely_;  ///< numbers of points
};

}  // namespace groundray::golden
