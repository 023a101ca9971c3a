#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/images/image_comparison.h"
#include "apps/golden/report.h"

namespace groundray::golden {
namespace {

constexpr std::size_t colour_channels = 3;
// Relative rounding of values stored as floats; smaller differences count as none.
constexpr double float_rounding = 1.2e-7;
// Degrees of freedom of the standard errors of a camera's pixels, as in sensors/camera/camera.h.
constexpr double standard_error_freedom = 3;

/// Light of an image with its uncertainty.
struct Light {
  const ImageLayer* light;
  const ImageLayer* error;    // null if the light is exact
  const ImageLayer* samples;  // null if unknown: taken as infinitely many

  explicit Light(const ImageFile& file)
      : light(file.find("RGB")), error(file.find("StdError")), samples(file.find("Samples")) {}

  double variance(int x, int y, std::size_t k) const {
    if (error == nullptr) return 0;
    const double sigma = error->values.at(x, y)[k];
    return sigma * sigma;
  }
  bool is_known(int x, int y, std::size_t k) const {
    return std::isfinite(light->values.at(x, y)[k]) && std::isfinite(variance(x, y, k));
  }
  double freedom(int x, int y) const {
    if (samples == nullptr) return std::numeric_limits<double>::infinity();
    return samples->values.at(x, y)[0] < 4 ? 1 : standard_error_freedom;
  }
};

struct LightPair {
  Light reference, other;

  double off(int x, int y, std::size_t k) const {
    return other.light->values.at(x, y)[k] - reference.light->values.at(x, y)[k];
  }
  double rounding(int x, int y, std::size_t k) const {
    return float_rounding * (std::abs(other.light->values.at(x, y)[k]) +
                             std::abs(reference.light->values.at(x, y)[k]));
  }
  double variance(int x, int y, std::size_t k) const {
    return reference.variance(x, y, k) + other.variance(x, y, k);
  }
  bool is_known(int x, int y, std::size_t k) const {
    return reference.is_known(x, y, k) && other.is_known(x, y, k);
  }
  /// Returns Welch's degrees of freedom of the difference.
  double freedom(int x, int y, std::size_t k) const {
    const double a = reference.variance(x, y, k), b = other.variance(x, y, k);
    const double parts = a * a / reference.freedom(x, y) + b * b / other.freedom(x, y);
    return parts > 0 ? (a + b) * (a + b) / parts : std::numeric_limits<double>::infinity();
  }
};

/// Returns the probability of a |t| at least this large if the light is equal.
double chance(double t, double freedom) {
  if (std::isinf(freedom))
    return 2 * boost::math::cdf(boost::math::complement(boost::math::normal(), t));
  return 2 * boost::math::cdf(
                 boost::math::complement(boost::math::students_t(std::max(freedom, 1.0)), t));
}

template <typename Each>
void each_value(const Image<double>& image, const Each& each) {
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (std::size_t k = 0; k < colour_channels; ++k) each(x, y, k);
    }
  }
}

/// Results of the tests of single values.
struct Values {
  std::size_t all = 0, tests = 0, lost = 0;    // lost: known only in the reference
  std::size_t unequal = 0;                     // different, or not finite
  std::size_t beyond = 0, without_spread = 0;  // different ones with and without spread
  std::vector<double> deviations;
};

Values test_values(const LightPair& pair, double level) {
  Values result;
  const Image<double>& size = pair.reference.light->values;
  each_value(size, [&](int x, int y, std::size_t k) {
    ++result.all;
    if (pair.is_known(x, y, k)) ++result.tests;
    if (!(std::abs(pair.off(x, y, k)) <= pair.rounding(x, y, k))) ++result.unequal;
    if (pair.reference.is_known(x, y, k) && !pair.other.is_known(x, y, k)) ++result.lost;
  });
  const double one = significance_of_one(level, result.tests);
  const double at_least = normal_limit(level, result.tests);  // Student's t has heavier tails
  each_value(size, [&](int x, int y, std::size_t k) {
    if (!pair.is_known(x, y, k)) return;
    const double off = pair.off(x, y, k), sigma = std::sqrt(pair.variance(x, y, k));
    const bool is_off = std::abs(off) > pair.rounding(x, y, k);
    if (sigma == 0) {
      if (is_off) ++result.without_spread;
      return;
    }
    result.deviations.push_back(off / sigma);
    const double t = std::abs(off) / sigma;
    if (is_off && t > at_least && chance(t, pair.freedom(x, y, k)) < one) ++result.beyond;
  });
  return result;
}

/// Returns the magnitude of the error of the mean over a block of pixels, in standard errors.
double deviations_of(const LightPair& pair, std::size_t k, int x0, int y0, int width, int height) {
  const Image<double>& size = pair.reference.light->values;
  double off = 0, variance = 0, rounding = 0;
  for (int y = y0; y < std::min(y0 + height, size.height()); ++y) {
    for (int x = x0; x < std::min(x0 + width, size.width()); ++x) {
      if (!pair.is_known(x, y, k)) continue;
      off += pair.off(x, y, k);
      variance += pair.variance(x, y, k);
      rounding += pair.rounding(x, y, k);
    }
  }
  if (std::abs(off) <= rounding) return 0;
  return std::abs(off) / std::sqrt(variance);
}

void hold_values(const Values& values, const Significance& significance, const std::string& because,
                 Section& into) {
  const auto tests = static_cast<double>(values.tests);
  const double allowed = std::floor(tests * significance.beyond_share * (1 + 1e-12));
  const std::string of_tests = fmt::format("of {}", values.tests);
  if (values.tests == 0 && values.unequal > 0) {
    fail(into, "RGB: values that could be tested", 0, fmt::format("of {}", values.all),
         "values are tested only where radiance and standard error are finite in both");
  }
  hold(into, "RGB: values that differ significantly", static_cast<double>(values.beyond), of_tests,
       allowed, because);
  hold(into, "RGB: values that differ without any spread",
       static_cast<double>(values.without_spread), of_tests, allowed,
       "radiance with a standard error of 0 must be equal except for the rounding of floats");
  hold(into, "RGB: values or standard errors that are finite in the reference alone",
       static_cast<double>(values.lost), fmt::format("of {}", values.all), 0,
       "values that cannot be tested must not pass");
  tell(into, "RGB: values that were not tested, being not finite",
       static_cast<double>(values.all - values.tests));
}

void test_blocks(const LightPair& pair, double level, const std::string& because, Section& into) {
  const Image<double>& size = pair.reference.light->values;
  double worst = 0;
  std::size_t blocks = 0;
  for (int y = 0; y < size.height(); y += block_px) {
    for (int x = 0; x < size.width(); x += block_px) {
      for (std::size_t k = 0; k < colour_channels; ++k, ++blocks)
        worst = std::max(worst, deviations_of(pair, k, x, y, block_px, block_px));
    }
  }
  hold(into, fmt::format("RGB: worst of {} means of 8 x 8 pixels and a channel", blocks), worst,
       "standard errors", normal_limit(level, blocks), because);
}

void test_channels(const LightPair& pair, double level, const std::string& because, Section& into) {
  const Image<double>& size = pair.reference.light->values;
  constexpr std::array names{"R", "G", "B"};
  for (std::size_t k = 0; k < colour_channels; ++k) {
    hold(into, fmt::format("RGB: mean of {} over the image", names[k]),
         deviations_of(pair, k, 0, 0, size.width(), size.height()), "standard errors",
         normal_limit(level, colour_channels), because);
  }
}

}  // namespace

void match_light(const ImageFile& reference, const ImageFile& other,
                 const Significance& significance, Section& into) {
  const LightPair pair{Light(reference), Light(other)};
  if (pair.reference.error == nullptr && pair.other.error == nullptr) return;
  const std::string because = fmt::format(
      "significance {} of all tests of this kind (Šidák), from the standard errors of {}",
      significance.level,
      pair.reference.error == nullptr ? "the other image; the reference counts as exact"
      : pair.other.error == nullptr   ? "the reference; the other image counts as exact"
                                      : "both");
  const Values values = test_values(pair, significance.level);
  hold_values(values, significance, because, into);
  test_blocks(pair, significance.level, because, into);
  test_channels(pair, significance.level, because, into);
  into.histograms.push_back(histogram_of(
      "RGB: difference, in standard errors (equal radiance: normal distribution of width 1)", "",
      values.deviations, -6, 6));
}

}  // namespace groundray::golden
