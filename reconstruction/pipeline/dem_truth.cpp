#include "reconstruction/pipeline/dem_truth.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "core/quantile.h"

namespace groundray {
namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

double share_within(const std::vector<double>& squares, double sds) {
  const auto within =
      std::ranges::count_if(squares, [sds](double square) { return square <= sds * sds; });
  return squares.empty() ? unknown
                         : static_cast<double>(within) / static_cast<double>(squares.size());
}

void set_normalised(HeightErrors& errors, const std::vector<double>& squares) {
  constexpr double median_of_chi2 = 0.454936;  // for one degree of freedom
  double sum = 0;
  for (const double square : squares) sum += square;
  errors.stated = squares.size();
  errors.normalised_rms = std::sqrt(sum / static_cast<double>(squares.size()));
  errors.normalised_robust = std::sqrt(median(squares) / median_of_chi2);
  errors.within_1sd = share_within(squares, 1);
  errors.within_2sd = share_within(squares, 2);
}

HeightErrors height_errors(std::string name, const TruthComparison& all,
                           const std::function<bool(std::size_t)>& is_asked) {
  std::vector<double> errors_m, squares;
  for (std::size_t i = 0; i < all.error_m.size(); ++i) {
    if (std::isnan(all.error_m[i]) || !is_asked(i)) continue;
    errors_m.push_back(all.error_m[i]);
    const double normalised = all.normalised[i];
    if (!std::isnan(normalised)) squares.push_back(normalised * normalised);
  }
  HeightErrors figures{.of = std::move(name), .samples = errors_m.size()};
  double sum_m = 0, sum2_m2 = 0;
  for (const double error_m : errors_m) {
    sum_m += error_m;
    sum2_m2 += error_m * error_m;
  }
  const auto count = static_cast<double>(errors_m.size());
  figures.bias_m = sum_m / count;
  figures.rmse_m = std::sqrt(sum2_m2 / count);
  std::vector<double> sizes_m;
  for (const double error_m : errors_m) sizes_m.push_back(std::abs(error_m));
  figures.nmad_m = nmad(std::move(errors_m));
  figures.largest_m = quantile(sizes_m, 1);
  figures.p95_m = quantile(std::move(sizes_m), 0.95);
  set_normalised(figures, squares);
  return figures;
}

// Returns the stated standard deviation of a sample's height; 0 if there is none.
double sd_m(const DemLayers& layers, std::size_t i) {
  const float sd_m = layers.source[i] == HeightSource::Filled ? layers.fill_sd_m[i]
                                                              : std::sqrt(layers.variance_m2[i]);
  return sd_m > 0 ? sd_m : 0;
}

}  // namespace

TruthComparison compare_with_truth(const DemLayers& layers, const Georeference& georeference,
                                   const Dem& truth) {
  const GridFrame& frame = layers.frame;
  const glm::dvec3 apart_m = georeference.origin_w_m - truth.origin_w_m;
  TruthComparison comparison{.errors = {},
                             .error_m = std::vector<float>(layers.elevation_m.size(), unknown),
                             .normalised = std::vector<float>(layers.elevation_m.size(), unknown)};
  for (int row = 0; row < frame.samples.y; ++row) {
    for (int column = 0; column < frame.samples.x; ++column) {
      const std::size_t i =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.samples.x) +
          static_cast<std::size_t>(column);
      if (std::isnan(layers.elevation_m[i])) continue;
      const auto true_m = truth.grid.height_m_at(frame.to_D({column, row}) + glm::dvec2(apart_m));
      if (!true_m) continue;
      const double error_m = layers.elevation_m[i] + apart_m.z - *true_m;
      comparison.error_m[i] = static_cast<float>(error_m);
      if (const double stated_m = sd_m(layers, i); stated_m > 0)
        comparison.normalised[i] = static_cast<float>(error_m / stated_m);
    }
  }
  const auto of = [&](HeightSource source) {
    return [&layers, source](std::size_t i) { return layers.source[i] == source; };
  };
  const auto is_measured = [&](std::size_t i) { return layers.source[i] != HeightSource::Filled; };
  comparison.errors = {height_errors("measured", comparison, is_measured),
                       height_errors("lidar", comparison, of(HeightSource::Lidar)),
                       height_errors("stereo", comparison, of(HeightSource::Stereo)),
                       height_errors("fused", comparison, of(HeightSource::Fused)),
                       height_errors("filled", comparison, of(HeightSource::Filled))};
  return comparison;
}

}  // namespace groundray
