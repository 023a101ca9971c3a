#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "core/random.h"
#include "sensors/camera/camera.h"
#include "sensors/camera/path_spread.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"
#include "test/support/scans/camera_scene.h"
#include "test/support/scans/solid.h"
#include "test/support/terrain/sample_terrain.h"

namespace groundray::standard_error_test {
namespace {

using namespace std::chrono_literals;
using groundray::testing::board;
using groundray::testing::box_model;
using groundray::testing::centred;
using groundray::testing::fractal;
using groundray::testing::gliding;
using groundray::testing::looking;
using groundray::testing::plane_ground;
using groundray::testing::scene_of;

// Random triangles in a ball: the leaves of a crown.
Model crown(std::uint32_t leaves, double radius_m, double size_m) {
  const auto vector = [](std::uint32_t leaf, std::uint32_t number) {
    const RandomKey key{
        .seed = {77}, .pulse = leaf, .sub_ray = 2 * number, .stream = RandomStream::Asset};
    RandomKey next = key;
    ++next.sub_ray;
    const glm::dvec2 xy = random_uniform(key);
    return 2.0 * glm::dvec3(xy, random_uniform(next).x) - 1.0;
  };
  Model model;
  for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
    const glm::dvec3 at = vector(leaf, 0);
    const glm::dvec3 centre_m =
        radius_m * glm::normalize(at) * std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)});
    const std::uint32_t first = 3 * leaf;
    for (std::uint32_t corner = 1; corner <= 3; ++corner)
      model.mesh.vertices_m.emplace_back(centre_m + size_m * vector(leaf, corner));
    model.mesh.triangles.emplace_back(first, first + 1, first + 2);
    model.surface_of.push_back(0);
  }
  model.surfaces.resize(1);
  return model;
}

struct Sight {
  std::string name;
  Scene scene;
  Pose X_DC;
};

std::vector<Sight> sights() {
  std::vector<Sight> all;
  all.push_back(
      {"a plane", scene_of(plane_ground(0.02, 0.01, -2), {}), looking({0, 0, 0}, {8, 0, -1.5})});
  const HeightGrid rough = fractal(257, 0.1, 3, Seed{6});
  all.push_back({"rough ground", scene_of(rough, {}),
                 looking({-6, -6, rough.max_height_m() + 1.0}, {2, 2, rough.min_height_m()})});
  all.push_back({"shadows",
                 scene_of(plane_ground(0, 0, 0), {board(1), box_model({1, 1, 2})},
                          {{.p_DO = {8, 1, 1}},
                           {.p_DO = {6, -1.5, 1}, .model = 1},
                           {.p_DO = {11, -2, 1}, .model = 1}}),
                 looking({0, 0, 2.5}, {8, 0, 0})});
  all.push_back({"foliage",
                 scene_of(plane_ground(0, 0, 0), {crown(4000, 1.5, 0.08)},
                          {{.p_DO = {8, 0, 2.2}}, {.p_DO = {10, 3, 1.8}}, {.p_DO = {9, -3, 2}}}),
                 looking({0, 0, 2}, {8, 0, 1.2})});
  return all;
}

// Squares of errors against the mean of many images, and the share of errors that are improbable.
struct Scatter {
  double errors = 0, expected = 0, beyond = 0;
};

// Errors are judged against the mean of all images, each of which is part of it: their squares are
// multiplied by n / (n - 1).
Scatter scatter_of(const Sight& sight, const SamplingSpec& sampling, std::uint32_t images) {
  constexpr glm::ivec2 size_px(32, 24);
  const Sky sky(
      {.dome = AnalyticSky{}, .sun = SunSpec{SunAngles{.azimuth_deg = 60, .elevation_deg = 35}}});
  const PathTracer light(sight.scene, sky, sampling.depth, std::nullopt);
  const Camera camera(
      {.lens = Pinhole{centred(25.6, size_px)}, .size_px = size_px, .sampling = sampling});
  std::vector<Exposure> all;
  std::vector<double> mean(std::size_t{3} * size_px.x * size_px.y);
  for (std::uint32_t frame = 0; frame < images; ++frame) {
    all.push_back(camera.expose(light, gliding(sight.X_DC, {}), 0ns, {.frame = frame}));
    const auto values = all.back().radiance.values();
    for (std::size_t i = 0; i < mean.size(); ++i)
      mean[i] += static_cast<double>(values[i]) / images;
  }
  const double four_sigma = boost::math::cdf(boost::math::normal(), -4.0);
  const double most =
      -boost::math::quantile(boost::math::students_t(standard_error_freedom), four_sigma);
  const double correction = images / (images - 1.0);
  Scatter sum;
  for (const Exposure& one : all) {
    for (std::size_t i = 0; i < mean.size(); ++i) {
      const double error = static_cast<double>(one.radiance.values()[i]) - mean[i];
      const double sigma = one.standard_error.values()[i];
      sum.errors += error * error * correction;
      sum.expected += sigma * sigma;
      const double rounding = 1e-6 * mean[i];  // of floats, and of tables of the sky
      if (std::abs(error) > most * sigma + rounding) sum.beyond += 1;
    }
  }
  sum.beyond /= static_cast<double>(mean.size() * images);
  return sum;
}

void expect_true_errors(const SamplingSpec& sampling, std::uint32_t images) {
  for (const Sight& sight : sights()) {
    const Scatter found = scatter_of(sight, sampling, images);
    const double ratio = std::sqrt(found.errors / found.expected);
    EXPECT_NEAR(ratio, 1, 0.1) << sight.name;
    EXPECT_LE(found.beyond, 2e-4) << sight.name;
    testing::record_margin("standard error, " + sight.name, ratio - 1, 0.1);
  }
}

// The ratio of the true spread to the standard error is measured to 1 or 2 % by these numbers of
// images.
TEST(StandardError, IsTheSpreadOfImages) {
  expect_true_errors({.samples = 16, .most_samples = 16}, 64);
}

TEST(StandardError, IsTheSpreadOfImagesOfManyPaths) {
  expect_true_errors({.samples = 64, .most_samples = 64}, 24);
}

TEST(StandardError, IsTheSpreadOfAdaptiveImages) {
  expect_true_errors({.samples = 16, .most_samples = 128, .relative_error = 0.02}, 24);
}

// An edge that few of a pixel's nets see: neither net may differ, yet the error is not none.
TEST(StandardError, IsNotZeroBesideWhatNeighboursSee) {
  PathSpreads spreads{ImageF(9, 1, 1), ImageF(9, 1, 3), ImageF(9, 1, 3)};
  std::ranges::fill(spreads.paths.values(), 16.0f);
  spreads.between.at(4, 0)[0] = spreads.within.at(4, 0)[0] = 8;
  const ImageF errors = standard_errors(spreads);
  // Own difference 8, six degrees of freedom within nets and the mean 8 / n of n pixels around.
  EXPECT_FLOAT_EQ(errors.at(4, 0)[0], std::sqrt((8 + 6 * 8 + 8.0f / 9) / 8));
  EXPECT_FLOAT_EQ(errors.at(3, 0)[0], std::sqrt(8.0f / 8 / 8));
  EXPECT_FLOAT_EQ(errors.at(0, 0)[0], std::sqrt(8.0f / 5 / 8));
  EXPECT_EQ(errors.at(4, 0)[1], 0);
}

// Normal numbers without any stratification: the variance of a mean of n is 1 / n by both
// estimates. Over 20,000 pixels a mean of squares with f degrees of freedom has a standard error of
// sqrt(2 / (20,000 f)): 1 % or less, and 5 of them.
TEST(PathSums, EstimateTheVarianceOfIndependentNumbers) {
  for (const std::uint32_t count : {2U, 4U, 8U, 64U}) {
    glm::dvec3 between(0), within(0);
    for (std::uint32_t pixel = 0; pixel < 20'000; ++pixel) {
      PathSums sums;
      for (std::uint32_t i = 0; i < count; ++i) {
        const auto [net, index, slot] = PathSums::place(i, count);
        ASSERT_EQ(net * count / 2 + index, i);
        const glm::dvec2 normal = random_normal({.frame = count, .pulse = pixel, .sub_ray = i});
        sums.add(slot, {normal, 1});
      }
      ASSERT_EQ(sums.count(), count);
      between += sums.between_nets() * (count / 20'000.0);
      within += sums.within_nets() * (count / 20'000.0);
    }
    for (const int k : {0, 1}) {
      EXPECT_NEAR(between[k], 1, 0.05) << count;
      EXPECT_NEAR(within[k], count == 2 ? 0 : 1, 0.05) << count;
    }
    EXPECT_EQ(between.z + within.z, 0) << "of equal numbers";
  }
}

}  // namespace
}  // namespace groundray::standard_error_test
