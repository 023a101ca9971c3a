#include "apps/golden/compare/error_figures.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "core/math.h"

namespace groundray::golden {
namespace {

std::vector<double> sizes_of(const std::vector<double>& errors) {
  std::vector<double> sizes(errors.size());
  std::ranges::transform(errors, sizes.begin(), [](double error) { return std::abs(error); });
  return sizes;
}

/// As quantile, but reorders the values.
double take_quantile(std::vector<double>& values, double share) {
  if (values.empty()) return ErrorFigures::none;
  const double place = share * static_cast<double>(values.size() - 1);
  const auto rank = static_cast<std::ptrdiff_t>(place);
  const auto at = values.begin() + rank;
  std::nth_element(values.begin(), at, values.end());
  const double part = place - static_cast<double>(rank);
  if (part == 0 || at + 1 == values.end()) return *at;
  return *at + part * (*std::min_element(at + 1, values.end()) - *at);
}

/// Returns the end of a histogram's axis; most errors are far smaller than the largest.
double reach_of(const ErrorFigures& figures) {
  if (figures.p95_size > 0) return 2 * figures.p95_size;
  return figures.p99_size > 0 ? figures.p99_size : figures.largest;
}

// Two-sided limit: each tail has half of the significance of one test.
template <typename Distribution>
double limit(const Distribution& distribution, double level, std::size_t tests) {
  return boost::math::quantile(
      boost::math::complement(distribution, significance_of_one(level, tests) / 2));
}

}  // namespace

double quantile(std::vector<double> values, double share) { return take_quantile(values, share); }

ErrorFigures figures_of(const std::vector<double>& errors) {
  if (errors.empty()) return {};
  ErrorFigures figures{.count = errors.size(), .largest = 0};
  double sum = 0, sizes = 0, squares = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double size = std::abs(errors[i]);
    sum += errors[i];
    sizes += size;
    squares += size * size;
    if (size > figures.largest) {
      figures.largest = size;
      figures.worst = i;
    }
  }
  const auto count = static_cast<double>(errors.size());
  figures.mean = sum / count;
  figures.mean_size = sizes / count;
  figures.rms = std::sqrt(squares / count);
  figures.median = quantile(errors, 0.5);
  std::vector<double> work = sizes_of(errors);
  figures.median_size = take_quantile(work, 0.5);
  figures.p95_size = take_quantile(work, 0.95);
  figures.p99_size = take_quantile(work, 0.99);
  std::ranges::transform(errors, work.begin(),
                         [&](double error) { return std::abs(error - figures.median); });
  figures.nmad = 1.4826 * take_quantile(work, 0.5);
  return figures;
}

void tell_errors(Section& into, const std::string& name, const std::string& unit,
                 const std::vector<double>& errors) {
  if (errors.empty()) return;
  const ErrorFigures figures = figures_of(errors);
  tell(into, name + ": mean error", figures.mean, unit);
  tell(into, name + ": RMS error", figures.rms, unit);
  tell(into, name + ": mean size of error", figures.mean_size, unit);
  tell(into, name + ": median size of error", figures.median_size, unit);
  tell(into, name + ": 95th percentile of its size", figures.p95_size, unit);
  tell(into, name + ": largest error", figures.largest, unit);
  if (!(figures.largest > 0)) return;
  const double reach = reach_of(figures);
  into.histograms.push_back(
      histogram_of(name + ": other less reference", unit, errors, -reach, reach));
}

void tell_sizes(Section& into, const std::string& name, const std::string& unit,
                const std::vector<double>& sizes) {
  if (sizes.empty()) return;
  const ErrorFigures figures = figures_of(sizes);
  tell(into, name + ": mean", figures.mean, unit);
  tell(into, name + ": RMS", figures.rms, unit);
  tell(into, name + ": median", figures.median, unit);
  tell(into, name + ": 95th percentile", figures.p95_size, unit);
  tell(into, name + ": largest", figures.largest, unit);
  if (!(figures.largest > 0)) return;
  const double reach = reach_of(figures);
  into.histograms.push_back(histogram_of(name, unit, sizes, 0, reach));
}

double significance_of_one(double level, std::size_t tests) {
  return -math::expm1(math::log1p(-level) / static_cast<double>(std::max<std::size_t>(tests, 1)));
}

double normal_limit(double level, std::size_t tests) {
  return limit(boost::math::normal(), level, tests);
}

double student_limit(double level, std::size_t tests, double freedom) {
  return limit(boost::math::students_t(freedom), level, tests);
}

}  // namespace groundray::golden
