#include "sensors/camera/lens/lens.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "core/error.h"
#include "test/support/lens_samples.h"
#include "test/support/margin.h"

namespace groundray::lens_test {
namespace {

using groundray::testing::centred;
using groundray::testing::LensSample;
using groundray::testing::sample_lenses;
using ::testing::ThrowsMessage;

constexpr double pi = std::numbers::pi;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

std::vector<PixelRay> table_of(const Lens& lens) {
  const glm::ivec2 size_px = lens.size_px();
  std::vector<PixelRay> rays(static_cast<std::size_t>(size_px.x * size_px.y));
  lens.fill(0, size_px.y, rays);
  return rays;
}

bool looks_somewhere(const PixelRay& ray) { return ray.direction != glm::dvec3(0); }

// Calls `act` with each pixel of an image and its ray.
void for_each_pixel(const Lens& lens,
                    const std::function<void(const glm::dvec2&, const PixelRay&)>& act) {
  std::size_t i = 0;
  const auto rays = table_of(lens);
  for (int y = 0; y < lens.size_px().y; ++y) {
    for (int x = 0; x < lens.size_px().x; ++x) act({x, y}, rays[i++]);
  }
}

std::vector<glm::dvec3> random_directions(std::size_t count, double farthest_rad) {
  std::mt19937_64 random(20260114);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<glm::dvec3> directions;
  while (directions.size() < count) {
    const double z = 1 - unit(random) * (1 - std::cos(farthest_rad)),
                 azimuth = 2 * pi * unit(random);
    const double sine = std::sqrt(1 - z * z);
    directions.emplace_back(sine * std::cos(azimuth), sine * std::sin(azimuth), z);
  }
  return directions;
}

// Pixel error, beyond 1e-9 px, that a few ulps of the direction cause; `least` is the ray's angle
// per pixel in the direction where it is smallest.
double rounding_px(const PixelRay& ray) {
  const double least = glm::length(glm::cross(ray.by_u, ray.by_v)) /
                       std::max(glm::length(ray.by_u), glm::length(ray.by_v));
  return 8 * std::numeric_limits<double>::epsilon() / least;
}

// Shared by all tests, because finding its limits takes longer than some of them.
const Lens& shared_lens(const LensSample& sample) {
  static std::map<std::string, Lens> lenses;
  const auto found = lenses.find(sample.name);
  if (found != lenses.end()) return found->second;
  return lenses.emplace(sample.name, Lens(sample.model, sample.size_px)).first->second;
}

struct EveryLens : ::testing::TestWithParam<LensSample> {
  const Lens& lens = shared_lens(GetParam());
};
INSTANTIATE_TEST_SUITE_P(Samples, EveryLens, ::testing::ValuesIn(sample_lenses()),
                         [](const auto& sample) {
                           std::string name = sample.param.name;
                           std::erase_if(name, [](char c) { return !std::isalnum(c); });
                           return name;
                         });

TEST_P(EveryLens, ProjectsTheRayOfAPixelToThePixel) {
  std::size_t seen = 0;
  for_each_pixel(lens, [&](const glm::dvec2& pixel, const PixelRay& ray) {
    if (!looks_somewhere(ray)) return;
    ++seen;
    const auto back = lens.project(ray.direction);
    ASSERT_TRUE(back) << pixel.x << ", " << pixel.y;
    EXPECT_LT(glm::distance(*back, pixel), 1e-9 + rounding_px(ray)) << pixel.x << ", " << pixel.y;
    testing::record_margin("pixel", glm::distance(*back, pixel), 1e-9 + rounding_px(ray), "px");
    EXPECT_NEAR(glm::length(ray.direction), 1, 4e-16);
    const auto far = lens.project(17.0 * ray.direction);
    ASSERT_TRUE(far);
    EXPECT_LT(glm::distance(*far, pixel), 1e-9 + 2 * rounding_px(ray));
  });
  EXPECT_GT(seen, table_of(lens).size() / 5);
}

TEST_P(EveryLens, InvertsEveryProjectionWithinTwiceTheImage) {
  std::size_t seen = 0;
  for (const glm::dvec3& direction : random_directions(1500, pi)) {
    const auto pixel = lens.project(direction);
    EXPECT_EQ(pixel.has_value(), lens.images(direction));
    const glm::dvec2 size_px = lens.size_px();
    if (!pixel || glm::any(glm::greaterThan(glm::abs(*pixel - size_px / 2.0), size_px))) continue;
    const auto ray = lens.ray(*pixel);
    ASSERT_TRUE(ray) << pixel->x << ", " << pixel->y;
    // The ray is that of the pixel to 1e-9 px.
    const double off = 1e-9 * (glm::length(ray->by_u) + glm::length(ray->by_v)) + 1e-14;
    EXPECT_LT(glm::distance(ray->direction, direction), off) << pixel->x << ", " << pixel->y;
    ++seen;
  }
  EXPECT_GT(seen, 50);
}

TEST_P(EveryLens, RayOfAPixelIsTheSameAloneAndInItsRow) {
  int differ = 0;
  for_each_pixel(lens, [&](const glm::dvec2& pixel, const PixelRay& filled) {
    if ((static_cast<int>(pixel.x) + 3 * static_cast<int>(pixel.y)) % 7 != 0) return;
    const auto alone = lens.ray(pixel);
    if (alone.has_value() != looks_somewhere(filled)) {
      ++differ;
      return;
    }
    if (!alone) return;
    const double scale = glm::length(filled.by_u) + glm::length(filled.by_v);
    EXPECT_LT(glm::distance(alone->direction, filled.direction), 2e-9 * scale + 1e-14);
  });
  EXPECT_EQ(differ, 0);
}

TEST_P(EveryLens, RaysDoNotDependOnHowRowsAreSplit) {
  const auto all = table_of(lens);
  const auto width = static_cast<std::size_t>(lens.size_px().x);
  for (const int step : {1, 7}) {
    for (int begin = 0; begin < lens.size_px().y; begin += 5 * step) {
      const int end = std::min(begin + step, lens.size_px().y);
      std::vector<PixelRay> rows(static_cast<std::size_t>(end - begin) * width);
      lens.fill(begin, end, rows);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        const PixelRay& other = all[static_cast<std::size_t>(begin) * width + i];
        ASSERT_EQ(looks_somewhere(rows[i]), looks_somewhere(other)) << begin << ": " << i;
        const double scale = glm::length(other.by_u) + glm::length(other.by_v);
        EXPECT_LE(glm::distance(rows[i].direction, other.direction), 2e-9 * scale + 1e-14);
      }
    }
  }
}

// Excludes the vicinity of a fold, where derivatives grow without bound. Differences over 0.002 px
// have relative errors of about (0.002 / 5)^2, and 3e-10 / 0.002 from the rays' own errors.
TEST_P(EveryLens, RayDerivativesMatchFiniteDifferences) {
  if (GetParam().name == "rational 8, pole") return;  // it bends within a pixel
  constexpr double h = 0.002;
  const double at_axis = glm::length(lens.ray(*lens.project({0, 0, 1}))->by_u);
  int seen = 0;
  for_each_pixel(lens, [&](const glm::dvec2& pixel, const PixelRay& ray) {
    if (!looks_somewhere(ray) || static_cast<int>(pixel.x * 3 + pixel.y * 5) % 41 != 0) return;
    if (std::max(glm::length(ray.by_u), glm::length(ray.by_v)) > 3 * at_axis) return;
    for (int eighth = 0; eighth < 8; ++eighth) {
      const glm::dvec2 far =
          25.0 * glm::dvec2(std::cos(eighth * pi / 4), std::sin(eighth * pi / 4));
      if (!std::holds_alternative<Equirectangular>(lens.model()) && !lens.ray(pixel + far)) return;
    }
    const auto difference = [&](const glm::dvec2& along) {
      const auto a = lens.ray(pixel - along), b = lens.ray(pixel + along);
      return a && b ? (b->direction - a->direction) / (2 * h) : glm::dvec3(nan);
    };
    EXPECT_LT(glm::distance(ray.by_u, difference({h, 0})), 1e-6 * glm::length(ray.by_u));
    EXPECT_LT(glm::distance(ray.by_v, difference({0, h})), 1e-6 * glm::length(ray.by_v));
    // Conversely, the image moves by one pixel.
    const auto moved = [&](const glm::dvec3& by) {
      return (*lens.project(ray.direction + h * by) - *lens.project(ray.direction - h * by)) /
             (2 * h);
    };
    EXPECT_LT(glm::distance(moved(ray.by_u), {1, 0}), 1e-6);
    EXPECT_LT(glm::distance(moved(ray.by_v), {0, 1}), 1e-6);
    ++seen;
  });
  EXPECT_GT(seen, 20);
}

// The determinant from differences of projections, which are independent of the fold.
TEST_P(EveryLens, PreservesOrientationUpToItsLimit) {
  constexpr double h = 1e-6;
  for (const glm::dvec3& end : random_directions(60, pi)) {
    if (!lens.images(end)) continue;
    const double angle = std::acos(end.z), azimuth = std::atan2(end.y, end.x);
    for (int i = 1; i <= 20; ++i) {
      const double part = angle * i / 20 - 1e-4;
      const auto image = [&](double off, double turn) {
        const double t = part + off, a = azimuth + turn / std::sin(part);
        return lens.project({std::sin(t) * std::cos(a), std::sin(t) * std::sin(a), std::cos(t)});
      };
      const auto out = image(h, 0), in = image(-h, 0), left = image(0, h), right = image(0, -h);
      if (!out || !in || !left || !right) continue;
      const glm::dvec2 radial = *out - *in, around = *left - *right;
      EXPECT_GT(radial.x * around.y - radial.y * around.x, 0) << angle;
    }
  }
}

// First position where `slope` ceases to be positive, by steps of 1e-4 and bisection.
double first_root(const std::function<double(double)>& slope, double end) {
  double low = 0;
  while (slope(low + 1e-4) > 0 && low < end) low += 1e-4;
  double high = low + 1e-4;
  for (int i = 0; i < 60; ++i) (slope((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
  return low;
}

// Expects pixels to have a ray if and only if they are nearer to the centre than `reach_px`;
// returns the fraction that do.
double share_within(const Lens& lens, const glm::dvec2& centre_px, double reach_px) {
  std::size_t valid = 0, all = 0;
  for_each_pixel(lens, [&](const glm::dvec2& pixel, const PixelRay& ray) {
    const double distance_px = glm::distance(pixel, centre_px);
    ++all;
    valid += looks_somewhere(ray) ? 1 : 0;
    if (std::abs(distance_px - reach_px) < 1e-6) return;
    EXPECT_EQ(looks_somewhere(ray), distance_px < reach_px)
        << pixel.x << ", " << pixel.y << ": " << distance_px - reach_px;
  });
  return static_cast<double>(valid) / static_cast<double>(all);
}

TEST(Lens, MarksPixelsBeyondTheFoldOfRadialDistortion) {
  const glm::ivec2 size_px(480, 270);
  const auto reach = [](const std::array<double, 3>& k) {
    const double r = first_root(
        [&](double x) {
          const double s = x * x;
          return 1 + s * (3 * k[0] + s * (5 * k[1] + s * 7 * k[2]));
        },
        20);
    return std::pair(r, r * (1 + r * r * (k[0] + r * r * (k[1] + r * r * k[2]))));
  };
  for (const std::array<double, 3> k :
       {std::array{-0.36, 0.14, -0.024}, {-0.3, 0.0, 0.0}, {-0.2, 0.01, 0.0}, {0.1, -0.05, 0.0}}) {
    const PixelScale scale = centred(250, size_px);
    const Lens lens(BrownConrady{scale, {k[0], k[1], 0, 0, k[2]}}, size_px);
    const auto [radius, image] = reach(k);
    EXPECT_NEAR(std::tan(lens.limit_rad(1)), radius, 1e-6);
    const double share = share_within(lens, scale.centre_px, 250 * image);
    // A 1080p action camera: r* = 1.60 is imaged at 0.949, but its corners need 1.101.
    if (k[0] == -0.36) {
      EXPECT_NEAR(radius, 1.60, 0.005);
      EXPECT_NEAR(image, 0.949, 5e-4);
      EXPECT_NEAR(share, 0.935, 0.004);
    }
  }
}

TEST(Lens, FisheyesProjectBeyondNinetyDegrees) {
  const glm::ivec2 size_px(300, 300);
  const std::array<double, 4> k{-0.02, 0.003, -0.004, 0.0002};
  const auto image = [&](double t) {
    const double s = t * t;
    return t * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
  };
  const double fold = first_root(
      [&](double t) {
        const double s = t * t;
        return 1 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3])));
      },
      pi);
  ASSERT_GT(fold, pi / 2);
  ASSERT_LT(fold, 2.5);
  const PixelScale scale = centred(100, size_px);
  const Lens lens(KannalaBrandt{scale, k}, size_px);
  EXPECT_NEAR(lens.limit_rad(2), fold, 1e-7);
  EXPECT_LT(share_within(lens, scale.centre_px, 100 * image(fold)), 0.95);
  for (const double t : {1e-12, 1e-5, 0.3, pi / 2, fold - 0.01}) {
    const auto pixel = lens.project({std::sin(t) * 0.6, std::sin(t) * -0.8, std::cos(t)});
    ASSERT_TRUE(pixel);
    EXPECT_LT(glm::distance(*pixel, scale.centre_px + 100 * image(t) * glm::dvec2(0.6, -0.8)),
              1e-11);
  }
}

// Bounds of Khomutenko et al. (2016), section III.
TEST(Lens, EnhancedUnifiedModelHasThePublishedBounds) {
  const glm::ivec2 size_px(200, 200);
  const PixelScale scale = centred(40, size_px);
  for (const auto& [alpha, beta] : {std::pair(0.7, 0.9), {0.55, 1.2}, {0.4, 1.5}, {0.0, 1.0}}) {
    const Lens lens(Eucm{scale, alpha, beta}, size_px);
    const double w = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
    for (const glm::dvec3& p : random_directions(2000, pi)) {
      const double d = std::sqrt(beta * (p.x * p.x + p.y * p.y) + p.z * p.z);
      if (std::abs(p.z + w * d) < 1e-6) continue;
      EXPECT_EQ(lens.images(p), p.z > -w * d) << p.z;
    }
    const double reach = alpha > 0.5 ? 40 / std::sqrt(beta * (2 * alpha - 1)) : infinity;
    share_within(lens, scale.centre_px, reach);
  }
}

// The second sphere images directions up to where its cosine (xi + z) / d2 is -w, the limit set by
// its fold or pole. Solved for z, that is slightly more than the w2 of Usenko et al. (2018).
TEST(Lens, DoubleSphereProjectsUpToTheLimitOfTheSecondSphere) {
  const glm::ivec2 size_px(200, 200);
  const PixelScale scale = centred(40, size_px);
  for (const auto& [xi, alpha] : {std::pair(-0.2, 0.7), {0.3, 0.55}, {0.2, 0.4}, {-0.3, 0.3}}) {
    const Lens lens(DoubleSphere{scale, xi, alpha}, size_px);
    const double w = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
    const double rim = xi * (w * w - 1) - w * std::sqrt(1 - xi * xi * (1 - w * w));
    for (const glm::dvec3& p : random_directions(2000, pi)) {
      if (std::abs(p.z - rim) < 1e-6) continue;
      EXPECT_EQ(lens.images(p), p.z > rim) << p.z;
    }
    const double reach = alpha > 0.5 ? 40 / std::sqrt(2 * alpha - 1) : infinity;
    share_within(lens, scale.centre_px, reach);
  }
}

// A mirror with xi > 1 images directions up to where the cosine is -1 / xi, at r^2 = 1 / (xi^2 -
// 1).
TEST(Lens, MirrorProjectsUpToItsLimit) {
  const glm::ivec2 size_px(200, 200);
  const PixelScale scale = centred(80, size_px);
  const double xi = 1.5;
  const Lens lens(Mei{scale, xi, {}}, size_px);
  EXPECT_NEAR(lens.limit_rad(0.3), std::acos(-1 / xi), 1e-7);
  share_within(lens, scale.centre_px, 80 / std::sqrt(xi * xi - 1));
}

// The roots of its numerator and denominator are 1.2e-5 apart: directions beyond them are not
// imaged, and half of the image looks at the near side of the gap.
TEST(Lens, DetectsANarrowPole) {
  const auto samples = sample_lenses();
  const auto sample = std::ranges::find(samples, "rational 8, pole", &LensSample::name);
  ASSERT_NE(sample, samples.end());
  const Lens lens(sample->model, sample->size_px);
  constexpr double pole = 0.808800611782852;  // root of 1 + k4 r^2 + k5 r^4 + k6 r^6, by bisection
  for (int i = 0; i < 12; ++i) EXPECT_NEAR(std::tan(lens.limit_rad(i)), pole, 1e-6);
  EXPECT_FALSE(lens.project({0.82, 0, 1}));
}

TEST(Lens, PinholeRejectsPointsBehindIt) {
  const glm::ivec2 size_px(64, 48);
  const std::array<double, 14> k{-0.1, 0, 0.01, 0.02};
  for (const LensModel& model : {LensModel(Pinhole{centred(50, size_px)}),
                                 LensModel(BrownConrady{centred(50, size_px), k})}) {
    const Lens lens(model, size_px);
    for (const glm::dvec3 p : {glm::dvec3(0, 0, -1),
                               {1, 0, 0},
                               {0.3, 0.4, -1e-9},
                               {0, 0, 0},
                               {nan, 0, 1},
                               {infinity, 0, 1}})
      EXPECT_FALSE(lens.project(p)) << p.x << ' ' << p.z;
    EXPECT_TRUE(lens.project({0, 0, 1e-100}));
  }
}

TEST(Lens, FThetaAcceptsBothPolynomialDirections) {
  const glm::ivec2 size_px(193, 121);
  const glm::dvec2 centre_px(96, 60);
  // theta = r / 50 is r = 50 theta; and a quadratic is inverted in closed form.
  const Lens forward(FTheta{centre_px, FTheta::Polynomial::AngleToPixels, {50}}, size_px);
  const Lens backward(FTheta{centre_px, FTheta::Polynomial::PixelsToAngle, {0.02}}, size_px);
  const Lens squared(FTheta{centre_px, FTheta::Polynomial::PixelsToAngle, {0.02, -4e-5}}, size_px);
  for (const glm::dvec3& p : random_directions(500, 2.4)) {
    const auto a = forward.project(p), b = backward.project(p), c = squared.project(p);
    ASSERT_TRUE(a && b);
    EXPECT_LT(glm::distance(*a, *b), 1e-11);
    const double theta = std::atan2(std::hypot(p.x, p.y), p.z);
    EXPECT_LT(glm::distance(*a, centre_px + 50 * theta * glm::normalize(glm::dvec2(p))), 1e-11);
    // 4e-5 r^2 - 0.02 r + theta = 0 up to its fold, r = 250 px at 2.5 rad.
    const double r = (0.02 - std::sqrt(4e-4 - 1.6e-4 * theta)) / 8e-5;
    ASSERT_TRUE(c);
    EXPECT_LT(glm::distance(*c, centre_px + r * glm::normalize(glm::dvec2(p))), 1e-9);
  }
  EXPECT_NEAR(squared.limit_rad(0), 2.5, 1e-9);
}

TEST(Lens, EquirectangularProjectsAllDirections) {
  const Lens lens(Equirectangular{}, {360, 180});
  const auto expect = [&](const glm::dvec3& p, double u, double v) {
    const auto pixel = lens.project(p);
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x, u, 1e-12);
    EXPECT_NEAR(pixel->y, v, 1e-12);
  };
  expect({0, 0, 1}, 179.5, 89.5);
  expect({2, 0, 0}, 269.5, 89.5);   // right
  expect({0, 3, 0}, 179.5, 179.5);  // down
  expect({0, -1, 0}, 179.5, -0.5);
  expect({1, 0, 1}, 224.5, 89.5);
  EXPECT_TRUE(lens.project({0, 0, -1}));
  EXPECT_FALSE(lens.ray({10, 180}));
  EXPECT_FALSE(lens.ray({-0.6, 10}));
  // The solid angle of a one-degree pixel at latitude b is cos(b) square degrees.
  const auto ray = lens.ray({17, 29});
  ASSERT_TRUE(ray);
  const double degree = pi / 180;
  EXPECT_NEAR(glm::length(glm::cross(ray->by_u, ray->by_v)),
              std::cos(60.5 * degree) * degree * degree, 1e-17);
}

// The three are one model: Mei's xi is alpha / (1 - alpha), and its focal length is that of the
// EUCM divided by 1 - alpha.
TEST(Lens, ThreeFormsOfTheUnifiedModelAgree) {
  const glm::ivec2 size_px(200, 150);
  for (const double alpha : {0.2, 0.5, 0.7}) {
    const Lens eucm(Eucm{centred(60, size_px), alpha, 1}, size_px);
    const Lens mei(Mei{centred(60 / (1 - alpha), size_px), alpha / (1 - alpha), {}}, size_px);
    const Lens sphere(DoubleSphere{centred(60, size_px), 0, alpha}, size_px);
    for (const glm::dvec3& p : random_directions(500, pi)) {
      const auto a = eucm.project(p), b = mei.project(p), c = sphere.project(p);
      ASSERT_EQ(a.has_value(), b.has_value());
      ASSERT_EQ(a.has_value(), c.has_value());
      if (!a || glm::length(*a) > 1e4) continue;
      EXPECT_LT(glm::distance(*a, *b), 1e-9);
      EXPECT_LT(glm::distance(*a, *c), 1e-9);
    }
  }
}

TEST(Lens, ErrorListsEveryFault) {
  const glm::ivec2 size_px(64, 48);
  const PixelScale scale = centred(50, size_px);
  const auto message = [](std::initializer_list<const char*> parts) {
    return ThrowsMessage<Error>(::testing::Truly(
        [parts = std::vector<std::string>(parts.begin(), parts.end())](const std::string& text) {
          return std::ranges::all_of(
              parts, [&](const std::string& part) { return text.find(part) != std::string::npos; });
        }));
  };
  const auto making = [](const LensModel& model, glm::ivec2 size) {
    return [model, size] { Lens{model, size}; };
  };
  EXPECT_THAT(making(Pinhole{scale}, {0, 48}), message({"lens", "an image of 0 x 48 px"}));
  EXPECT_THAT(making(Pinhole{scale}, {-3, 48}), message({"-3 x 48"}));
  EXPECT_THAT(making(Pinhole{scale}, {40000, 25000}),
              message({"40000 x 25000 px must have from 1 to 268435456", "68664 MiB"}));
  EXPECT_THAT(making(Pinhole{{{0, 50}, {1, nan}, 0}}, {0, 0}),
              message({"0 x 0", "focal lengths of (0, 50) px", "centre and skew must be finite"}));
  EXPECT_THAT(making(BrownConrady{scale, {0, nan}}, size_px), message({"coefficient 2 is nan"}));
  EXPECT_THAT(making(BrownConrady{{{50, -1}, {}, 0}}, size_px), message({"(50, -1) px"}));
  EXPECT_THAT(making(BrownConrady{scale, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2.0, 0}}, size_px),
              message({"directions near its axis have no image"}));
  EXPECT_THAT(making(KannalaBrandt{scale, {0, 0, 0, infinity}}, size_px),
              message({"coefficient 4 is inf"}));
  EXPECT_THAT(making(FTheta{}, size_px), message({"must increase at 0", "is 0"}));
  EXPECT_THAT(
      making(FTheta{{1, 1}, FTheta::Polynomial::AngleToPixels, {-5, 1}, {1, 1, 1}}, size_px),
      message({"is -5", "c - d e = 0"}));
  EXPECT_THAT(making(Eucm{scale, 1.2, 0}, size_px), message({"alpha = 1.2", "beta = 0"}));
  EXPECT_THAT(making(DoubleSphere{scale, -1, -0.1}, size_px), message({"xi = -1", "alpha = -0.1"}));
  EXPECT_THAT(making(Mei{scale, -0.1, {nan}}, size_px), message({"xi = -0.1", "coefficient 1"}));
}

}  // namespace
}  // namespace groundray::lens_test
