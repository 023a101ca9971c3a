#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/geometry/height_grid.h"
#include "terrain/trail/trail.h"
#include "terrain/trail/trails.h"
#include "test/terrain/trail/straight_trail.h"

namespace groundray::benches_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using namespace trail_test;  // NOLINT(google-build-using-namespace)

constexpr double cell_m = 0.05;
const auto flat_m = [](glm::dvec2) { return 0.0; };

Trail trail_on(const TrailSpec& spec, const std::function<double(glm::dvec2)>& ground_m) {
  return {spec, [&](glm::dvec2 p) { return std::optional<double>(ground_m(p)); }, {0, 0}, cell_m};
}

double height_m(const Trail& trail, double along_m, double across_m, double ground_m = 0) {
  Trail::Shape shape{ground_m, 1};
  trail.apply(start + along_m * along + across_m * left, shape);
  return shape.height_m;
}

// Faces of 2 m with a slope of 4, i.e. 0.5 m wide, benches 1.5 m wide, 5 m above or below the
// ground.
TrailSpec with_benches(double raised_m) {
  TrailSpec spec = straight();
  spec.width_m = 4;
  spec.raised_m = raised_m;
  spec.bank_slope = 4;
  spec.most_bank_m = 6;
  spec.benches = {.height_m = 2, .width_m = 1.5};
  return spec;
}

TEST(Benches, HaveTheirCornersAtTheirPlaces) {
  struct Corner {
    double u, z;
  };
  const std::array<Corner, 7> corners{
      {{2, 0}, {2.5, 2}, {4, 2}, {4.5, 4}, {6, 4}, {6.25, 5}, {8, 5}}};
  for (const double raised_m : {5.0, -5.0}) {
    const Trail trail = trail_on(with_benches(raised_m), flat_m);
    for (const double side : {1.0, -1.0}) {
      for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
        const auto [from, to] = std::pair(corners[i], corners[i + 1]);
        // Heights are linear from one corner to the next. Lengths are below 100 m, and the slope
        // is 4: roundings stay below 1e-12 m.
        for (double t = 0; t <= 1; t += 0.125) {
          const double u = side * std::lerp(from.u, to.u, t);
          const double z = raised_m - std::copysign(std::lerp(from.z, to.z, t), raised_m);
          ASSERT_NEAR(height_m(trail, 30, u), z, 1e-12) << u;
        }
      }
    }
  }
}

TEST(Benches, BeginBeyondTheDitch) {
  TrailSpec spec = with_benches(-5);
  spec.ditches = {.width_m = 1, .depth_m = 0.2, .side = TrailSpec::Ditches::Side::Left};
  const Trail trail = trail_on(spec, flat_m);
  EXPECT_NEAR(height_m(trail, 30, 3.5), -3, 1e-12);
  EXPECT_NEAR(height_m(trail, 30, 3.25), -4, 1e-12);
  EXPECT_NEAR(height_m(trail, 30, -3.5), -3, 1e-12);
  EXPECT_NEAR(height_m(trail, 30, -2.25), -4, 1e-12);
}

// Where no bank is higher than the first face, benches change nothing.
TEST(Benches, HigherThanTheBanksLeaveEveryHeight) {
  TrailSpec spec = straight();
  const Trail plain = trail_on(spec, plane_m);
  spec.benches = {.height_m = 2, .width_m = 1.5};
  const Trail stepped = trail_on(spec, plane_m);
  for (double s = 0; s < length_m; s += 0.71) {
    for (double u = -6; u < 6; u += 0.13) {
      const double ground_m = plane_m(start + s * along + u * left);
      ASSERT_EQ(height_m(plain, s, u, ground_m), height_m(stepped, s, u, ground_m))
          << s << ", " << u;
    }
  }
}

// Its reach: banks of 6 m have two benches, and end 6 / 4 + 2 1.5 m beyond the edge.
TEST(Benches, ExtendTheReach) {
  EXPECT_DOUBLE_EQ(trail_on(with_benches(-5), flat_m).field().reach_m(), 2 + 1.5 + 3);
  TrailSpec spec = with_benches(-5);
  spec.most_bank_m = 6.5;  // a third bench, below half a metre of the fourth face
  EXPECT_DOUBLE_EQ(trail_on(spec, flat_m).field().reach_m(), 2 + 1.625 + 4.5);
  spec.benches->roughness_m = 0.75;
  EXPECT_DOUBLE_EQ(trail_on(spec, flat_m).field().reach_m(), 2 + 1.625 + 4.5 + 0.75);
}

// Returns the offset at which the height passes `z`, on a side, by bisection.
double offset_at(const Trail& trail, double s, double side, double z) {
  double low = 2, high = 9;
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    (height_m(trail, s, side * middle) < z ? low : high) = middle;
  }
  return low;
}

// A rough face is set back by 0 to roughness_m everywhere, with a mean of half of that over many
// variants, and continuously along the line: the setback's slope is at most roughness_m / 2 times
// that of (2 v(s / 6) + v(s / 1.5)) / 3 with v between -1 and 1, whose steps have a slope of at
// most 3 / 2 2.
TEST(Benches, RoughFacesAreSetBackByUpToTheirRoughness) {
  TrailSpec spec = with_benches(-5);
  constexpr double rough_m = 0.8, step_m = 0.25;
  spec.benches->roughness_m = rough_m;
  const double most_slope = rough_m / 2 * (2 * 3 / 6.0 + 3 / 1.5) / 3;
  // Variance of v: knots have 1/3, between them it is multiplied by t^2 + (1 - t)^2, at most 1.
  const double most_sd = rough_m / 2 * std::sqrt((4 + 1) / 9.0 / 3);
  double sum = 0, least = 1, most = 0;
  constexpr int variants = 100;
  for (std::uint64_t variant = 0; variant < variants; ++variant) {
    spec.variant = Seed{variant};
    const Trail trail = trail_on(spec, flat_m);
    double before = -1;
    for (double s = 20; s < 40; s += step_m) {
      const double setback = offset_at(trail, s, 1, -2) - 4.25;  // in the middle of the second face
      ASSERT_GE(setback, -1e-9);
      ASSERT_LE(setback, rough_m + 1e-9);
      if (before >= 0) {
        ASSERT_LE(std::abs(setback - before), most_slope * step_m + 1e-9) << s;
      }
      before = setback;
      least = std::min(least, setback);
      most = std::max(most, setback);
    }
    sum += before / variants;
  }
  EXPECT_NEAR(sum, rough_m / 2, 4 * most_sd / std::sqrt(variants));
  EXPECT_LT(least, 0.2 * rough_m);
  EXPECT_GT(most, 0.8 * rough_m);
}

// Joints of a bed are equally spaced steps of its setback, which varies slowly between them: by at
// most roughness_m / 2 2 / 3 3 / 2 2 / 6 m per metre. Blocks differ by roughness_m / 3 = 0.2 m at
// most, so that just above its foot the lower bed is alone: the upper one begins 0.25 m behind.
TEST(Benches, BlocksEndAtJointsAndBeds) {
  TrailSpec spec = with_benches(-5);
  constexpr double rough_m = 0.6, step_m = 0.05, length = 2, above_m = 0.05;
  spec.benches->roughness_m = rough_m;
  spec.benches->blocks = {.length_m = length, .height_m = 1.1};  // two beds of 1 m
  const Trail trail = trail_on(spec, flat_m);
  constexpr double most_change = rough_m / 2 * 2 / 3 * 3 / 6.0 * step_m + 1e-9;
  // Of the second face, which begins at -3 m, 4 m from the middle.
  const auto joints_at = [&](double height_m) {
    std::vector<double> joints;
    double before = -1;
    for (double s = 20; s < 60; s += step_m) {
      const double setback = offset_at(trail, s, 1, -3 + height_m) - 4 - height_m / 4;
      EXPECT_GE(setback, -0.25);
      EXPECT_LE(setback, rough_m + 1e-9);
      if (before >= 0 && std::abs(setback - before) > most_change) joints.push_back(s);
      before = setback;
    }
    return joints;
  };
  const auto lower = joints_at(above_m), upper = joints_at(1 + above_m);
  // Of 19 or 20 joints, two with steps below the slow change are less likely than 1e-2.
  ASSERT_GE(lower.size(), 17u);
  ASSERT_LE(lower.size(), 20u);
  for (const double s : lower) {
    const double blocks = (s - lower.front()) / length;
    EXPECT_NEAR(blocks, std::round(blocks), step_m / length + 1e-9) << s;
  }
  EXPECT_GE(upper.size(), 17u);
  EXPECT_NE(lower, upper);
}

// A block as high as the face, without roughness, changes nothing.
TEST(Benches, BlocksWithoutRoughnessLeaveEveryHeight) {
  TrailSpec spec = with_benches(-5);
  const Trail smooth = trail_on(spec, flat_m);
  spec.benches->blocks = {.length_m = 2, .height_m = 0.5};
  const Trail blocky = trail_on(spec, flat_m);
  for (double u = 0; u < 9; u += 0.01)
    ASSERT_NEAR(height_m(smooth, 30, u), height_m(blocky, 30, u), 1e-12) << u;
}

TEST(Benches, RoughFacesDifferByHeightAndSide) {
  TrailSpec spec = with_benches(-5);
  spec.benches->roughness_m = 0.8;
  const Trail trail = trail_on(spec, flat_m);
  double between_faces = 0, between_sides = 0;
  for (double s = 10; s < 60; s += 0.5) {
    const double first = offset_at(trail, s, 1, -4), second = offset_at(trail, s, 1, -2);
    between_faces = std::max(between_faces, std::abs(second - first - 2));
    between_sides = std::max(between_sides, std::abs(first - offset_at(trail, s, -1, -4)));
  }
  EXPECT_GT(between_faces, 0.2);
  EXPECT_GT(between_sides, 0.2);
}

// Beyond the ends, faces are arcs about them. Left and right meet there, 2 mm apart: their heights
// differ by at most the slope of 4 times that.
TEST(Benches, OfBothSidesMeetBeyondTheEnds) {
  TrailSpec spec = with_benches(-5);
  spec.benches->roughness_m = 0.8;
  const Trail trail = trail_on(spec, flat_m);
  for (double r = 2; r < 9; r += 0.01) {
    for (const double s : {-r, length_m + r})
      ASSERT_NEAR(height_m(trail, s, 1e-3), height_m(trail, s, -1e-3), 8e-3) << s;
  }
  EXPECT_NEAR(height_m(trail, -4, 0), -3, 1e-9);
  EXPECT_NEAR(height_m(trail, -4.25, 0), -2, 1e-9);
}

// The ground ends a cutting: beyond its reach, a bank must not be needed. A face of 4 m needs a run
// of 1 m, and on the bench above it, 1.5 m wide, the ground rises further.
TEST(Benches, MustMeetTheGround) {
  const auto side_slope_m = [](glm::dvec2 p) { return 1.2 * glm::dot(p - start, left); };
  const auto error_of = [&](const TrailSpec& spec) {
    try {
      trail_on(spec, side_slope_m);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  TrailSpec spec = straight();
  spec.width_m = 4;
  spec.bank_slope = 4;
  spec.most_bank_m = 10;
  EXPECT_EQ(error_of(spec), "no error");         // meets it 0.86 m from the edge
  spec.benches = {.height_m = 2, .width_m = 3};  // rise 2 m in 3.5 m, slower than the ground
  EXPECT_THAT(error_of(spec), HasSubstr("more than most_bank_m = 10"));
}

TEST(Benches, ErrorsListEveryFault) {
  const auto error_of = [&](const TrailSpec& spec) {
    try {
      trail_on(spec, flat_m);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  TrailSpec spec = with_benches(-5);
  spec.benches = {.height_m = 0.04, .width_m = 0.09, .roughness_m = 0.1};
  EXPECT_THAT(
      error_of(spec),
      AllOf(HasSubstr("benches.height_m = 0.04 must be at least a cell of the relief, 0.05"),
            HasSubstr("benches.width_m = 0.09 must be at least two cells"),
            HasSubstr("benches.roughness_m = 0.1 must be from 0 to their width_m, 0.09")));
  spec.benches = {.height_m = 2, .width_m = 1.5, .blocks = {{.length_m = 0.09, .height_m = 2.5}}};
  EXPECT_THAT(error_of(spec),
              AllOf(HasSubstr("benches.blocks.length_m = 0.09 must be at least two cells"),
                    HasSubstr("benches.blocks.height_m = 2.5 must be from a cell of the relief, "
                              "0.05, to benches.height_m, 2")));
  spec.benches = {.height_m = 0.25, .width_m = 10};
  // 23 benches below the last face, and 6 / 4 m of faces.
  EXPECT_THAT(error_of(spec),
              AllOf(HasSubstr("such banks reach 231.5 m, more than the limit of 200"),
                    HasSubstr("or benches higher or narrower")));
}

TEST(Benches, ChangeTheFingerprint) {
  const HeightGrid dem = grid_of(flat_m);
  std::vector<std::uint64_t> found;
  TrailSpec spec = with_benches(-5);
  const auto add = [&] {
    found.push_back(Trails({&spec, 1}, heights_of(dem), {0, 0}, cell_m).fingerprint());
  };
  add();
  spec.benches->roughness_m = 0.5;
  add();
  spec.benches->blocks.emplace();
  add();
  spec.benches->width_m = 1;
  add();
  spec.benches.reset();
  add();
  std::ranges::sort(found);
  EXPECT_EQ(std::ranges::adjacent_find(found), found.end());
}

}  // namespace
}  // namespace groundray::benches_test
