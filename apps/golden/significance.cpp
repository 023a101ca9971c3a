#include "apps/golden/significance.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace groundray::golden {
namespace {

// Two-sided limit: each tail has half of the significance of one test.
template <typename Distribution>
double limit(const Distribution& distribution, double level, std::size_t tests) {
  return boost::math::quantile(
      boost::math::complement(distribution, significance_of_one(level, tests) / 2));
}

}  // namespace

double significance_of_one(double level, std::size_t tests) {
  return -std::expm1(std::log1p(-level) / static_cast<double>(std::max<std::size_t>(tests, 1)));
}

double normal_limit(double level, std::size_t tests) {
  return limit(boost::math::normal(), level, tests);
}

double student_limit(double level, std::size_t tests, double freedom) {
  return limit(boost::math::students_t(freedom), level, tests);
}

}  // namespace groundray::golden
