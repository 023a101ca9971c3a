#include "core/appearance/seams.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/error.h"

namespace groundray {
namespace {

constexpr double most_ratio = 1.5;
constexpr double least_step = 1;  // images without any contrast inside may still differ by this

// Returns the root mean square difference of two rows, or of two columns, of an image.
template <typename At>
double line_difference(const At& at, int first, int second, int length) {
  double sum = 0;
  std::size_t count = 0;
  for (int i = 0; i < length; ++i) {
    const auto a = at(first, i), b = at(second, i);
    for (std::size_t c = 0; c < a.size(); ++c, ++count) {
      const double step = static_cast<double>(a[c]) - static_cast<double>(b[c]);
      sum += step * step;
    }
  }
  return std::sqrt(sum / static_cast<double>(count));
}

template <typename At>
void check_seam(const At& at, int lines, int length, std::string_view edges,
                const std::string& name) {
  double inside = least_step;
  for (int i = 1; i < lines; ++i) inside = std::max(inside, line_difference(at, i - 1, i, length));
  const double seam = line_difference(at, lines - 1, 0, length);
  if (seam <= most_ratio * inside) return;
  throw Error(
      "{}: it does not tile: its {} edges differ by {:.1f} of 255, neighbours inside by at most "
      "{:.1f}; make the image seamless, or omit 'tiling' to accept the seam",
      name, edges, seam, inside);
}

}  // namespace

void require_seamless(const Image8& image, const std::string& name) {
  check_seam([&](int row, int i) { return image.at(i, row); }, image.height(), image.width(),
             "top and bottom", name);
  check_seam([&](int column, int i) { return image.at(column, i); }, image.width(), image.height(),
             "left and right", name);
}

}  // namespace groundray
