// Leaves as geometry, and the light that foliage lets through. Gap fractions are those of parallel
// rays through a grid of points; they are compared with the law of Beer and Lambert.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "terrain/assets/asset.h"
#include "test/support/temporary_folder.h"

namespace groundray::foliage_test {
namespace {

constexpr double pi = std::numbers::pi;

bool is_foliage(std::string_view name) {
  return name == "leaf" || name == "broad_leaf" || name == "dry_grass";
}

// Triangle of a leaf or card, in the plane perpendicular to the rays.
struct FlatLeaf {
  std::array<glm::dvec2, 3> p;
  std::array<glm::dvec2, 3> uv;
  const Image8* image = nullptr;  // with alpha; else null
  double depth_m = 0;             // of its centre, along the rays
};

// Foliage of a model, seen along parallel rays.
struct SeenFoliage {
  std::vector<FlatLeaf> leaves;
  double area_m2 = 0;  // one-sided, without parts cut out by alpha
  double projected_m2 = 0;

  double projection() const { return projected_m2 / area_m2; }  // G
};

double opaque_share(const Image8& image) {
  double count = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) count += image.at(x, y)[3] >= 128 ? 1 : 0;
  }
  return count / (image.width() * image.height());
}

SeenFoliage seen_along(const Model& model, const glm::dvec3& ray) {
  const glm::dvec3 x = glm::normalize(glm::cross(ray, glm::dvec3(0.3, 0.5, 0.7)));
  const glm::dvec3 y = glm::cross(ray, x);
  SeenFoliage seen;
  std::vector<double> share;
  for (const ModelSurface& surface : model.surfaces) {
    const Image8& image = surface.albedo.pixels;
    share.push_back(image.channels() == 4 ? opaque_share(image) : 1);
  }
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    const ModelSurface& surface = model.surfaces[model.surface_of[i]];
    if (!is_foliage(surface.name)) continue;
    const glm::uvec3 t = model.mesh.triangles[i];
    FlatLeaf leaf;
    if (surface.albedo.pixels.channels() == 4) leaf.image = &surface.albedo.pixels;
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& p = model.mesh.vertices_m[t[k]];
      leaf.p[k] = {glm::dot(p, x), glm::dot(p, y)};
      leaf.uv[k] = model.uv[t[k]];
      leaf.depth_m += glm::dot(p, ray) / 3;
    }
    const auto& p = model.mesh.vertices_m;
    const glm::dvec3 area = glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]) / 2.0;
    seen.area_m2 += share[model.surface_of[i]] * glm::length(area);
    seen.projected_m2 += share[model.surface_of[i]] * std::abs(glm::dot(area, ray));
    seen.leaves.push_back(leaf);
  }
  return seen;
}

double cross_2d(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

// Grid of points in a square. Rays through some of them hit leaves.
class Grid {
 public:
  Grid(const glm::dvec2& low, double side, int count)
      : low_(low), cell_(side / count), count_(count), hit_(std::size_t(count) * count, 0) {}

  void add(const FlatLeaf& leaf, const glm::dvec2& shift = {}) {
    const auto [a, b, c] = leaf.p;
    const double area = cross_2d(b - a, c - a);
    if (area == 0) return;
    const glm::dvec2 low = glm::min(a, glm::min(b, c)) + shift - low_;
    const glm::dvec2 high = glm::max(a, glm::max(b, c)) + shift - low_;
    for (int j = int(std::floor(low.y / cell_)); j <= int(high.y / cell_); ++j) {
      for (int i = int(std::floor(low.x / cell_)); i <= int(high.x / cell_); ++i) {
        const glm::dvec2 p = point(i, j) - shift;
        const double u = cross_2d(p - a, c - a) / area, v = cross_2d(b - a, p - a) / area;
        if (u < 0 || v < 0 || u + v > 1 || !is_opaque(leaf, u, v)) continue;
        // The square repeats itself without end.
        hit_[std::size_t((j + 16 * count_) % count_) * count_ + (i + 16 * count_) % count_] = 1;
      }
    }
  }

  glm::dvec2 point(int i, int j) const { return low_ + cell_ * (glm::dvec2(i, j) + 0.5); }
  int count() const { return count_; }
  bool is_hit(int i, int j) const { return hit_[std::size_t(j) * count_ + i] != 0; }

 private:
  static bool is_opaque(const FlatLeaf& leaf, double u, double v) {
    if (leaf.image == nullptr) return true;
    const glm::dvec2 at = leaf.uv[0] * (1 - u - v) + leaf.uv[1] * u + leaf.uv[2] * v;
    const int x = std::clamp(int(at.x * leaf.image->width()), 0, leaf.image->width() - 1);
    const int y = std::clamp(int((1 - at.y) * leaf.image->height()), 0, leaf.image->height() - 1);
    return leaf.image->at(x, y)[3] >= 128;
  }

  glm::dvec2 low_;
  double cell_;
  int count_;
  std::vector<char> hit_;
};

// Convex hull, counter-clockwise: lower chain, then upper chain.
std::vector<glm::dvec2> hull_of(const std::vector<FlatLeaf>& leaves) {
  std::vector<glm::dvec2> points, hull;
  for (const FlatLeaf& leaf : leaves) points.insert(points.end(), leaf.p.begin(), leaf.p.end());
  std::ranges::sort(points, {}, [](const glm::dvec2& p) { return std::tuple(p.x, p.y); });
  for (const bool is_lower : {true, false}) {
    const std::size_t kept = is_lower ? 0 : hull.size() - 1;
    for (const glm::dvec2& p : points) {
      while (hull.size() >= kept + 2 &&
             cross_2d(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    std::ranges::reverse(points);
  }
  hull.pop_back();
  return hull;
}

double area_of(const std::vector<glm::dvec2>& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i)
    twice += cross_2d(polygon[i], polygon[(i + 1) % polygon.size()]);
  return twice / 2;
}

// Volume of the stack of the convex hulls of 12 slices across the rays.
double volume_of(const SeenFoliage& seen) {
  const auto [first, last] = std::ranges::minmax_element(seen.leaves, {}, &FlatLeaf::depth_m);
  const double low_m = first->depth_m, slice_m = (last->depth_m - low_m) / 12;
  std::array<std::vector<FlatLeaf>, 12> slices;
  for (const FlatLeaf& leaf : seen.leaves)
    slices[std::min(11, int((leaf.depth_m - low_m) / slice_m))].push_back(leaf);
  double volume_m3 = 0;
  for (const auto& leaves : slices)
    volume_m3 += leaves.empty() ? 0 : area_of(hull_of(leaves)) * slice_m;
  return volume_m3;
}

bool contains(const std::vector<glm::dvec2>& hull, const glm::dvec2& p) {
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const glm::dvec2& a = hull[i];
    if (cross_2d(hull[(i + 1) % hull.size()] - a, p - a) < 0) return false;
  }
  return true;
}

struct Gap {
  double share = 0;       // of the rays through the hull of the foliage that hit no leaf
  double projection = 0;  // G: mean projected area of a unit of leaf area
  double clumping = 0;    // W in share = exp(-W G L), with L the leaf area per area of the hull
  double area_m2 = 0;     // one-sided, of all leaves
  double volume_m3 = 0;   // of the foliage's hulls
};

Gap gap_of(const Model& model, const glm::dvec3& ray) {
  const SeenFoliage seen = seen_along(model, ray);
  const auto hull = hull_of(seen.leaves);
  glm::dvec2 low = hull[0], high = hull[0];
  for (const glm::dvec2& p : hull) low = glm::min(low, p), high = glm::max(high, p);
  Grid grid(low - 1e-9, std::max(high.x - low.x, high.y - low.y) + 2e-9, 300);
  for (const FlatLeaf& leaf : seen.leaves) grid.add(leaf);
  double rays = 0, free = 0;
  for (int j = 0; j < grid.count(); ++j) {
    for (int i = 0; i < grid.count(); ++i) {
      if (!contains(hull, grid.point(i, j))) continue;
      ++rays;
      free += grid.is_hit(i, j) ? 0 : 1;
    }
  }
  Gap gap{.share = free / rays,
          .projection = seen.projection(),
          .area_m2 = seen.area_m2,
          .volume_m3 = volume_of(seen)};
  gap.clumping = -std::log(gap.share) / (gap.projection * seen.area_m2 / area_of(hull));
  return gap;
}

const std::vector<AssetKind> with_leaves = {
    AssetKind::Shrub, AssetKind::Conifer, AssetKind::BroadleafTree, AssetKind::Spruce,
    AssetKind::Pine,  AssetKind::Birch,   AssetKind::Oak,           AssetKind::Bush};

Model with_geometry(AssetKind kind, std::uint64_t seed = 0) {
  return make_asset({.kind = kind, .leaves = LeafModel::Geometry, .seed = {seed}, .detail = 0.25});
}

constexpr glm::dvec3 down{0, 0, -1}, ahead{1, 0, 0};

// Triangles keep their orientation but are moved at random over a square, so the law of Beer and
// Lambert holds exactly for the expected gap: exp(-G L).
TEST(Foliage, LeavesScatteredAtRandomObeyBeerAndLambert) {
  for (const AssetKind kind : {AssetKind::Birch, AssetKind::Oak, AssetKind::Pine}) {
    for (const glm::dvec3& ray : {down, ahead, glm::normalize(glm::dvec3(1, 2, -2))}) {
      SCOPED_TRACE(asset_name(kind));
      const SeenFoliage seen = seen_along(with_geometry(kind), ray);
      const double side = std::sqrt(seen.area_m2 / 3);  // a leaf area index of 3
      Grid grid({0, 0}, side, 300);
      std::mt19937_64 random(5);
      std::uniform_real_distribution<double> place(0, side);
      for (const FlatLeaf& leaf : seen.leaves)
        grid.add(leaf, glm::dvec2(place(random), place(random)) - leaf.p[0]);
      double free = 0;
      for (int j = 0; j < grid.count(); ++j) {
        for (int i = 0; i < grid.count(); ++i) free += grid.is_hit(i, j) ? 0 : 1;
      }
      // Three standard deviations of the gap that so many triangles and points leave are below 4 %.
      const double expected = seen.projection() * 3;
      EXPECT_NEAR(-std::log(free / (300.0 * 300)), expected, 0.04 * expected);
    }
  }
}

// Planophile leaves have a mean inclination of 26.76 degrees, plagiophile ones of 45 (Bonan,
// Climate Change and Terrestrial Ecosystem Modeling, 2019, table 2.1). The tip hangs by 5 % of the
// length, which turns a leaf by up to 3 degrees.
TEST(Foliage, LeavesHaveTheStatedInclinations) {
  struct Case {
    AssetKind kind;
    double mean_deg;
  };
  for (const Case& leaf : {Case{AssetKind::Oak, 26.76}, Case{AssetKind::Birch, 45},
                           Case{AssetKind::BroadleafTree, 45}, Case{AssetKind::Bush, 45}}) {
    SCOPED_TRACE(asset_name(leaf.kind));
    const Model model = with_geometry(leaf.kind);
    const auto& p = model.mesh.vertices_m;
    glm::dvec3 sum(0);
    double degrees = 0, leaves = 0;
    int part = 0;
    for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
      if (!is_foliage(model.surfaces[model.surface_of[i]].name)) continue;
      const glm::uvec3 t = model.mesh.triangles[i];
      sum += glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]);
      if (++part % 4 != 0) continue;
      degrees += std::acos(std::min(1.0, std::abs(sum.z) / glm::length(sum))) * 180 / pi;
      ++leaves;
      sum = {};
    }
    EXPECT_GT(leaves, 500);
    EXPECT_NEAR(degrees / leaves, leaf.mean_deg, 2);
  }
}

// Row of the table in docs/reference/assets.md: means of the variants 0 and 1.
struct StatedFoliage {
  std::string kind, leaves;
  double area_m2, density, gap_down, projection_down, clumping_down;
  double gap_ahead, projection_ahead, clumping_ahead;
};

std::vector<StatedFoliage> stated_foliage() {
  std::vector<StatedFoliage> rows;
  std::ifstream page(testing::data_folder().parent_path() / "docs/reference/assets.md");
  for (std::string line; std::getline(page, line);) {
    std::ranges::replace(line, '|', ' ');
    std::ranges::replace(line, '`', ' ');
    std::istringstream cells(line);
    StatedFoliage row;
    if (cells >> row.kind >> row.leaves >> row.area_m2 >> row.density >> row.gap_down >>
        row.projection_down >> row.clumping_down >> row.gap_ahead >> row.projection_ahead >>
        row.clumping_ahead) {
      rows.push_back(row);
    }
  }
  return rows;
}

TEST(FoliageProof, GapFractionsAndClumpingAreAsStated) {
  const std::vector<StatedFoliage> rows = stated_foliage();
  ASSERT_EQ(rows.size(), 20);
  for (const StatedFoliage& stated : rows) {
    SCOPED_TRACE(stated.kind + ", " + stated.leaves);
    StatedFoliage mean{};
    for (const std::uint64_t seed : {0u, 1u}) {
      AssetSpec spec{.kind = asset_kind(stated.kind), .seed = {seed}};
      spec.leaves = stated.leaves == "geometry" ? LeafModel::Geometry : LeafModel::Cards;
      const Model model = make_asset(spec);
      const Gap below = gap_of(model, down), beside = gap_of(model, ahead);
      mean.area_m2 += below.area_m2 / 2;
      mean.density += below.area_m2 / below.volume_m3 / 2;
      mean.gap_down += below.share / 2;
      mean.projection_down += below.projection / 2;
      mean.clumping_down += below.clumping / 2;
      mean.gap_ahead += beside.share / 2;
      mean.projection_ahead += beside.projection / 2;
      mean.clumping_ahead += beside.clumping / 2;
    }
    // Half a unit of the last digit that is stated, and a margin for other mathematical libraries.
    EXPECT_NEAR(mean.area_m2, stated.area_m2, 0.01 * stated.area_m2);
    EXPECT_NEAR(mean.density, stated.density, 0.02 * stated.density);
    EXPECT_NEAR(mean.gap_down, stated.gap_down, 0.01);
    EXPECT_NEAR(mean.projection_down, stated.projection_down, 0.01);
    EXPECT_NEAR(mean.clumping_down, stated.clumping_down, 0.01);
    EXPECT_NEAR(mean.gap_ahead, stated.gap_ahead, 0.01);
    EXPECT_NEAR(mean.projection_ahead, stated.projection_ahead, 0.01);
    EXPECT_NEAR(mean.clumping_ahead, stated.clumping_ahead, 0.01);
  }
}

TEST(Foliage, GeometryHasTheRequestedLeafAreaIndex) {
  constexpr double index = 2;
  for (const AssetKind kind : with_leaves) {
    for (const double health : {1.0, 0.6}) {
      SCOPED_TRACE(fmt::format("{}, health {}", asset_name(kind), health));
      AssetSpec spec{.kind = kind,
                     .size_m = 2,
                     .leaf_area_index = index,
                     .leaves = LeafModel::Geometry,
                     .seed = {4},
                     .detail = 0.25};
      if (kind != AssetKind::Conifer) spec.health = health;
      const double expected = index * spec.health.value_or(1);
      const Model model = make_asset(spec);
      EXPECT_NEAR(foliage_area(model).index(), expected, 1e-9);
      const auto hull = hull_of(seen_along(model, down).leaves);
      EXPECT_NEAR(seen_along(model, down).area_m2 / area_of(hull), expected, 1e-9);
    }
  }
}

TEST(Foliage, EqualSpecificationsGiveEqualGeometry) {
  for (const AssetKind kind : {AssetKind::Birch, AssetKind::Oak, AssetKind::Pine}) {
    const AssetSpec spec{.kind = kind,
                         .size_m = 2,
                         .leaves = LeafModel::Geometry,
                         .health = 0.7,
                         .seed = {5},
                         .detail = 0.25};
    AssetSpec other = spec;
    other.seed = {6};
    const Model model = make_asset(spec);
    EXPECT_EQ(make_asset(spec).mesh.vertices_m, model.mesh.vertices_m);
    EXPECT_EQ(make_asset(spec).mesh.triangles, model.mesh.triangles);
    EXPECT_NE(make_asset(other).mesh.vertices_m, model.mesh.vertices_m);
  }
}

TEST(Foliage, PlantsOfGeometryKeepTheirTriangleBudgets) {
  struct Budget {
    AssetKind kind;
    LeafModel leaves;
    std::size_t least, most;
  };
  for (const Budget& budget : {Budget{AssetKind::Spruce, LeafModel::Geometry, 200'000, 320'000},
                               Budget{AssetKind::Pine, LeafModel::Geometry, 150'000, 220'000},
                               Budget{AssetKind::Birch, LeafModel::Geometry, 100'000, 220'000},
                               Budget{AssetKind::Oak, LeafModel::Geometry, 200'000, 260'000},
                               Budget{AssetKind::Bush, LeafModel::Geometry, 30'000, 60'000},
                               Budget{AssetKind::Fern, LeafModel::Cards, 1540, 1540},
                               Budget{AssetKind::Reed, LeafModel::Cards, 5000, 7000},
                               Budget{AssetKind::GrassPatch, LeafModel::Cards, 8000, 10'500},
                               Budget{AssetKind::FallenLog, LeafModel::Cards, 600, 900},
                               Budget{AssetKind::Snag, LeafModel::Cards, 1500, 4000}}) {
    SCOPED_TRACE(asset_name(budget.kind));
    const Model model = make_asset({.kind = budget.kind, .leaves = budget.leaves, .seed = {2}});
    EXPECT_GE(model.mesh.triangles.size(), budget.least);
    EXPECT_LE(model.mesh.triangles.size(), budget.most);
  }
}

TEST(Foliage, DeadTreesAreBareWood) {
  for (const AssetKind kind : with_leaves) {
    if (kind == AssetKind::Conifer) continue;
    for (const LeafModel leaves : {LeafModel::Cards, LeafModel::Geometry}) {
      SCOPED_TRACE(asset_name(kind));
      const Model dead = make_asset({.kind = kind, .leaves = leaves, .health = 0});
      ASSERT_EQ(dead.surfaces.size(), 1u);
      EXPECT_EQ(dead.surfaces[0].name, "wood");
    }
  }
}

}  // namespace
}  // namespace groundray::foliage_test
