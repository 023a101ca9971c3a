// Weighted least squares along the image's edges: the fast global smoother of Min et al. (2014),
// applied to confidences and to disparities times confidences, as OpenCV's DisparityWLSFilter
// applies it.
//
// Written by hand because that filter is in OpenCV's ximgproc. Of Debian 12's packages, ximgproc
// and what it needs beyond the other libraries of OpenCV would add 17 MiB to a wheel of the Python
// package (6 MiB zipped) for a single call.

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <glm/vec2.hpp>
#include <limits>
#include <vector>

#include "core/math.h"
#include "reconstruction/stereo/semi_global.h"

namespace groundray {
namespace {

// Chosen on Middlebury's Motorcycle and on rendered pairs (StereoPointsProof) together; OpenCV's
// filter with the same values has the same figures. Half or twice of either is not much worse, but
// twice the contrast makes the stated errors of pinholes at 320 px too large:
//
//                                       chosen   smoothness      contrast
//                                                half   twice    half   twice
//   Motorcycle: bad disparities, %        2.0     2.1    1.9      2.3    1.9
//     pixels with a disparity, %         79.4    79.7   79.0     80.8   77.4
//   RMS of normalised errors, 0.7 to 1.15:
//     pinholes, 320 px                   0.710   0.714  0.704    0.722  0.699
//     fisheyes, 960 px                   1.00    1.02   0.99     1.02   0.97
constexpr double first_smoothness = 200;
constexpr double contrast_grey = 0.8;  // difference of grey values that divides a weight by e
constexpr int passes = 3;              // each with a quarter of the smoothness of the one before
// Those of OpenCV's filter: largest difference of disparities that confirm each other, and the
// variance within a window that leaves no weight.
constexpr double consistent_px = 1.5;
constexpr double most_variance_px2 = 4;

// A disparity times its weight, and the weight; both are smoothed alike.
struct Weighted {
  float product_px = 0, weight = 0;
};

// Rows or columns of an image: distances in pixels between lines, and along a line.
struct Lines {
  std::size_t count, apart, pixels, stride;
};

// Smoothness times a weight between neighbouring pixels, by the difference of their grey values.
using Links = std::array<float, 256>;

Links links_of(double smoothness) {
  Links links{};
  for (std::size_t i = 0; i < links.size(); ++i)
    links[i] = static_cast<float>(smoothness * math::exp(-static_cast<double>(i) / contrast_grey));
  return links;
}

// Minimises over s, along a line, the sum of (s - f)^2 and of link (s - s_next)^2: a tridiagonal
// system, solved by elimination without differences, so that even tiny weights keep their accuracy.
void smooth_line(Weighted* line, const std::uint8_t* grey, const Lines& lines, const Links& links,
                 std::vector<float>& next_share) {
  Weighted previous;
  // Of the previous pixel: its link, and the share of its pivot that is not a link.
  float link_before = 0, share_before = 0;
  for (std::size_t i = 0; i < lines.pixels; ++i) {
    const std::size_t at = i * lines.stride;
    float link_after = 0;
    if (i + 1 < lines.pixels)
      link_after =
          links[static_cast<std::size_t>(std::abs(int{grey[at]} - int{grey[at + lines.stride]}))];
    const float own = 1 + link_before * share_before, pivot = own + link_after;
    line[at].product_px = (line[at].product_px + link_before * previous.product_px) / pivot;
    line[at].weight = (line[at].weight + link_before * previous.weight) / pivot;
    next_share[i] = link_after / pivot;
    share_before = own / pivot;
    link_before = link_after;
    previous = line[at];
  }
  for (std::size_t i = lines.pixels; i-- > 1;) {
    const Weighted& next = line[i * lines.stride];
    Weighted& pixel = line[(i - 1) * lines.stride];
    pixel.product_px += next_share[i - 1] * next.product_px;
    pixel.weight += next_share[i - 1] * next.weight;
  }
}

void smooth_lines(std::vector<Weighted>& image, const Image8& guide, const Lines& lines,
                  const Links& links) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, lines.count, 16), [&](const auto& some) {
    std::vector<float> next_share(lines.pixels);
    for (std::size_t i = some.begin() * lines.apart; i < some.end() * lines.apart; i += lines.apart)
      smooth_line(image.data() + i, guide.values().data() + i, lines, links, next_share);
  });
}

// Sums over windows of values and their squares, exact in sixteenths of a pixel.
class WindowSums {
 public:
  explicit WindowSums(const ImageF& disparity_px)
      : size_(disparity_px.width(), disparity_px.height()),
        sums_(static_cast<std::size_t>(size_.x + 1) * static_cast<std::size_t>(size_.y + 1)) {
    for (int y = 0; y < size_.y; ++y) {
      Sums row;
      for (int x = 0; x < size_.x; ++x) {
        const float value_px = disparity_px.at(x, y)[0];
        const std::int64_t value = std::isnan(value_px) ? 0 : std::llround(16 * value_px);
        row += {std::isnan(value_px) ? 1 : 0, value, value * value};
        Sums& sums = sums_[index(x + 1, y + 1)];
        sums = at(x + 1, y);
        sums += row;
      }
    }
  }

  // Returns the variance of the disparities round a pixel, px^2; infinity if one is missing.
  double variance(int x, int y) const {
    const int left = std::max(x - reach_px, 0), right = std::min(x + reach_px + 1, size_.x);
    const int top = std::max(y - reach_px, 0), bottom = std::min(y + reach_px + 1, size_.y);
    const auto sum = [&](std::int64_t Sums::*of) {
      return static_cast<double>(at(right, bottom).*of - at(left, bottom).*of - at(right, top).*of +
                                 at(left, top).*of);
    };
    if (sum(&Sums::missing) > 0) return std::numeric_limits<double>::infinity();
    const double count = (right - left) * (bottom - top), mean = sum(&Sums::values) / count;
    return (sum(&Sums::squares) / count - mean * mean) / 256;
  }

 private:
  static constexpr int reach_px = 5;
  struct Sums {
    std::int64_t missing = 0, values = 0, squares = 0;
    void operator+=(const Sums& more) {
      missing += more.missing;
      values += more.values;
      squares += more.squares;
    }
  };

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(size_.x + 1) +
           static_cast<std::size_t>(x);
  }
  const Sums& at(int x, int y) const { return sums_[index(x, y)]; }

  glm::ivec2 size_;
  std::vector<Sums> sums_;  // above and to the left of each corner of a pixel
};

// Weights of the disparities: 0 where the right image does not confirm them, less near edges and
// holes.
std::vector<Weighted> weighted_disparities(const SemiGlobalDisparity& found) {
  const int width = found.left_px.width();
  const WindowSums left(found.left_px), right(found.right_px);
  std::vector<Weighted> image(found.left_px.values().size());
  for (int y = 0; y < found.left_px.height(); ++y) {
    for (int x = 0; x < width; ++x) {
      const float left_px = found.left_px.at(x, y)[0];
      const int there = std::isnan(left_px) ? -1 : x - static_cast<int>(std::lround(left_px));
      if (there < 0 || there >= width) continue;
      if (!(std::abs(found.right_px.at(there, y)[0] - left_px) <= consistent_px)) continue;
      const double variance = std::max(left.variance(x, y), right.variance(there, y));
      const auto weight = static_cast<float>(std::max(0.0, 1 - variance / most_variance_px2));
      image[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x)] = {weight * left_px, weight};
    }
  }
  return image;
}

}  // namespace

ImageF smooth_guided(const Image8& left, const SemiGlobalDisparity& found) {
  const auto width = static_cast<std::size_t>(left.width());
  const auto height = static_cast<std::size_t>(left.height());
  std::vector<Weighted> image = weighted_disparities(found);
  double smoothness = first_smoothness;
  for (int pass = 0; pass < passes; ++pass, smoothness /= 4) {
    const Links links = links_of(smoothness);
    smooth_lines(image, left, {height, width, width, 1}, links);
    smooth_lines(image, left, {width, 1, height, width}, links);
  }
  // However small a sum of weights, it gives a mean: no pixel keeps a disparity that its
  // surroundings contradict. Only below the smallest normal float is the mean inaccurate.
  constexpr float least_weight = std::numeric_limits<float>::min();
  ImageF smooth(left.width(), left.height(), 1);
  std::ranges::transform(image, smooth.values().begin(), [](const Weighted& pixel) {
    return pixel.weight >= least_weight ? pixel.product_px / pixel.weight : no_disparity;
  });
  return smooth;
}

}  // namespace groundray
