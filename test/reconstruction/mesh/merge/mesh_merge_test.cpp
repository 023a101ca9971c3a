#include "reconstruction/mesh/merge/mesh_merge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/vec2.hpp>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/geometry/pose.h"
#include "test/support/margin.h"
#include "test/support/terrain/surface_check.h"

namespace groundray::mesh_merge_test {
namespace {

using ::testing::AllOf;
using testing::area_m2;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Le;
using testing::record_margin;
using testing::surface_faults;
using Random = std::mt19937_64;

// Rectangle of cells about a centre, turned about z; right way up.
struct Patch {
  glm::dvec2 middle{0}, size_m{1};
  double yaw_rad = 0;
  glm::ivec2 cells{10};

  bool contains(const glm::dvec2& p, double inset_m = 0) const {
    const glm::dvec2 q = p - middle;
    const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
    const glm::dvec2 in(c * q.x + s * q.y, c * q.y - s * q.x);
    return std::abs(in.x) < size_m.x / 2 - inset_m && std::abs(in.y) < size_m.y / 2 - inset_m;
  }
};

using Height = std::function<double(const glm::dvec2&)>;

// Scan of a surface over a patch, as if seen from `origin`.
ScanMesh scan_of(const Patch& patch, const Height& height, double sd_m,
                 const glm::dvec3& origin = {0, 0, 100}) {
  ScanMesh scan;
  TriangleMesh& shape = scan.mesh.shape;
  const double c = std::cos(patch.yaw_rad), s = std::sin(patch.yaw_rad);
  for (int row = 0; row <= patch.cells.y; ++row) {
    for (int column = 0; column <= patch.cells.x; ++column) {
      const glm::dvec2 q = patch.size_m * (glm::dvec2(column, row) / glm::dvec2(patch.cells) - 0.5);
      const glm::dvec2 p = patch.middle + glm::dvec2(c * q.x - s * q.y, s * q.x + c * q.y);
      shape.vertices_m.emplace_back(p, height(p));
    }
  }
  for (int row = 0; row < patch.cells.y; ++row) {
    for (int column = 0; column < patch.cells.x; ++column) {
      const auto a = static_cast<unsigned>(row * (patch.cells.x + 1) + column);
      const auto d = a + static_cast<unsigned>(patch.cells.x) + 1;
      shape.triangles.emplace_back(a, a + 1, d);
      shape.triangles.emplace_back(a + 1, d + 1, d);
    }
  }
  for (const glm::uvec3& t : shape.triangles) {
    const glm::dvec3 &x = shape.vertices_m[t.x], &y = shape.vertices_m[t.y],
                     &z = shape.vertices_m[t.z];
    const double cosine = glm::dot(glm::normalize(glm::cross(y - x, z - x)),
                                   glm::normalize(origin - (x + y + z) / 3.0));
    scan.face_confidence.push_back(static_cast<float>(std::clamp(cosine, 0.0, 1.0)));
  }
  scan.mesh.sd_m.assign(shape.vertices_m.size(), static_cast<float>(sd_m));
  scan.origins_m.assign(shape.vertices_m.size(), origin);
  return scan;
}

double flat(const glm::dvec2&) { return 0; }

// Number of triangles over a point, by exhaustive search.
int count_over(const TriangleMesh& mesh, const glm::dvec2& p) {
  const auto side = [&](const glm::dvec3& a, const glm::dvec3& b) {
    return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
  };
  return static_cast<int>(std::ranges::count_if(mesh.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y],
                     &c = mesh.vertices_m[t.z];
    const double ab = side(a, b), bc = side(b, c), ca = side(c, a);
    return (ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0);
  }));
}

// Fractions of random points covered by no triangle and by more than one, over points that lie
// within some patch and farther than `inset_m` from its border.
struct Faults {
  double bare = 0, doubled = 0;
};

Faults cover_faults(const TriangleMesh& mesh, const std::vector<Patch>& patches, double inset_m) {
  Random random(3);
  std::uniform_real_distribution<double> place(-3, 3);
  Faults faults;
  int count = 0;
  while (count < 700) {
    const glm::dvec2 p(place(random), place(random));
    const auto is_in = [&](const Patch& patch) { return patch.contains(p, inset_m); };
    if (std::ranges::none_of(patches, is_in)) continue;
    ++count;
    const int over = count_over(mesh, p);
    faults.bare += over == 0 ? 1 : 0;
    faults.doubled += over > 1 ? 1 : 0;
  }
  faults.bare /= count;
  faults.doubled /= count;
  return faults;
}

const MergeLimits close{.apart_m = 0.01};

// In a plane clipping is exact, except where borders cross and corners are cut by at most a
// triangle; with a few hundred of these along the borders the fractions stay below one in a
// hundred.
TEST(MeshMerge, OverlappingPlanesAreCoveredOnce) {
  for (const double yaw_rad : {0.0, 0.1, 0.785398163}) {
    for (const int cells : {13, 40, 120}) {
      const std::vector<Patch> patches{
          {.middle = {-0.6, 0}, .size_m = {2, 2}, .cells = {40, 40}},
          {.middle = {0.5, 0.33}, .size_m = {2, 1.5}, .yaw_rad = yaw_rad, .cells = {cells, cells}}};
      const std::vector<ScanMesh> scans{scan_of(patches[0], flat, 0, {-0.6, 0, 2}),
                                        scan_of(patches[1], flat, 0, {0.5, 0.33, 2})};
      const MergedMesh merged = merge(scans, close);
      EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
      EXPECT_GT(merged.counts.redundant, 0u);
      EXPECT_GT(merged.counts.clipped, 0u);
      const Faults faults = cover_faults(merged.mesh.shape, patches, 0.02);
      EXPECT_LE(faults.bare, 0.01) << cells << " cells, yaw " << yaw_rad;
      EXPECT_LE(faults.doubled, 0.01) << cells << " cells, yaw " << yaw_rad;
      for (const glm::dvec3& p : merged.mesh.shape.vertices_m) EXPECT_LT(std::abs(p.z), 1e-12);
    }
  }
}

TEST(MeshMerge, AreaOfParallelPlanesIsThatOfTheirUnion) {
  const Patch left{.middle = {-0.6, 0}, .size_m = {2, 2}, .cells = {40, 40}};
  const Patch right{.middle = {0.617, 0.013}, .size_m = {2, 2}, .cells = {37, 43}};
  const std::vector<ScanMesh> scans{scan_of(left, flat, 0), scan_of(right, flat, 0)};
  const MergedMesh merged = merge(scans, close);
  // 1.217 to the right and 0.013 up: they overlap by 0.783 * 1.987.
  const double expected_m2 = 8 - 0.783 * 1.987;
  // Where borders cross, a corner may be cut by a triangle of 0.05 by 0.05.
  const double tolerance_m2 = 4 * 0.5 * 0.05 * 0.05;
  EXPECT_NEAR(area_m2(merged.mesh.shape), expected_m2, tolerance_m2);
  record_margin("area of two planes merged", area_m2(merged.mesh.shape) - expected_m2, tolerance_m2,
                "m2");
}

TEST(MeshMerge, ThreePatchesAreCoveredOnceInAnyOrder) {
  const std::vector<Patch> patches{
      {.middle = {-0.6, 0}, .size_m = {2, 2}, .cells = {40, 40}},
      {.middle = {0.5, 0.33}, .size_m = {2, 1.5}, .yaw_rad = 0.4, .cells = {31, 29}},
      {.middle = {0.1, -0.8}, .size_m = {1.2, 1.8}, .yaw_rad = -0.3, .cells = {50, 60}}};
  std::vector<std::size_t> order{0, 1, 2};
  std::vector<double> areas_m2;
  do {
    std::vector<ScanMesh> scans;
    for (const std::size_t i : order)
      scans.push_back(scan_of(patches[i], flat, 0, {patches[i].middle, 2}));
    const MergedMesh merged = merge(scans, close);
    EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
    const Faults faults = cover_faults(merged.mesh.shape, patches, 0.02);
    EXPECT_LE(faults.bare, 0.01);
    EXPECT_LE(faults.doubled, 0.01);
    areas_m2.push_back(area_m2(merged.mesh.shape));
  } while (std::ranges::next_permutation(order).found);
  const auto [least, most] = std::ranges::minmax(areas_m2);
  EXPECT_LT(most - least, 0.005 * most);
}

// The mean of n independent measurements; interpolation between three vertices each gives less
// noise than that, so this is an upper bound. With 2500 vertices the estimate of the variance is
// within 12 % in all but one of 20 000 cases. The stated value follows from the weights, which
// differ by some tenths as the confidences of noisy triangles do: for eight weights that costs a
// few hundredths.
TEST(MeshMerge, NoiseDecreasesWithTheNumberOfScans) {
  constexpr double sd_m = 0.02;
  Random random(5);
  for (const int count : {1, 2, 4, 8}) {
    std::vector<ScanMesh> scans;
    for (int i = 0; i < count; ++i) {
      std::normal_distribution<double> noise(0, sd_m);
      const Patch patch{.middle = {0.013 * i, 0.007 * i}, .size_m = {10, 10}, .cells = {60, 60}};
      scans.push_back(scan_of(
          patch, [&](const glm::dvec2&) { return noise(random); }, sd_m));
    }
    const MergedMesh merged = merge(scans, {});
    double squares = 0, claimed = 0, vertices = 0;
    for (std::size_t v = 0; v < merged.mesh.sd_m.size(); ++v) {
      const glm::dvec3& p = merged.mesh.shape.vertices_m[v];
      if (std::max(std::abs(p.x), std::abs(p.y)) > 4) continue;  // border
      squares += p.z * p.z;
      claimed += static_cast<double>(merged.mesh.sd_m[v]) * merged.mesh.sd_m[v];
      ++vertices;
    }
    EXPECT_GT(vertices, 2000);
    EXPECT_LT(squares / vertices, 1.12 * sd_m * sd_m / count) << count << " scans";
    EXPECT_NEAR(claimed / vertices, sd_m * sd_m / count, 0.06 * sd_m * sd_m / count);
  }
}

TEST(MeshMerge, KeepsBothSidesOfAThinSheet) {
  const Patch patch{.size_m = {2, 2}, .cells = {20, 20}};
  ScanMesh below = scan_of(
      patch, [](const glm::dvec2&) { return -0.005; }, 0.02);
  for (glm::uvec3& t : below.mesh.shape.triangles) std::swap(t.y, t.z);
  const std::vector<ScanMesh> scans{scan_of(patch, flat, 0.02), below};
  const MergedMesh merged = merge(scans, {});
  EXPECT_EQ(merged.mesh.shape.triangles.size(), 1600u);
  EXPECT_EQ(merged.counts.redundant, 0u);
  EXPECT_EQ(merged.counts.moved, 0u);
  EXPECT_NEAR(area_m2(merged.mesh.shape), 8, 1e-9);
}

// Two terraces 1 m apart with a wall between them. Each scan has one terrace and the wall, with
// different spacing.
TEST(MeshMerge, KeepsTheWallOfAStep) {
  const auto profile = [](double s) {  // along the lower terrace, up the wall, along the upper
    if (s < 2) return glm::dvec2(s - 2, 0);
    return s < 3 ? glm::dvec2(0, s - 2) : glm::dvec2(s - 3, 1);
  };
  const auto seen = [&](double from, double to, int steps, int rows) {
    ScanMesh scan =
        scan_of({.middle = {(from + to) / 2, 0}, .size_m = {to - from, 2}, .cells = {steps, rows}},
                flat, 0.002);
    for (glm::dvec3& p : scan.mesh.shape.vertices_m) {
      const glm::dvec2 q = profile(p.x);
      p = {q.x, p.y, q.y};
    }
    scan.origins_m.clear();
    return scan;
  };
  const std::vector<ScanMesh> scans{seen(0, 3, 60, 40), seen(2, 5, 45, 33)};
  const MergedMesh merged = merge(scans, {});
  EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
  EXPECT_GT(merged.counts.redundant, 1000u);
  EXPECT_NEAR(area_m2(merged.mesh.shape), 10, 0.02);
}

// The second scan sees the surface bridged by long triangles squarely, except in a shadow: there
// they stay.
TEST(MeshMerge, KeepsLongTrianglesOnlyInHolesOfFineOnes) {
  const Patch patch{.size_m = {4, 4}, .cells = {160, 160}};
  ScanMesh fine = scan_of(patch, flat, 0.005, {0, 0, 3});
  const auto is_in_shadow = [&](const glm::uvec3& t) {
    return std::abs(fine.mesh.shape.vertices_m[t.x].x - 0.33) < 0.2;
  };
  std::vector<float> confidence;
  for (std::size_t i = 0; i < fine.face_confidence.size(); ++i) {
    if (!is_in_shadow(fine.mesh.shape.triangles[i])) confidence.push_back(fine.face_confidence[i]);
  }
  std::erase_if(fine.mesh.shape.triangles, is_in_shadow);
  fine.face_confidence = confidence;
  ScanMesh coarse = scan_of({.size_m = {3.8, 3.8}, .cells = {3, 40}}, flat, 0.005, {-30, 0, 2});
  const std::vector<ScanMesh> scans{fine, coarse};
  const MergedMesh merged = merge(scans, {});
  EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
  const Faults faults = cover_faults(merged.mesh.shape, {{.size_m = {3.8, 3.8}}}, 0.03);
  EXPECT_LE(faults.bare, 0.01);
  EXPECT_LE(faults.doubled, 0.01);
  // Of 400 cells' width and 9.5 % of the shadow's, little but the shadow is the coarse scan's.
  EXPECT_LT(merged.mesh.shape.triangles.size(), fine.mesh.shape.triangles.size() + 2500);
}

TEST(MeshMerge, RemovesVisibilityConflicts) {
  // A pit that one scan bridges and another looks into from above.
  const auto pit = [](const glm::dvec2& p) { return glm::length(p) < 0.6 ? -0.5 : 0.0; };
  const std::vector<ScanMesh> scans{
      scan_of({.size_m = {4, 4}, .cells = {4, 4}}, flat, 0.01, {-20, 0, 1}),
      scan_of({.size_m = {2, 2}, .cells = {21, 21}}, pit, 0.01, {0, 0, 3})};
  const MergedMesh merged = merge(scans, {});
  EXPECT_GE(merged.counts.visibility_conflicts, 4u);
  EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
  Random random(1);
  std::uniform_real_distribution<double> place(-0.35, 0.35);
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(count_over(merged.mesh.shape, {place(random), place(random)}), 1);
  ScanMesh blind = scans[1];
  blind.origins_m.clear();
  EXPECT_EQ(merge(std::vector{scans[0], blind}, {}).counts.visibility_conflicts, 0u);
}

// Each scan's beams end behind or in front of the other's triangles, by far more than the noise.
TEST(MeshMerge, WrongPosesLeaveNoHoles) {
  for (const double off_m : {0.05, 0.2, 0.5}) {
    const auto lower = [&](const glm::dvec2& p) { return p.x < 0 ? -off_m : off_m; };
    const std::vector<ScanMesh> scans{
        scan_of({.size_m = {4, 4}, .cells = {4, 4}}, flat, 0.001, {-3, 0, 3}),
        scan_of({.size_m = {4, 4}, .cells = {4, 5}}, lower, 0.001, {3, 0, 3})};
    const MergedMesh merged = merge(scans, {});
    EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
    Random random(1);
    std::uniform_real_distribution<double> place(-1.9, 1.9);
    for (int i = 0; i < 200; ++i)
      ASSERT_GE(count_over(merged.mesh.shape, {place(random), place(random)}), 1) << off_m;
  }
}

ScanMesh labelled(ScanMesh scan, std::uint16_t label, float confidence) {
  scan.mesh.labels.assign(scan.mesh.sd_m.size(), label);
  scan.mesh.confidence.assign(scan.mesh.sd_m.size(), confidence);
  return scan;
}

TEST(MeshMerge, LabelsAndConfidenceComeFromTheMostConfidentScan) {
  const Patch left{.middle = {-1, 0}, .size_m = {4, 4}, .cells = {40, 40}};
  const Patch right{.middle = {1, 0}, .size_m = {4, 4}, .cells = {38, 38}};
  ScanMesh worse = labelled(scan_of(left, flat, 0.01), 7, 0.3f);
  std::ranges::fill(worse.face_confidence, 0.3f);
  const std::vector<ScanMesh> scans{worse, labelled(scan_of(right, flat, 0.02), 9, 0.9f)};
  const MergedMesh merged = merge(scans, {});
  const MeasuredMesh& mesh = merged.mesh;
  ASSERT_EQ(mesh.labels.size(), mesh.shape.vertices_m.size());
  ASSERT_EQ(mesh.confidence.size(), mesh.shape.vertices_m.size());
  ASSERT_EQ(mesh.sd_m.size(), mesh.shape.vertices_m.size());
  int checked = 0;
  for (std::size_t v = 0; v < mesh.labels.size(); ++v) {
    const double x = mesh.shape.vertices_m[v].x;
    if (std::abs(x + 1) < 0.3 || std::abs(mesh.shape.vertices_m[v].y) > 1.5) continue;  // seam
    ++checked;
    EXPECT_EQ(mesh.labels[v], x < -1 ? 7 : 9) << x;
    EXPECT_FLOAT_EQ(mesh.confidence[v], x < -1 ? 0.3f : 0.9f);
    if (std::abs(x) > 1.2) {
      EXPECT_FLOAT_EQ(mesh.sd_m[v], x < 0 ? 0.01f : 0.02f) << x;
    }
    // Between these both scans have seen it: w = worth / variance, sd^2 = sum (w sd)^2 / (sum w)^2.
    if (std::abs(x) < 0.4) {
      const double w1 = 0.3 / 1e-4, w2 = 1 / 4e-4;
      const double sd_m = std::hypot(w1 * 0.01, w2 * 0.02) / (w1 + w2);
      EXPECT_NEAR(mesh.sd_m[v], sd_m, 0.02 * sd_m);
    }
  }
  EXPECT_GT(checked, 500);
}

TEST(MeshMerge, OneScanStaysUnchanged) {
  Random random(2);
  std::normal_distribution<double> noise(0, 0.1);
  const std::vector<ScanMesh> scans{
      labelled(scan_of(
                   {.middle = {5e5, 4e6}}, [&](const glm::dvec2&) { return noise(random); }, 0.1),
               4, 0.5f)};
  const MergedMesh merged = merge(scans, {});
  ASSERT_EQ(merged.mesh.shape.triangles.size(), 200u);
  ASSERT_EQ(merged.mesh.shape.vertices_m.size(), 121u);
  for (std::size_t i = 0; i < 200; ++i) {
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(merged.mesh.shape.vertices_m[merged.mesh.shape.triangles[i][k]],
                scans[0].mesh.shape.vertices_m[scans[0].mesh.shape.triangles[i][k]]);
  }
  EXPECT_THAT(merged.mesh.labels, Each(4));
  EXPECT_EQ(merged.counts.moved, 0u);
}

// Two sheets that touch at a corner: each fan gets its own vertex.
TEST(MeshMerge, OneScanBecomesAManifold) {
  ScanMesh scan = labelled(scan_of({.cells = {2, 2}}, flat, 0.1), 4, 0.5f);
  std::erase_if(scan.mesh.shape.triangles, [&](const glm::uvec3& t) {
    const glm::dvec3 middle = (scan.mesh.shape.vertices_m[t.x] + scan.mesh.shape.vertices_m[t.y] +
                               scan.mesh.shape.vertices_m[t.z]) /
                              3.0;
    return middle.x * middle.y < 0;
  });
  scan.mesh.shape.triangles.emplace_back(0, 1, 1);
  scan.face_confidence.clear();
  scan.mesh.sd_m[4] = 0.2f;  // where they touch
  const MergedMesh merged = merge(std::vector{scan}, {});
  EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
  EXPECT_EQ(merged.counts.left_out, 1u);
  EXPECT_EQ(merged.mesh.shape.triangles.size(), 4u);
  ASSERT_EQ(merged.mesh.shape.vertices_m.size(), 8u);  // two of nine are unused, one is duplicated
  EXPECT_EQ(std::ranges::count(merged.mesh.shape.vertices_m, glm::dvec3(0)), 2);
  EXPECT_EQ(std::ranges::count(merged.mesh.sd_m, 0.2f), 2);
  EXPECT_EQ(merged.mesh.labels.size(), 8u);
}

// A scan with unknown noise is treated as noisy as the noisiest of the others: the mean is then
// that of measurements of 0.02, 0.04 and 0.04 m with equal worth, and so is the stated standard
// deviation.
TEST(MeshMerge, UnknownNoiseCountsAsTheLargestKnownNoise) {
  const Patch patch{.size_m = {4, 4}, .cells = {40, 40}};
  const auto at = [&](double z_m, double sd_m) {
    return scan_of(patch, [z_m](const glm::dvec2&) { return z_m; }, sd_m, {0, 0, 1e6});
  };
  const double w1 = 1 / 4e-4, w2 = 1 / 16e-4, sum = w1 + 2 * w2;
  for (const bool is_empty : {true, false}) {
    std::vector<ScanMesh> scans{at(0, 0.02), at(0, 0.04), at(0.03, 0)};
    if (is_empty) scans[2].mesh.sd_m.clear();
    scans[0].mesh.sd_m[15 * 41 + 20] = 0;  // one unknown among known ones
    const MergedMesh merged = merge(scans, {});
    const double sd_m = std::sqrt(w1 + 2 * w2) / sum;
    int checked = 0;
    for (std::size_t v = 0; v < merged.mesh.sd_m.size(); ++v) {
      const glm::dvec3& p = merged.mesh.shape.vertices_m[v];
      if (std::max(std::abs(p.x), std::abs(p.y)) > 1.4) continue;  // lower worth at the border
      ++checked;
      EXPECT_NEAR(p.z, 0.03 * w2 / sum, 1e-6);
      EXPECT_NEAR(merged.mesh.sd_m[v], sd_m, 1e-6);
    }
    EXPECT_GE(checked, 27 * 27);
  }
}

TEST(MeshMerge, EmptyScansMergeToAnEmptyMesh) {
  EXPECT_THAT(merge({}, {}).mesh.shape.triangles, IsEmpty());
  const std::vector<ScanMesh> empty(3);
  EXPECT_THAT(merge(empty, {}).mesh.shape.vertices_m, IsEmpty());
  std::vector<ScanMesh> some(3);
  some[1] = scan_of({}, flat, 0.01);
  EXPECT_EQ(merge(some, {}).mesh.shape.triangles.size(), 200u);
}

TEST(MeshMerge, DistantScansStayUnchanged) {
  const std::vector<ScanMesh> scans{scan_of({}, flat, 0.01),
                                    scan_of({.middle = {50, 0}}, flat, 0.01)};
  const MergedMesh merged = merge(scans, {});
  EXPECT_EQ(merged.mesh.shape.triangles.size(), 400u);
  EXPECT_EQ(merged.mesh.shape.vertices_m.size(), 242u);
}

TEST(MeshMerge, TheSameScanTwiceIsOneScan) {
  const ScanMesh scan = scan_of({.cells = {30, 30}}, flat, 0.01);
  const MergedMesh merged = merge(std::vector{scan, scan}, {});
  EXPECT_EQ(merged.mesh.shape.triangles.size(), 1800u);
  EXPECT_NEAR(area_m2(merged.mesh.shape), 1, 1e-12);
}

// Smallest ratio of a triangle's height to its longest edge.
double least_height_share(const TriangleMesh& mesh) {
  double least = 1;
  for (const glm::uvec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices_m[t.y] - mesh.vertices_m[t.x],
                     b = mesh.vertices_m[t.z] - mesh.vertices_m[t.y], c = -a - b;
    const double longest_m2 = std::max({glm::dot(a, a), glm::dot(b, b), glm::dot(c, c)});
    least = std::min(least, glm::length(glm::cross(a, b)) / longest_m2);
  }
  return least;
}

// Outlines are as short as slits, straight, and turned so that rounding decides which side of them
// a corner is on. The distant single patch makes this a merge of two scans.
TEST(MeshMerge, OutlinesAreNotFilled) {
  const std::vector<ScanMesh> away{scan_of({.middle = {90, 0}}, flat, 0.01)};
  for (const glm::ivec2 cells : {glm::ivec2(1, 1), glm::ivec2(1, 7), glm::ivec2(2, 2),
                                 glm::ivec2(4, 4), glm::ivec2(10, 9), glm::ivec2(3, 15)}) {
    for (int k = 0; k < 10; ++k) {
      const Patch patch{.middle = {0.1 * k, 0.03 * k},
                        .size_m = glm::dvec2(cells) / 7.0,
                        .yaw_rad = 0.37 * k,
                        .cells = cells};
      const auto slope = [&](const glm::dvec2& p) { return 0.3 * p.x + 0.1 * k * p.y; };
      const std::vector<ScanMesh> scans{scan_of(patch, slope, 0.01), away[0]};
      const MergedMesh merged = merge(scans, {});
      EXPECT_EQ(merged.counts.filled, 0u) << cells.x << " x " << cells.y << " case " << k;
      EXPECT_EQ(merged.mesh.shape.triangles.size(),
                200 + 2 * static_cast<std::size_t>(cells.x * cells.y));
      EXPECT_GT(least_height_share(merged.mesh.shape), 0.1);
    }
  }
}

// Two sheets of 2 m by 2 m with a gap between them.
std::vector<ScanMesh> sheets_apart(double gap_m) {
  return {scan_of({.middle = {-1, 0}, .size_m = {2, 2}, .cells = {20, 20}}, flat, 0.002),
          scan_of({.middle = {1 + gap_m, 0}, .size_m = {2, 2}, .cells = {20, 23}}, flat, 0.002)};
}

// The longest edges at the gap are 0.132 and 0.141 m. In a triangle over the gap, measured along
// the gap, the midpoint of one side is at most half of 0.1 m from the opposite corner, and an end
// half of 0.087 m farther: no edge across is longer than sqrt(0.08^2 + 0.0935^2) = 0.123 m.
TEST(MeshMerge, GapsNoWiderThanTrianglesAreBridged) {
  for (const double gap_m : {0.02, 0.05, 0.08}) {
    const MergedMesh merged = merge(sheets_apart(gap_m), {});
    EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
    EXPECT_NEAR(area_m2(merged.mesh.shape), 8 + 2 * gap_m, 1e-9) << gap_m;
    EXPECT_EQ(merged.counts.bridged, 43u);  // one for each edge on either side
    EXPECT_GT(least_height_share(merged.mesh.shape), 0.1);
    const Patch all{.middle = {gap_m / 2, 0}, .size_m = {4 + gap_m, 2}};
    const Faults faults = cover_faults(merged.mesh.shape, {all}, 0.001);
    EXPECT_EQ(faults.bare, 0);
    EXPECT_EQ(faults.doubled, 0);
  }
  for (const double gap_m : {0.15, 0.5}) {
    const MergedMesh merged = merge(sheets_apart(gap_m), {});
    EXPECT_NEAR(area_m2(merged.mesh.shape), 8, 1e-9);
    EXPECT_EQ(merged.counts.bridged, 0u);
  }
}

TEST(MeshMerge, GapsCrossedByBeamsStayOpen) {
  constexpr double gap_m = 0.08;
  std::vector<ScanMesh> scans = sheets_apart(gap_m);
  const auto below = [](const glm::dvec2&) { return -1.0; };
  scans.push_back(scan_of({.middle = {gap_m / 2, 0}, .size_m = {0.08, 2.8}, .cells = {8, 300}},
                          below, 0.002, {gap_m / 2, 0, 3}));
  const MergedMesh merged = merge(scans, {});
  EXPECT_EQ(merged.counts.bridged, 0u);
  EXPECT_NEAR(area_m2(merged.mesh.shape), 8 + 0.224, 1e-9);
  scans.back().origins_m.clear();
  EXPECT_EQ(merge(scans, {}).counts.bridged, 43u);
}

TEST(MeshMerge, GapsInCornersStayOpen) {
  std::vector<ScanMesh> scans = sheets_apart(0.05);
  for (glm::dvec3& p : scans[1].mesh.shape.vertices_m) p = {0.05, p.y, p.x};  // a wall
  const MergedMesh merged = merge(scans, {});
  EXPECT_EQ(merged.counts.bridged, 0u);
  EXPECT_NEAR(area_m2(merged.mesh.shape), 8, 1e-9);
}

// Holes with boundaries of all shapes: bridging triangles cover nothing else, and the sheet stays
// flat.
TEST(MeshMerge, RaggedHolesAreBridgedAtMostOnce) {
  Random random(21);
  std::uniform_real_distribution<double> unit(0, 1);
  const Patch patch{.size_m = {4, 4}, .cells = {60, 60}};
  for (int i = 0; i < 10; i += 2) {
    ScanMesh scan = scan_of(patch, flat, 0.002);
    for (glm::dvec3& p : scan.mesh.shape.vertices_m)
      p += glm::dvec3(0.02 * unit(random), 0.02 * unit(random), 0);
    std::vector<glm::uvec3> triangles;
    for (const glm::uvec3& t : scan.mesh.shape.triangles) {
      if (unit(random) > 0.04 * i) triangles.push_back(t);
    }
    scan.mesh.shape.triangles = triangles;
    scan.face_confidence.clear();
    const double before_m2 = area_m2(scan.mesh.shape);
    const MergedMesh merged = merge(std::vector{scan, scan_of({.middle = {90, 0}}, flat, 0)}, {});
    EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
    const Faults faults = cover_faults(merged.mesh.shape, {patch}, 0.1);
    EXPECT_EQ(faults.doubled, 0) << i;
    EXPECT_LE(faults.bare, 0.01 + 0.6 * 0.04 * i);  // holes wider than their neighbouring triangles
    EXPECT_GE(area_m2(merged.mesh.shape), before_m2 + 1 - 1e-9);
    EXPECT_LE(area_m2(merged.mesh.shape), 17.2);  // 4.02 m squared, and 1 m2 away
  }
}

// Hills and a boulder's steep sides, seen from a random position: surfaces that are averted,
// grazing or distant are not seen, so that borders are ragged.
ScanMesh random_view(Random& random, double sd_m) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> noise(0, sd_m);
  const glm::dvec3 origin(3 * unit(random), 3 * unit(random), 2 + unit(random));
  const auto height = [&](const glm::dvec2& p) {
    const double r = 1 - glm::dot(p - glm::dvec2(0.4, 0.2), p - glm::dvec2(0.4, 0.2)) / 0.36;
    return 0.2 * std::sin(1.7 * p.x) * std::cos(1.3 * p.y) + (r > 0 ? std::sqrt(r) : 0) +
           noise(random);
  };
  const Patch patch{.middle = {unit(random), unit(random)},
                    .size_m = {3 + unit(random), 3 + unit(random)},
                    .yaw_rad = 3 * unit(random),
                    .cells = {30 + static_cast<int>(20 * unit(random)), 40}};
  ScanMesh scan = scan_of(patch, height, sd_m, origin);
  std::vector<glm::uvec3> triangles;
  std::vector<float> confidence;
  for (std::size_t i = 0; i < scan.face_confidence.size(); ++i) {
    if (scan.face_confidence[i] < 0.1) continue;
    triangles.push_back(scan.mesh.shape.triangles[i]);
    confidence.push_back(scan.face_confidence[i]);
  }
  scan.mesh.shape.triangles = std::move(triangles);
  scan.face_confidence = std::move(confidence);
  return scan;
}

TEST(MeshMerge, RandomViewsMakeASurface) {
  Random random(11);
  for (int i = 0; i < 40; ++i) {
    std::vector<ScanMesh> scans;
    for (int k = 0; k < 2 + i % 4; ++k) scans.push_back(random_view(random, 0.002 * (i % 7)));
    const MergedMesh merged = merge(scans, {.apart_m = 0.01 * (i % 3)});
    EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty()) << "case " << i;
    EXPECT_GT(merged.mesh.shape.triangles.size(), 1000u);
    for (const glm::dvec3& p : merged.mesh.shape.vertices_m)
      ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    EXPECT_THAT(merged.mesh.sd_m, Each(Le(0.002f * 6.01f)));
  }
}

TEST(MeshMerge, DoesNotDependOnThreads) {
  Random random(12);
  std::vector<ScanMesh> scans;
  for (int k = 0; k < 4; ++k) scans.push_back(random_view(random, 0.01));
  std::vector<MergedMesh> merged;
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    tbb::task_arena arena(threads);
    arena.execute([&] { merged.push_back(merge(scans, {})); });
    EXPECT_EQ(merged.back().mesh.shape.vertices_m, merged.front().mesh.shape.vertices_m);
    EXPECT_EQ(merged.back().mesh.shape.triangles, merged.front().mesh.shape.triangles);
    EXPECT_EQ(merged.back().mesh.sd_m, merged.front().mesh.sd_m);
  }
}

// Edges with more than two triangles, and triangles that are inconsistently wound, repeated,
// degenerate, or reduced to points.
TEST(MeshMerge, DropsAndCountsNonManifoldTriangles) {
  Random random(13);
  ScanMesh scan = scan_of({.cells = {30, 30}}, flat, 0.01);
  std::uniform_int_distribution<unsigned> any(0, 960);
  for (int i = 0; i < 60; ++i) {
    scan.mesh.shape.triangles.emplace_back(any(random), any(random), any(random));
    scan.face_confidence.push_back(0.5f);
  }
  for (std::size_t i = 0; i < 100; ++i) {
    scan.mesh.shape.triangles.emplace_back(i, i, i + 1);
    scan.mesh.shape.triangles.push_back(scan.mesh.shape.triangles[3 * i]);
    scan.face_confidence.insert(scan.face_confidence.end(), 2, 0.5f);
  }
  for (std::size_t i = 0; i < 50; ++i) scan.mesh.shape.vertices_m[10 * i] = {0.1, 0.1, 0};
  for (const std::size_t copies : {1, 3}) {
    const MergedMesh merged = merge(std::vector(copies, scan), {});
    EXPECT_THAT(surface_faults(merged.mesh.shape), IsEmpty());
    EXPECT_GT(merged.counts.left_out, 100u);
  }
}

std::string message_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(MeshMerge, ReportsInvalidScansAndLimits) {
  std::vector<ScanMesh> scans(2, scan_of({}, flat, 0.01));
  scans[1].mesh.labels.resize(3);
  scans[1].mesh.sd_m[5] = -1;
  scans[1].face_confidence[0] = std::numeric_limits<float>::quiet_NaN();
  scans[1].origins_m.resize(1);
  EXPECT_THAT(message_of([&] { merge(scans, {}); }),
              AllOf(HasSubstr("merge: scan 1"), HasSubstr("3 labels for 121 vertices"),
                    HasSubstr("1 origins"), HasSubstr("sd_m must be finite and not negative"),
                    HasSubstr("confidences must be from 0 to 1")));
  scans[0].mesh.shape.vertices_m[7].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message_of([&] { merge(scans, {}); }),
              AllOf(HasSubstr("merge: scan 0"), HasSubstr("vertex 7 must have a finite position")));
  EXPECT_THAT(
      message_of([&] { merge({}, {.noise_sds = -1, .turned_rad = 70, .interpolation = -2}); }),
      AllOf(HasSubstr("merge: limits"), HasSubstr("noise_sds = -1"), HasSubstr("turned_rad = 70"),
            HasSubstr("interpolation = -2")));
  EXPECT_THAT(
      message_of([&] { merge(std::vector(2, scan_of({}, flat, 0)), {}, {.most_bytes = 1000}); }),
      HasSubstr("400 triangles of 2 scans take about"));
}

TEST(MeshMerge, ReportsProgressAndStopsOnRequest) {
  const std::vector<ScanMesh> scans(2, scan_of({}, flat, 0.01));
  std::vector<double> shares;
  merge(scans, {}, {.progress = [&](double share) { shares.push_back(share); }});
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_EQ(shares.back(), 1);
  for (const double share : shares) {  // wherever the work is stopped
    const RunControl stopped{.progress = [share](double done) {
      if (done >= share) throw std::runtime_error("enough");
    }};
    EXPECT_THROW(merge(scans, {}, stopped), std::runtime_error) << share;
  }
  shares.clear();
  merge(std::vector(10, scans[0]), {},
        {.progress = [&](double share) { shares.push_back(share); }});
  EXPECT_TRUE(std::ranges::is_sorted(shares));
  EXPECT_GT(shares.size(), 200u) << "each pair is reported twice";
}

}  // namespace
}  // namespace groundray::mesh_merge_test
