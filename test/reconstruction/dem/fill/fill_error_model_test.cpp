#include "reconstruction/dem/fill/fill_error_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace groundray::fill_error_model_test {
namespace {

// Errors with a standard deviation of scale distance^(power / 2) roughness^(rough / 2).
std::vector<FillError> errors_of(std::size_t count, double scale, double power, double rough,
                                 unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<FillError> errors;
  for (std::size_t i = 0; i < count; ++i) {
    const double distance = std::exp(2.5 * uniform(random)), roughness = std::exp(uniform(random));
    const double sd_m = scale * std::pow(distance, power / 2) * std::pow(roughness, rough / 2);
    errors.push_back({static_cast<float>(sd_m * normal(random)), static_cast<float>(distance),
                      static_cast<float>(roughness), static_cast<std::uint32_t>(i)});
  }
  return errors;
}

// Objective that the model minimises, as documented at fit_error_model.
double sum_of(const std::vector<FillError>& errors, const FillErrorModel& model) {
  double sum = 5 * (std::pow(model.factors[1] - 1.5, 2) + std::pow(model.factors[2] - 2, 2));
  for (const FillError& error : errors) {
    const double sd_m = model.sd_m(error.distance_cells, error.roughness_m);
    sum += 2 * std::log(sd_m) + std::pow(error.error_m / sd_m, 2);
  }
  return sum;
}

TEST(FillErrorModel, FitIsAtTheMinimumOfItsCost) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const auto errors = errors_of(40, 2, 3.5, 0.5, seed);
    const auto model = fit_error_model(errors);
    ASSERT_TRUE(model);
    for (std::size_t k = 0; k < 3; ++k) {
      FillErrorModel low = *model, high = *model;
      low.factors[k] -= 1e-3;
      high.factors[k] += 1e-3;
      // Central difference: 0 at the minimum, except for its error of 1e-6 and 1e-6 from the last
      // step.
      EXPECT_NEAR((sum_of(errors, high) - sum_of(errors, low)) / 2e-3, 0, 1e-3) << k;
    }
  }
}

TEST(FillErrorModel, RecoversTheModelFromManyErrors) {
  const auto errors = errors_of(40'000, 0.5, 1.0, 2.5, 4);
  const auto model = fit_error_model(errors);
  ASSERT_TRUE(model);
  // Standard deviations of these are 0.01 to 0.03.
  EXPECT_NEAR(model->factors[0], 2 * std::log(0.5), 0.1);
  EXPECT_NEAR(model->factors[1], 1.0, 0.05);
  EXPECT_NEAR(model->factors[2], 2.5, 0.1);
  const FillCover cover = cover_of(errors, *model);
  EXPECT_NEAR(cover.within_1sd, 0.683, 0.01);
  EXPECT_NEAR(cover.within_2sd, 0.954, 0.005);
  EXPECT_NEAR(cover.rms_sds, 1, 1e-6);
}

TEST(FillErrorModel, NeedsThirtyErrors) {
  EXPECT_FALSE(fit_error_model(errors_of(29, 1, 1, 1, 5)));
  const FillCover cover = cover_of({}, FillErrorModel{});
  EXPECT_TRUE(std::isnan(cover.within_1sd) && std::isnan(cover.within_2sd));
  EXPECT_TRUE(std::isnan(cover.rms_sds));
}

}  // namespace
}  // namespace groundray::fill_error_model_test
