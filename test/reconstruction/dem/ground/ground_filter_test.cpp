#include "reconstruction/dem/ground/ground_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <random>

#include "core/error.h"

namespace groundray::ground_filter_test {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;

using Heights = std::function<double(double x_m, double y_m)>;

// Points with their true classes.
struct Scene {
  std::vector<glm::dvec3> points_m;
  std::vector<GroundClass> truth;
  std::vector<double> above_m;  // height above the ground

  void add(const glm::dvec3& p, GroundClass what, double height_m = 0) {
    points_m.push_back(p);
    truth.push_back(what);
    above_m.push_back(height_m);
  }
};

class SceneMaker {
 public:
  SceneMaker(std::uint64_t seed, Heights terrain) : random_(seed), terrain_(std::move(terrain)) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double noise_m(double sd_m) { return std::normal_distribution<double>(0, sd_m)(random_); }

  // As seen from the air: uniform density.
  void add_ground(std::size_t count, double side_m, double sd_m) {
    for (std::size_t i = 0; i < count; ++i) {
      const double x = uniform(0, side_m), y = uniform(0, side_m);
      scene.add({x, y, terrain_(x, y) + noise_m(sd_m)}, GroundClass::Ground);
    }
  }

  // As seen by a robot in the middle: the density of rays that spread evenly over distance, once
  // per turn of the head.
  void add_ground_around(std::size_t count, const glm::dvec2& middle, double reach_m, double sd_m) {
    for (std::size_t i = 0; i < count; ++i) {
      const double r = 1 + (reach_m - 1) * std::pow(uniform(0, 1), 1.5), a = uniform(0, 6.2831853);
      const double x = middle.x + r * std::cos(a), y = middle.y + r * std::sin(a);
      scene.add({x, y, terrain_(x, y) + noise_m(sd_m)}, GroundClass::Ground);
    }
  }

  void add_above(std::size_t count, const std::function<glm::dvec3()>& place) {
    for (std::size_t i = 0; i < count; ++i) {
      const glm::dvec3 p = place();
      scene.add({p.x, p.y, terrain_(p.x, p.y) + p.z}, GroundClass::Above, p.z);
    }
  }

  void add_trunk(const glm::dvec2& at, double radius_m, double height_m, std::size_t count) {
    add_above(count, [&] {
      const double a = uniform(0, 6.2831853);
      return glm::dvec3(at + radius_m * glm::dvec2(std::cos(a), std::sin(a)), uniform(0, height_m));
    });
  }

  // Returns from a ball that is partly below the ground, some from its interior; hides the ground.
  void add_bush(const glm::dvec2& at, double radius_m, std::size_t count) {
    Scene seen;
    for (std::size_t i = 0; i < scene.truth.size(); ++i) {
      if (glm::distance(glm::dvec2(scene.points_m[i]), at) > 0.9 * radius_m)
        seen.add(scene.points_m[i], scene.truth[i], scene.above_m[i]);
    }
    scene = std::move(seen);
    add_above(count, [&] {
      const double r = radius_m * std::sqrt(uniform(0, 1)), a = uniform(0, 6.2831853);
      const double top_m = 0.7 * radius_m + std::sqrt(radius_m * radius_m - r * r);
      return glm::dvec3(at + r * glm::dvec2(std::cos(a), std::sin(a)), uniform(0.5 * top_m, top_m));
    });
  }

  Scene scene;

 private:
  std::mt19937_64 random_;
  Heights terrain_;
};

// Fractions of misclassified points.
struct Errors {
  double ground_missed = 0;  // type I
  double above_taken = 0;    // type II
};

// Synthetic scenes have no wrong labels and no low plants, so they must be classified six times as
// well as real sites: the best published filter misclassifies 2.97 % of all points in the ISPRS
// test (docs/theory/ground_filter.md). Tests of scenes with another limit state the reason.
constexpr double most_wrong = 0.005;

// Points lower above the ground than `least_m` are not judged: threshold and slope cannot
// distinguish them.
Errors errors_of(const Scene& scene, const GroundPoints& found, double least_m = 0) {
  double ground = 0, missed = 0, above = 0, taken = 0;
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    const bool is_found = found.classes[i] == GroundClass::Ground;
    if (scene.truth[i] == GroundClass::Ground) {
      ++ground;
      missed += !is_found;
    } else if (scene.above_m[i] >= least_m) {
      ++above;
      taken += is_found;
    }
  }
  return {missed / std::max(1., ground), taken / std::max(1., above)};
}

// A tilted plane under noise is ground, however steep: the noise is a sixth of threshold_m. The
// border where the plane rises towards it is not judged, over the width documented at
// filter_ground.
TEST(GroundFilter, KeepsSlopesUpTo45Degrees) {
  for (const auto& options :
       {GroundFilterOptions::airborne(), GroundFilterOptions::ground_scan()}) {
    for (const double degrees : {0., 10., 25., 35., 45.}) {
      const double slope = std::tan(degrees * 3.14159265358979 / 180);
      SceneMaker maker(1, [&](double x, double y) { return slope * (0.8 * x - 0.6 * y); });
      const double side_m = 100 * options.cell_m;
      maker.add_ground(40000, side_m, options.threshold_m / 6);
      const GroundPoints found = filter_ground(maker.scene.points_m, options);
      const double border_m = (slope / options.slope + 2) * options.cell_m;
      std::size_t missed = 0;
      for (std::size_t i = 0; i < found.classes.size(); ++i) {
        const glm::dvec3& p = maker.scene.points_m[i];
        if (std::min({p.x, p.y, side_m - p.x, side_m - p.y}) < border_m) continue;
        missed += static_cast<std::size_t>(found.classes[i] != GroundClass::Ground);
      }
      EXPECT_LE(static_cast<double>(missed), 4)
          << degrees << " degrees, cells of " << options.cell_m;
    }
  }
}

TEST(GroundFilter, KeepsBothSidesOfACliff) {
  SceneMaker maker(2, [](double x, double y) { return x + 0.2 * y < 70 ? 0 : 20 + 0.05 * x; });
  maker.add_ground(80000, 140, 0.05);
  const GroundPoints found = filter_ground(maker.scene.points_m);
  // Less than the cells that the cliff crosses and one on each side: 3 of 140 columns.
  EXPECT_LE(errors_of(maker.scene, found).ground_missed, 0.02);
}

TEST(GroundFilter, SeparatesBuildingsAndTreesInAirborneScans) {
  SceneMaker maker(3,
                   [](double x, double y) { return 8 * std::sin(x / 40) + 6 * std::cos(y / 30); });
  maker.add_ground(60000, 200, 0.05);
  Scene& scene = maker.scene;
  // Roofs hide the ground.
  const auto is_roofed = [](const glm::dvec3& p) {
    return std::abs(p.x - 60) < 12 && std::abs(p.y - 70) < 8;
  };
  for (std::size_t i = 0; i < scene.points_m.size(); ++i) {
    if (!is_roofed(scene.points_m[i])) continue;
    scene.points_m[i].z += 7;
    scene.truth[i] = GroundClass::Above;
  }
  for (int tree = 0; tree < 60; ++tree) {
    const double y = maker.uniform(0, 200), x = maker.uniform(0, 200);
    maker.add_above(150, [&] {
      const double z = maker.uniform(2, 9);
      const double off_y = maker.noise_m(1.5), off_x = maker.noise_m(1.5);
      return glm::dvec3(x + off_x, y + off_y, z);
    });
  }
  const GroundPoints found = filter_ground(scene.points_m);
  const Errors errors = errors_of(scene, found);
  EXPECT_LE(errors.ground_missed, most_wrong);
  EXPECT_LE(errors.above_taken, most_wrong);
  EXPECT_EQ(found.counts.ground + found.counts.above + found.counts.below, scene.truth.size());
}

TEST(GroundFilter, NetsRemoveObjectsWiderThanTheWidestDisc) {
  SceneMaker maker(4, [](double x, double) { return 0.02 * x; });
  maker.add_ground(90000, 300, 0.03);
  Scene& scene = maker.scene;
  for (std::size_t i = 0; i < scene.points_m.size(); ++i) {
    glm::dvec3& p = scene.points_m[i];
    if (std::abs(p.x - 150) >= 40 || std::abs(p.y - 150) >= 40) continue;
    p.z += 12;
    scene.truth[i] = GroundClass::Above;
  }
  EXPECT_GT(errors_of(scene, filter_ground(scene.points_m)).above_taken, 0.9);
  const Errors cut = errors_of(scene, filter_ground(scene.points_m, {.net_m = 25}));
  EXPECT_LE(cut.above_taken, 2 * most_wrong);  // nets remove some ground as well
  EXPECT_LE(cut.ground_missed, 2 * most_wrong);
}

TEST(GroundFilter, SeparatesTrunksBushesAndBranchesInRobotScans) {
  for (const double slope : {0., 0.3, 0.6}) {
    SceneMaker maker(5, [&](double x, double y) {
      return slope * x + 0.4 * std::sin(x / 5) * std::cos(y / 4) + 0.03 * std::sin(9 * x);
    });
    maker.add_ground_around(120000, {0, 0}, 30, 0.02);
    for (int i = 0; i < 40; ++i) {
      const double x = maker.uniform(-20, 20), y = maker.uniform(-20, 20);
      maker.add_trunk({x, y}, 0.2, 4, 200);
    }
    for (int i = 0; i < 40; ++i) {
      const double y = maker.uniform(-20, 20), x = maker.uniform(-20, 20);
      maker.add_bush({x, y}, maker.uniform(0.4, 1.5), 300);
    }
    maker.add_above(4000, [&] {  // branches
      const double z = maker.uniform(1.5, 4);
      const double y = maker.uniform(-15, 15), x = maker.uniform(-15, 15);
      return glm::dvec3(x, y, z);
    });
    const GroundPoints found =
        filter_ground(maker.scene.points_m, GroundFilterOptions::ground_scan());
    // Threshold and slope classify lower points as ground, and bushes hide some of the ground.
    const Errors errors = errors_of(maker.scene, found, 0.4 + 0.5 * slope);
    // The ground is dense and its noise a seventh of the threshold: at most 240 of 120,000 points.
    EXPECT_LE(errors.ground_missed, 0.002) << slope;
    // Largest on the steepest slope: 0.038 in the mean of 16 scenes, with a standard deviation of
    // 0.009.
    EXPECT_LE(errors.above_taken, 0.05) << slope;
  }
}

TEST(GroundFilter, DropsPointsFarBelow) {
  SceneMaker maker(6, [](double x, double y) { return 0.3 * x + std::sin(y / 10); });
  maker.add_ground(40000, 100, 0.03);
  Scene& scene = maker.scene;
  for (int i = 0; i < 40; ++i) {  // each in a cell of its own
    const int column = i % 8, row = i / 8;
    const double x = 5 + 11 * column + maker.uniform(0, 5), y = 5 + 17 * row + maker.uniform(0, 5);
    scene.add({x, y, 0.3 * x + std::sin(y / 10) - maker.uniform(6, 50)}, GroundClass::Below);
  }
  const GroundPoints found = filter_ground(scene.points_m);
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    if (scene.truth[i] == GroundClass::Below) {
      EXPECT_EQ(found.classes[i], GroundClass::Below);
    }
  }
  EXPECT_LE(errors_of(scene, found).ground_missed, 1e-3);  // at the border
  EXPECT_EQ(found.counts.pit_cells, 40u);
}

// A bridge whose ends rest on the banks stays above a valley that is too deep for wide discs.
TEST(GroundFilter, KeepsTheGroundUnderABridge) {
  const Heights valley = [](double x, double) { return -6 * std::exp(-(x - 50) * (x - 50) / 200); };
  SceneMaker maker(7, valley);
  maker.add_ground(40000, 100, 0.03);
  const auto on_deck = [&] {
    const double x = maker.uniform(38, 62), y = maker.uniform(45, 55);
    return glm::dvec3(x, y, 0.3 - valley(x, y));
  };
  maker.add_above(2400, on_deck);
  const GroundPoints found = filter_ground(maker.scene.points_m);
  EXPECT_LE(errors_of(maker.scene, found).ground_missed, most_wrong);
  EXPECT_LE(errors_of(maker.scene, found).above_taken, most_wrong);
}

TEST(GroundFilter, ReportsHeightsAboveItsSurface) {
  SceneMaker maker(8, [](double x, double y) { return 0.2 * x - 0.1 * y; });
  maker.add_ground(20000, 50, 0);
  const GroundPoints found = filter_ground(maker.scene.points_m);
  for (std::size_t i = 0; i < found.height_m.size(); ++i) {
    const glm::dvec3& p = maker.scene.points_m[i];
    if (std::min({p.x, p.y, 50 - p.x, 50 - p.y}) < 3) continue;
    EXPECT_NEAR(found.height_m[i], 0, 0.02);  // on a plane that rises by 0.22 m from cell to cell
  }
  EXPECT_NEAR(found.surface.height_m_at({25, 25}).value(), 2.5, 0.02);
}

TEST(GroundFilter, AcceptsFewPoints) {
  const std::vector<glm::dvec3> one{{5, 6, 7}};
  const GroundPoints alone = filter_ground(one);
  EXPECT_THAT(alone.classes, Each(GroundClass::Ground));
  EXPECT_EQ(alone.height_m[0], 0);
  EXPECT_EQ(alone.counts.ground, 1u);

  const std::vector<glm::dvec3> same(1000, {5, 6, 7});
  EXPECT_EQ(filter_ground(same).counts.ground, 1000u);

  const std::vector<glm::dvec3> pole{{5, 6, 7}, {5, 6, 8}, {5, 6, 9}};
  EXPECT_THAT(filter_ground(pole).classes,
              ::testing::ElementsAre(GroundClass::Ground, GroundClass::Above, GroundClass::Above));

  std::vector<glm::dvec3> line;
  for (int i = 0; i < 300; ++i) line.emplace_back(i * 0.3, 0, 0.04 * i);
  EXPECT_EQ(filter_ground(line).counts.ground, 300u);
}

TEST(GroundFilter, DoesNotDependOnOrderThreadsOrShiftsByWholeCells) {
  SceneMaker maker(9, [](double x, double y) { return std::sin(x / 9) * std::cos(y / 7); });
  maker.add_ground(20000, 60, 0.05);
  maker.add_trunk({30, 30}, 1, 10, 500);
  std::vector<glm::dvec3> points_m = maker.scene.points_m;
  points_m.insert(points_m.end(), points_m.begin(), points_m.begin() + 5000);
  for (glm::dvec3& p : points_m) p = glm::round(p * 64.) / 64.;  // ties, and exact shifts
  const GroundPoints first = filter_ground(points_m);

  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const GroundPoints alone = filter_ground(points_m);
  EXPECT_EQ(alone.classes, first.classes);
  EXPECT_EQ(alone.height_m, first.height_m);

  std::vector<glm::dvec3> moved;
  for (const glm::dvec3& p : points_m) moved.push_back(p + glm::dvec3(4096, -8192, 0));
  EXPECT_EQ(filter_ground(moved).height_m, first.height_m);

  std::ranges::reverse(points_m);
  GroundPoints turned = filter_ground(points_m);
  std::ranges::reverse(turned.height_m);
  EXPECT_EQ(turned.height_m, first.height_m);
}

TEST(GroundFilter, ReportsProgress) {
  std::vector<double> shares;
  SceneMaker maker(10, [](double, double) { return 0; });
  maker.add_ground(1000, 30, 0.1);
  filter_ground(maker.scene.points_m, {}, {.progress = [&](double s) { shares.push_back(s); }});
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_GE(shares.size(), 5u);
  EXPECT_EQ(shares.back(), 1);
}

std::string fault_of(const std::vector<glm::dvec3>& points_m,
                     const GroundFilterOptions& options = {}, const RunControl& work = {}) {
  try {
    filter_ground(points_m, options, work);
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST(GroundFilter, RejectsInvalidPointsAndOptions) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::vector<glm::dvec3> fine{{0, 0, 0}, {1, 1, 0}};
  EXPECT_EQ(fault_of(fine), "none");
  EXPECT_THAT(fault_of({}), HasSubstr("no points"));
  EXPECT_THAT(fault_of({{0, 0, 0}, {0, nan, 0}}), AllOf(HasSubstr("point 1"), HasSubstr("finite")));
  EXPECT_THAT(fault_of({{0, -infinity, 0}}), HasSubstr("point 0"));
  EXPECT_THAT(fault_of({{0, 0, 2e5}}), HasSubstr("100 km"));
  EXPECT_THAT(fault_of({{0, 0, 0}, {1e9, 1e9, 0}}), HasSubstr("larger cell_m"));
  EXPECT_THAT(fault_of({{0, 0, 0}, {1e300, 0, 0}}), HasSubstr("million km"));
  EXPECT_EQ(fault_of({{1e9, -1e9, 5}, {1e9, -1e9, 5}}, {.cell_m = 1e-9, .window_radius_m = 0}),
            "none");
  // 4 million cells of 40 bytes for two points.
  EXPECT_THAT(fault_of({{0, 0, 0}, {2000, 2000, 0}}), HasSubstr("more than 64 per point"));
  EXPECT_EQ(fault_of({{0, 0, 0}, {1500, 1500, 0}}, {.window_radius_m = 1}), "none");
  EXPECT_THAT(fault_of({{0, 0, 0}, {1000, 1000, 0}}, {}, {.most_bytes = 1'000'000}),
              AllOf(HasSubstr("40.1 MB"), HasSubstr("1.0 MB allowed")));
  EXPECT_THAT(fault_of(fine, {.cell_m = 0, .slope = -1, .threshold_m = nan}),
              AllOf(HasSubstr("cell_m = 0"), HasSubstr("slope = -1"), HasSubstr("threshold_m")));
  EXPECT_THAT(fault_of(fine, {.window_radius_m = 2000}), HasSubstr("1000 cells"));
  EXPECT_THAT(fault_of(fine, {.net_m = 2000}), HasSubstr("1000 cells"));
}

}  // namespace
}  // namespace groundray::ground_filter_test
