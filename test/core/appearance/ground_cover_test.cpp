#include "core/appearance/ground_cover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>

#include "core/error.h"

namespace groundray::ground_cover_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double degree = std::numbers::pi / 180;
// Fractions and tints are floats.
constexpr double float_error = 4e-7;

GroundCover::Point on_slope(double slope_rad, double height_m = 0, glm::dvec2 p = {0, 0}) {
  return GroundCover::on_facet({p, height_m}, {std::sin(slope_rad), 0, std::cos(slope_rad)});
}

// An image of one row.
Texture row_of(std::initializer_list<float> values, Wrap wrap) {
  ImageF image(static_cast<int>(values.size()), 1, 1);
  std::ranges::copy(values, image.values().begin());
  return {std::move(image), wrap};
}

std::shared_ptr<const Drape> drape(Texture image, glm::dvec2 corner_m, glm::dvec2 size_m) {
  return std::make_shared<const Drape>(Drape{std::move(image), corner_m, size_m});
}

TEST(GroundCover, BlendsAreCentredOnTheirLimits) {
  const GroundCover cover(
      {{}, {.material = 1, .slope_rad = {30 * degree, 60 * degree, 10 * degree}}}, nullptr, {});
  for (const auto& [slope_deg, share] : {std::pair{24.0, 0.0},
                                         {27.5, 0.25},
                                         {30.0, 0.5},
                                         {35.0, 1.0},
                                         {55.0, 1.0},
                                         {60.0, 0.5},
                                         {62.5, 0.25}}) {
    const auto shares = cover.shares_at(on_slope(slope_deg * degree));
    EXPECT_NEAR(shares[1], share, float_error) << slope_deg;
    EXPECT_NEAR(shares[0], 1 - share, float_error) << slope_deg;
  }
}

TEST(GroundCover, LimitsWithoutABlendAreInclusive) {
  const GroundCover cover({{}, {.height_m = {10, 20, 0}}}, nullptr, {});
  const double below = std::nextafter(10, 0), above = std::nextafter(20, 30);
  for (const auto& [height_m, share] :
       {std::pair{10.0, 1.0f}, {20.0, 1.0f}, {below, 0.0f}, {above, 0.0f}})
    EXPECT_EQ(cover.shares_at(on_slope(0, height_m))[1], share) << height_m;
}

TEST(GroundCover, EachLayerHidesThoseBelow) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform;
  for (int round = 0; round < 100; ++round) {
    std::vector<CoverLayer> layers(1 + random() % GroundCover::most_layers);
    for (std::size_t i = 1; i < layers.size(); ++i)
      layers[i].height_m = {100 * uniform(random), 200, 50 * uniform(random)};
    const GroundCover cover(layers, nullptr, {});
    const auto point = on_slope(0, 100 * uniform(random));
    const auto shares = cover.shares_at(point);
    double left = 1;
    for (std::size_t i = layers.size(); i-- > 0;) {
      const double own = i == 0 ? 1 : layers[i].height_m.share(point.p_D.z);
      EXPECT_NEAR(shares[i], left * own, float_error);
      left *= 1 - own;
    }
    EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), 1, 8 * float_error);
  }
}

TEST(GroundCover, MasksAreLinearBetweenPixelCentresAndZeroOutside) {
  const auto mask = drape(row_of({0, 1}, Wrap::Clamp), {100, 200}, {20, 10});
  const GroundCover cover({{}, {.mask = mask}}, nullptr, {});
  const auto share = [&](double x, double y) { return cover.shares_at(on_slope(0, 0, {x, y}))[1]; };
  EXPECT_EQ(share(102, 205), 0);
  EXPECT_NEAR(share(107.5, 205), 0.25, float_error);  // centres at 105 and 115 m
  EXPECT_NEAR(share(110, 201), 0.5, float_error);
  EXPECT_EQ(share(119, 205), 1);
  EXPECT_EQ(share(120.1, 205), 0);
  EXPECT_EQ(share(119, 210.1), 0);
}

TEST(GroundCover, TexturesHaveAMeanTintOfOne) {
  const GroundTexture texture{
      std::make_shared<const Texture>(row_of({0.1f, 0.2f, 0.9f, 0.4f}, Wrap::Repeat)), nullptr, 2};
  const GroundCover cover({{.texture = texture}}, nullptr, {});
  double sum = 0;
  for (int i = 0; i < 64; ++i) {  // whole copies of a piecewise linear function: exact
    const double x = 7 + (i + 0.5) * 2.0 / 64;
    const Tint tint = cover.tint_at(0, on_slope(0, 0, {x, 3}), {}, Filtering::Exact);
    EXPECT_EQ(tint.color, glm::vec3(tint.brightness));
    sum += tint.brightness / 64;
  }
  EXPECT_NEAR(sum, 1, float_error);
  const double peak = cover.tint_at(0, on_slope(0, 0, {1.25, 0}), {}, Filtering::Exact).brightness;
  EXPECT_NEAR(peak, 0.9 / 0.4, float_error * 4);  // the third texel's centre; their mean is 0.4
}

TEST(GroundCover, FootprintsOfCompleteRepeatsSeeTheMean) {
  const GroundTexture texture{
      std::make_shared<const Texture>(row_of({0.1f, 0.2f, 0.9f, 0.4f}, Wrap::Repeat)), nullptr, 2};
  const GroundCover cover({{.texture = texture}}, nullptr, {});
  const SurfacePatch patch{{6, 0, 0}, {0, 2, 0}};
  const Tint tint = cover.tint_at(0, on_slope(0, 0, {0.3, 0.1}), patch, Filtering::Exact);
  EXPECT_NEAR(tint.brightness, 1, float_error);
}

TEST(GroundCover, OrthophotosVaryEachLayerAboutItsOwnMean) {
  // Layer 1 covers ground higher than 5 m, here beyond x = 2: the bright half of the picture.
  const auto picture = drape(row_of({0.1f, 0.3f, 0.6f, 0.8f}, Wrap::Clamp), {0, 0}, {4, 4});
  std::vector<GroundCover::Point> points;
  for (int i = 0; i < 4; ++i) points.push_back(on_slope(0, i < 2 ? 0 : 10, {i + 0.5, 1}));
  const GroundCover cover({{}, {.height_m = {5, 20, 0}}}, picture, points);
  const auto brightness = [&](std::size_t layer, std::size_t point) {
    return cover.tint_at(layer, points[point], {}, Filtering::Exact).brightness;
  };
  EXPECT_NEAR(brightness(0, 0), 0.1 / 0.2, float_error);
  EXPECT_NEAR(brightness(0, 1), 0.3 / 0.2, float_error);
  EXPECT_NEAR(brightness(1, 2), 0.6 / 0.7, float_error);
  EXPECT_NEAR(brightness(1, 3), 0.8 / 0.7, float_error);
  const Tint outside = cover.tint_at(0, on_slope(0, 0, {5, 5}), {}, Filtering::Exact);
  EXPECT_EQ(outside.brightness, 1);
}

TEST(GroundCover, BrightnessIsLuminance) {
  ImageF image(2, 1, 3);
  std::ranges::copy(std::initializer_list<float>{1, 0, 0, 0, 1, 0}, image.values().begin());
  const auto picture = drape(Texture(std::move(image), Wrap::Clamp), {0, 0}, {2, 2});
  const std::vector points{on_slope(0, 0, {0.5, 1}), on_slope(0, 0, {1.5, 1})};
  const GroundCover cover({{}}, picture, points);
  const Tint red = cover.tint_at(0, points[0], {}, Filtering::Exact);
  EXPECT_NEAR(red.brightness, 2 * 0.2126 / (0.2126 + 0.7152), float_error);
  EXPECT_NEAR(red.color.r, 2, float_error);
  EXPECT_EQ(red.color.g, 0);
  EXPECT_EQ(red.color.b, 1);  // the picture has no blue
}

// A normal map of one texel, on ground that faces each way: x of the map runs along the first
// horizontal axis, y along the other, or up a wall.
TEST(GroundCover, NormalMapsTiltByTheirTexel) {
  const glm::dvec3 bump = glm::normalize(glm::dvec3(0.36, 0.48, 0.8));
  ImageF image(1, 1, 3);
  for (int k = 0; k < 3; ++k)
    image.at(0, 0)[static_cast<std::size_t>(k)] = static_cast<float>(0.5 + 0.5 * bump[k]);
  const GroundTexture texture{
      nullptr, std::make_shared<const Texture>(Texture(std::move(image), Wrap::Repeat)), 1};
  const GroundCover cover({{.texture = texture}}, nullptr, {});
  const auto normal = [&](const glm::dvec3& facet) {
    return cover.shading_normal_at({{0.2, 0.7, 0}, facet}, {}, Filtering::Exact);
  };
  const auto expect_near = [](const glm::dvec3& a, const glm::dvec3& b) {
    EXPECT_LT(glm::distance(a, b), 2 * float_error) << a.x << ' ' << a.y << ' ' << a.z;
  };
  expect_near(normal({0, 0, 1}), bump);
  expect_near(normal({1, 0, 0}), {bump.z, bump.x, bump.y});
  expect_near(normal({0, -1, 0}), {bump.x, -bump.z, bump.y});
}

TEST(GroundCover, LayersWithoutBumpsKeepTheFacetsNormal) {
  const GroundCover cover({{}, {.height_m = {0, 1, 0}}}, nullptr, {});
  const auto point = on_slope(0.3, 0.5);
  EXPECT_LT(glm::distance(cover.shading_normal_at(point, {}, Filtering::Fast), point.normal),
            1e-15);
}

TEST(GroundCover, RejectsInvalidLayers) {
  const auto make = [](const std::vector<CoverLayer>& layers) {
    return [layers] { GroundCover(layers, nullptr, {}); };
  };
  const auto nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(make({}), ThrowsMessage<Error>(HasSubstr("0 layers; there must be from 1 to 8")));
  EXPECT_THAT(make(std::vector<CoverLayer>(9)), ThrowsMessage<Error>(HasSubstr("9 layers")));
  EXPECT_THAT(make({{.height_m = {0, 5, 0}}}),
              ThrowsMessage<Error>(HasSubstr("layer 1 must have no limits and no mask")));
  EXPECT_THAT(
      make({{}, {.height_m = {5, 0, 0}}}),
      ThrowsMessage<Error>(HasSubstr("layer 2: its height from 5 to 0 is an empty interval")));
  EXPECT_THAT(make({{}, {.slope_rad = {nan, 1, 0}}}),
              ThrowsMessage<Error>(HasSubstr("empty interval")));
  EXPECT_THAT(make({{}, {.slope_rad = {0, 1, -1}}}),
              ThrowsMessage<Error>(HasSubstr("the blend of its slope = -1")));
  EXPECT_THAT(make({{.texture = GroundTexture{nullptr, nullptr, 0}}}),
              ThrowsMessage<Error>(HasSubstr("size_m = 0")));
}

// A line along x from 0 to 20 at y = 5; shares follow from y alone beside it.
TEST(GroundCover, SharesFollowTheDistanceFromLines) {
  TangentLine line{.points_m = {}, .tangents = {}, .spacing_m = 1};
  for (int x = 0; x <= 20; ++x) {
    line.points_m.emplace_back(x, 5);
    line.tangents.emplace_back(1, 0);
  }
  const auto field = std::make_shared<const LineField>(line, 6);
  CoverLayer on{.material = 1, .distance_m = {.high = 0, .blend = 1}, .lines = {{field, 0, 2}}};
  CoverLayer ruts{.material = 2, .distance_m = {.high = 0.25}, .lines = {{field, 0.8, 0}}};
  CoverLayer away{.material = 3, .distance_m = {.low = 3}, .lines = {{field, 0, 2}}};
  const GroundCover cover({{}, on, ruts, away}, nullptr, {});
  for (double y = -40; y < 40; y += 0.01) {
    const double off_m = std::abs(y - 5);
    const double is_rut = std::abs(off_m - 0.8) <= 0.25 ? 1 : 0, is_away = off_m >= 5 ? 1 : 0;
    const double on_share = (1 - is_rut) * (1 - is_away) * std::clamp(2.5 - off_m, 0.0, 1.0);
    if (std::abs(std::abs(off_m - 0.8) - 0.25) < 1e-6 || std::abs(off_m - 5) < 1e-6) continue;
    const auto shares = cover.shares_at(GroundCover::on_facet({10, y, 0}, {0, 0, 1}));
    ASSERT_NEAR(shares[1], on_share, 1e-6) << y;
    ASSERT_EQ(shares[2], is_rut) << y;
    ASSERT_EQ(shares[3], is_away) << y;
  }
}

}  // namespace
}  // namespace groundray::ground_cover_test
