#include "terrain/assets/asset.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/error.h"
#include "terrain/assets/asset_defaults.h"
#include "terrain/dem/byte_hash.h"

namespace groundray::asset_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double pi = std::numbers::pi;
constexpr double rounding = 1e-13;  // relative: a few hundred roundings of a double

std::vector<AssetKind> all_kinds() {
  std::vector<AssetKind> kinds;
  for (const std::string_view name : asset_names()) kinds.push_back(asset_kind(name));
  return kinds;
}

const std::vector<AssetKind> plants = {AssetKind::GrassTuft, AssetKind::Shrub, AssetKind::Conifer,
                                       AssetKind::BroadleafTree};
const std::set<AssetKind> with_variants = {
    AssetKind::Rock,    AssetKind::Stone,         AssetKind::GrassTuft,  AssetKind::Shrub,
    AssetKind::Conifer, AssetKind::BroadleafTree, AssetKind::Spruce,     AssetKind::Pine,
    AssetKind::Birch,   AssetKind::Oak,           AssetKind::Bush,       AssetKind::Snag,
    AssetKind::Fern,    AssetKind::Reed,          AssetKind::GrassPatch, AssetKind::FallenLog,
    AssetKind::Stump,   AssetKind::Person,        AssetKind::Deer,       AssetKind::Pickup,
    AssetKind::Tractor, AssetKind::Fence,         AssetKind::Sign,       AssetKind::HayBale,
    AssetKind::Boulder};
const std::set<AssetKind> without_detail = {AssetKind::Vehicle, AssetKind::CalibrationBoard,
                                            AssetKind::Person, AssetKind::Deer, AssetKind::Sign};
const std::set<AssetKind> with_wheels = {AssetKind::Pickup, AssetKind::Ugv, AssetKind::Tractor};
const std::set<AssetKind> sculpted = {AssetKind::Pickup};
const std::vector<AssetKind> leafy = {AssetKind::Shrub, AssetKind::Conifer,
                                      AssetKind::BroadleafTree};

// Every kind, in some variants, details and shapes.
std::vector<AssetSpec> some_specs() {
  std::vector<AssetSpec> specs;
  for (const AssetKind kind : all_kinds()) {
    specs.push_back({.kind = kind});
    for (const std::uint64_t seed : {1u, 2u, 77u}) {
      if (with_variants.contains(kind)) specs.push_back({.kind = kind, .seed = {seed}});
    }
    for (const double detail : {0.25, 3.0}) {
      if (!without_detail.contains(kind)) specs.push_back({.kind = kind, .detail = detail});
    }
  }
  for (const AssetKind kind :
       {AssetKind::Shrub, AssetKind::BroadleafTree, AssetKind::Spruce, AssetKind::Pine,
        AssetKind::Birch, AssetKind::Oak, AssetKind::Bush}) {
    specs.push_back({.kind = kind, .size_m = 2, .leaves = LeafModel::Geometry, .detail = 0.25});
    specs.push_back({.kind = kind, .size_m = 2, .health = 0.5, .seed = {3}});
  }
  specs.push_back({.kind = AssetKind::CalibrationBoard, .square_m = 0.1});
  specs.push_back({.kind = AssetKind::Wire, .size_m = 3, .width_m = 0.002, .sag_m = 3});
  return specs;
}

std::string label(const AssetSpec& spec) {
  return fmt::format("{} of seed {} and detail {}", asset_name(spec.kind), spec.seed.value,
                     spec.detail);
}

struct Box {
  glm::dvec3 low{std::numeric_limits<double>::infinity()};
  glm::dvec3 high{-std::numeric_limits<double>::infinity()};
  glm::dvec3 extent() const { return high - low; }
};

Box box_of(const Model& model) {
  Box box;
  for (const glm::dvec3& p : model.mesh.vertices_m) {
    box.low = glm::min(box.low, p);
    box.high = glm::max(box.high, p);
  }
  return box;
}

std::array<glm::dvec3, 3> corners(const Model& model, std::size_t triangle) {
  const glm::uvec3 t = model.mesh.triangles[triangle];
  return {model.mesh.vertices_m[t.x], model.mesh.vertices_m[t.y], model.mesh.vertices_m[t.z]};
}

glm::dvec3 area_vector(const std::array<glm::dvec3, 3>& p) {
  return glm::cross(p[1] - p[0], p[2] - p[0]) / 2.0;
}

double area_of(const Model& model, const std::string& surface) {
  double sum = 0;
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    if (model.surfaces[model.surface_of[i]].name != surface) continue;
    sum += glm::length(area_vector(corners(model, i)));
  }
  return sum;
}

double volume(const Model& model) {
  double sum = 0;
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
    const auto p = corners(model, i);
    sum += glm::dot(p[0], glm::cross(p[1], p[2])) / 6;
  }
  return sum;
}

bool is_sheet(const ModelSurface& surface) {
  return surface.name == "leaf" || surface.name == "broad_leaf" || surface.name == "dry_grass";
}

// Connected pieces of a model. Vertices at the same position are merged, so that the faces at a
// sharp edge count as connected.
class Pieces {
 public:
  explicit Pieces(const Model& model) : model_(model) {
    for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
      if (!is_sheet(model.surfaces[model.surface_of[i]])) add(i);
    }
  }

  // Returns true if each edge is used exactly once in each direction.
  bool is_closed() const {
    return std::ranges::all_of(edges_, [&](const auto& edge) {
      const auto back = edges_.find({edge.first.second, edge.first.first});
      return edge.second == 1 && back != edges_.end() && back->second == 1;
    });
  }

  // Returns the volume and the Euler characteristic V - E + F of each connected piece.
  std::vector<std::pair<double, int>> solids() {
    std::map<std::size_t, std::pair<double, int>> solids;
    for (std::size_t place = 0; place < root_.size(); ++place) ++solids[find(place)].second;
    for (const auto& [edge, count] : edges_) {
      if (edge.first < edge.second) --solids[find(edge.first)].second;
    }
    for (const auto& [triangle, place] : first_place_) {
      const auto p = corners(model_, triangle);
      auto& solid = solids[find(place)];
      solid.first += glm::dot(p[0], glm::cross(p[1], p[2])) / 6;
      ++solid.second;
    }
    std::vector<std::pair<double, int>> list;
    for (const auto& [root, solid] : solids) list.push_back(solid);
    return list;
  }

 private:
  void add(std::size_t triangle) {
    const auto p = corners(model_, triangle);
    std::array<std::size_t, 3> place{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [it, is_new] = places_.try_emplace({p[i].x, p[i].y, p[i].z}, root_.size());
      if (is_new) root_.push_back(root_.size());
      place[i] = it->second;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      ++edges_[{place[i], place[(i + 1) % 3]}];
      root_[find(place[i])] = find(place[(i + 1) % 3]);
    }
    first_place_.emplace_back(triangle, place[0]);
  }

  std::size_t find(std::size_t place) {
    while (root_[place] != place) place = root_[place] = root_[root_[place]];
    return place;
  }

  const Model& model_;
  std::map<std::tuple<double, double, double>, std::size_t> places_;
  std::map<std::pair<std::size_t, std::size_t>, int> edges_;
  std::vector<std::size_t> root_;
  std::vector<std::pair<std::size_t, std::size_t>> first_place_;
};

template <typename T>
std::string_view bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

std::uint64_t hash_of(const Model& model) {
  std::string all;
  all += bytes_of(model.mesh.vertices_m);
  all += bytes_of(model.mesh.triangles);
  all += bytes_of(model.uv);
  all += bytes_of(model.normals);
  all += bytes_of(model.surface_of);
  for (const ModelSurface& surface : model.surfaces) {
    const auto pixels = surface.albedo.pixels.values();
    all += surface.name;
    all += std::string_view(reinterpret_cast<const char*>(&surface.color), sizeof surface.color);
    all += std::string_view(reinterpret_cast<const char*>(pixels.data()), pixels.size());
  }
  return byte_hash(all);
}

TEST(Asset, KindsAndNamesCorrespond) {
  EXPECT_EQ(asset_names().size(), 32u);
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < asset_names().size(); ++i) {
    EXPECT_EQ(asset_kind(asset_names()[i]), static_cast<AssetKind>(i));
    EXPECT_EQ(asset_name(static_cast<AssetKind>(i)), asset_names()[i]);
    names.insert(asset_names()[i]);
  }
  EXPECT_EQ(names.size(), 32u);
  EXPECT_EQ(asset_name(AssetKind::BroadleafTree), "broadleaf_tree");
  EXPECT_EQ(asset_kind("sphere_target"), AssetKind::SphereTarget);
}

TEST(Asset, IsAValidModel) {
  for (const AssetSpec& spec : some_specs()) {
    SCOPED_TRACE(label(spec));
    const Model model = make_asset(spec);
    const std::size_t count = model.mesh.vertices_m.size();
    ASSERT_FALSE(model.mesh.triangles.empty());
    EXPECT_TRUE(model.uv.empty() || model.uv.size() == count);
    EXPECT_TRUE(model.normals.empty() || model.normals.size() == count);
    ASSERT_EQ(model.surface_of.size(), model.mesh.triangles.size());
    std::vector<char> is_used(count, 0);
    for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
      ASSERT_LT(model.surface_of[i], model.surfaces.size());
      for (int k = 0; k < 3; ++k) {
        ASSERT_LT(model.mesh.triangles[i][k], count);
        is_used[model.mesh.triangles[i][k]] = 1;
      }
    }
    EXPECT_EQ(std::ranges::count(is_used, 0), 0);
    for (const glm::dvec3& p : model.mesh.vertices_m) {
      ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    }
    for (const glm::vec3& normal : model.normals) ASSERT_NEAR(glm::length(normal), 1, 1e-6);
    for (const glm::vec2& uv : model.uv) {
      ASSERT_TRUE(0 <= uv.x && uv.x <= 1 && 0 <= uv.y && uv.y <= 1) << uv.x << ' ' << uv.y;
    }
    for (const ModelSurface& surface : model.surfaces) {
      for (int k = 0; k < 3; ++k) EXPECT_TRUE(surface.color[k] > 0 && surface.color[k] <= 1);
    }
  }
}

// The measure is the smallest height of a triangle (above its longest side) divided by the longest
// side.
TEST(Asset, HasNoSlivers) {
  for (const AssetSpec& spec : some_specs()) {
    SCOPED_TRACE(label(spec));
    const Model model = make_asset(spec);
    double worst = 1;
    for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
      const auto p = corners(model, i);
      const double longest = std::max(
          {glm::distance(p[0], p[1]), glm::distance(p[1], p[2]), glm::distance(p[2], p[0])});
      worst = std::min(worst, 2 * glm::length(area_vector(p)) / (longest * longest));
    }
    EXPECT_GT(worst, 1e-4);
  }
}

TEST(Asset, PartsExceptLeavesAreClosedAndFaceOutward) {
  for (const AssetSpec& spec : some_specs()) {
    SCOPED_TRACE(label(spec));
    const Model model = make_asset(spec);
    Pieces pieces(model);
    EXPECT_TRUE(pieces.is_closed());
    for (const auto& [solid, euler] : pieces.solids()) {
      EXPECT_GT(solid, 0);
      // Euler characteristic of a sphere: no handles, no touching pieces. Each handle of a sculpted
      // body takes 2 away.
      if (sculpted.contains(spec.kind)) {
        EXPECT_LE(euler, 2);
        EXPECT_EQ(euler % 2, 0);
      } else {
        EXPECT_EQ(euler, 2);
      }
    }
  }
}

double volume_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                 const glm::dvec3& d) {
  return glm::dot(b - a, glm::cross(c - a, d - a));
}

// Returns true if the segment from a to b passes through the interior of a triangle.
bool pierces(const glm::dvec3& a, const glm::dvec3& b, const std::array<glm::dvec3, 3>& p) {
  const double from = volume_of(p[0], p[1], p[2], a), to = volume_of(p[0], p[1], p[2], b);
  if ((from > 0) == (to > 0)) return false;
  const bool left = volume_of(a, b, p[0], p[1]) > 0;
  return left == (volume_of(a, b, p[1], p[2]) > 0) && left == (volume_of(a, b, p[2], p[0]) > 0);
}

// Tests every edge against every triangle with which it shares no vertex.
TEST(Asset, RocksDoNotSelfIntersect) {
  for (const AssetKind kind : {AssetKind::Rock, AssetKind::Stone, AssetKind::Boulder}) {
    for (const std::uint64_t seed : {3u, 4u}) {
      const double detail = kind == AssetKind::Boulder ? 0.25 : 0.5;
      const Model model = make_asset({.kind = kind, .seed = {seed}, .detail = detail});
      ASSERT_EQ(Pieces(model).solids().size(), 1u);
      const auto& p = model.mesh.vertices_m;
      int cuts = 0;
      for (const glm::uvec3& t : model.mesh.triangles) {
        for (int k = 0; k < 3; ++k) {
          const unsigned from = t[k], to = t[(k + 1) % 3];
          if (from > to) continue;
          for (const glm::uvec3& other : model.mesh.triangles) {
            const std::array<unsigned, 3> c{other.x, other.y, other.z};
            if (std::ranges::count(c, from) + std::ranges::count(c, to) > 0) continue;
            cuts += pierces(p[from], p[to], {p[c[0]], p[c[1]], p[c[2]]}) ? 1 : 0;
          }
        }
      }
      EXPECT_EQ(cuts, 0);
    }
  }
}

TEST(Asset, HasTheRequestedSize) {
  for (const AssetKind kind : all_kinds()) {
    for (const double size_m : {0.7, 2.5}) {
      SCOPED_TRACE(fmt::format("{} of {} m", asset_name(kind), size_m));
      AssetSpec spec{.kind = kind, .size_m = size_m};
      if (with_variants.contains(kind)) spec.seed = {9};
      if (kind == AssetKind::Wire) {
        spec.width_m = 0.004;
        spec.sag_m = 0.3;
      }
      const Box box = box_of(make_asset(spec));
      const glm::dvec3 extent = box.extent();
      switch (kind) {
        case AssetKind::Rock:
        case AssetKind::Stone:
        case AssetKind::Boulder:
          EXPECT_NEAR(std::max({extent.x, extent.y, extent.z}), size_m, rounding * size_m);
          EXPECT_LT(box.low.z, 0);
          EXPECT_NEAR(box.low.x + box.high.x, 0, rounding * size_m);
          break;
        case AssetKind::Vehicle:
          EXPECT_NEAR(extent.x, size_m, rounding * size_m);
          EXPECT_NEAR(box.low.z, 0, rounding * size_m);
          EXPECT_NEAR(extent.y / extent.x, 1.855 / 5.273, 1e-12);
          EXPECT_NEAR(extent.z / extent.x, 1.865 / 5.273, 0.01 / 5.273);  // panes protrude
          break;
        case AssetKind::Pickup:
        case AssetKind::Ugv:
        case AssetKind::Tractor:
          EXPECT_NEAR(extent.x, size_m, rounding * size_m);
          EXPECT_NEAR(box.low.z, 0, rounding * size_m);
          break;
        case AssetKind::FallenLog:
          EXPECT_NEAR(extent.x, size_m, rounding * size_m);
          EXPECT_LT(box.low.z, 0);
          break;
        case AssetKind::Fence:  // between the axes of its outer posts, of 5 inches
          EXPECT_NEAR(extent.x, size_m, 0.2);
          break;
        case AssetKind::HayBale:  // a flat foot, and straws that stand out
          EXPECT_NEAR(extent.z, size_m, 0.08 * size_m);
          EXPECT_NEAR(box.low.z, 0, 0.01);
          break;
        case AssetKind::Wire:
          EXPECT_NEAR(box.low.z, -0.3 - 0.002 * (pi / 8) / std::sin(pi / 8), 1e-4);
          EXPECT_NEAR(extent.x, size_m, 0.004);
          break;
        case AssetKind::SphereTarget:
          EXPECT_LE(extent.z, size_m * (1 + rounding));
          EXPECT_GT(extent.z, 0.997 * size_m);
          break;
        case AssetKind::Deer:  // the withers; see deer_test.cpp
          EXPECT_GT(box.high.z, 0.99 * size_m);
          EXPECT_LT(box.high.z, 1.5 * size_m);
          EXPECT_NEAR(box.low.z, 0, 0.003 * size_m);
          break;
        default:
          EXPECT_NEAR(box.high.z, size_m, rounding * size_m);
          EXPECT_LE(box.low.z, 0);
      }
    }
  }
}

TEST(Asset, CylindersHaveTheVolumeOfTheirPrisms) {
  const Model person = make_asset({.kind = AssetKind::PersonCylinder});
  const double sides = 128, r = 0.25;
  EXPECT_NEAR(volume(person), 1.75 * sides / 2 * r * r * std::sin(2 * pi / sides), 1e-13);
  const glm::dvec3 extent = box_of(person).extent();
  EXPECT_NEAR(extent.x, 0.5, 1e-15);
  EXPECT_NEAR(extent.y, 0.5, 1e-15);
  EXPECT_EQ(box_of(person).low.z, 0);
  // Deviation from the exact cylinder: the sagitta of a side, below 0.1 mm.
  EXPECT_LT(r * (1 - std::cos(pi / sides)), 1e-4);

  const Model post = make_asset({.kind = AssetKind::FencePost, .size_m = 1, .width_m = 0.2});
  EXPECT_NEAR(volume(post), 1.46 * 8 * 0.01 * std::sin(2 * pi / 16), 1e-14);
  EXPECT_NEAR(box_of(post).low.z, -0.46, 1e-15);
}

// Vertices lie on the sphere, and the circumradius of a triangle bounds its distance from it.
TEST(Asset, SphereDeviatesFromTheExactSphereWithinItsBound) {
  const double r = 0.5;
  for (const double detail : {1.0, 4.0}) {
    const Model model =
        make_asset({.kind = AssetKind::SphereTarget, .size_m = 2 * r, .detail = detail});
    const glm::dvec3 center{0, 0, r};
    for (const glm::dvec3& p : model.mesh.vertices_m) {
      EXPECT_NEAR(glm::distance(p, center), r, 1e-15);
    }
    double deepest = 0;
    for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
      const auto p = corners(model, i);
      const double plane = glm::dot(glm::normalize(area_vector(p)), p[0] - center);
      deepest = std::max(deepest, r - plane);
    }
    EXPECT_LT(deepest, 1.2e-3 * r / detail);  // docs/reference/assets.md
    EXPECT_GT(volume(model), 4 * pi / 3 * r * r * r * (1 - 3.6e-3 / detail));
  }
}

// The catenary's parameter a is computed by Newton's method, from below, in long double.
TEST(Asset, WireIsACatenary) {
  struct Case {
    double span_m, sag_m, width_m, detail;
  };
  for (const Case& wire : {Case{50, 1, 0.0101, 1}, Case{300, 9, 0.02, 2}, Case{4, 4, 0.002, 1}}) {
    const Model model = make_asset({.kind = AssetKind::Wire,
                                    .size_m = wire.span_m,
                                    .width_m = wire.width_m,
                                    .sag_m = wire.sag_m,
                                    .detail = wire.detail});
    const long double h = wire.span_m / 2, sag = wire.sag_m;
    long double x = 2 * sag / h;  // h / a
    for (int i = 0; i < 100; ++i) {
      const long double f = (std::cosh(x) - 1) / x - sag / h;
      x -= f / ((x * std::sinh(x) - std::cosh(x) + 1) / (x * x));
    }
    const double a = static_cast<double>(h / x);
    constexpr std::size_t sides = 8;
    const std::size_t rings = model.mesh.vertices_m.size() / sides;
    double length = 0, lowest = 0;
    glm::dvec3 before(0);
    for (std::size_t i = 0; i < rings; ++i) {
      glm::dvec3 p(0);
      for (std::size_t s = 0; s < sides; ++s) p += model.mesh.vertices_m[i * sides + s] / 8.0;
      EXPECT_NEAR(p.z, a * (std::cosh(p.x / a) - 1) - wire.sag_m, 1e-11 * wire.span_m);
      EXPECT_NEAR(p.y, 0, 1e-12);
      lowest = std::min(lowest, p.z);
      if (i > 0) length += glm::distance(p, before);
      before = p;
    }
    EXPECT_NEAR(lowest, -wire.sag_m, 1e-12 * wire.span_m);
    EXPECT_NEAR(before.x, wire.span_m / 2, 1e-12 * wire.span_m);
    // An arc exceeds its chord c by at most c^3 / (24 a^2), and chords are c <= sqrt(8 a d / 20).
    const double exact = 2 * a * std::sinh(wire.span_m / (2 * a));
    EXPECT_LE(length, exact * (1 + 1e-12));
    EXPECT_GE(length, exact * (1 - wire.width_m / (60 * a * wire.detail)));
    // The mean width is the perimeter over pi (Cauchy): a prism's lateral area over its length and
    // pi.
    double area = 0;
    for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i) {
      area += glm::length(area_vector(corners(model, i)));
    }
    const double circumradius = wire.width_m * pi / (2 * sides * std::sin(pi / sides));
    const double caps = sides * circumradius * circumradius * std::sin(2 * pi / sides);
    EXPECT_NEAR((area - caps) / (pi * length), wire.width_m, 1e-3 * wire.width_m);
  }
}

TEST(Asset, BoardHasItsSizeAndSquares) {
  const Model plain =
      make_asset({.kind = AssetKind::CalibrationBoard, .size_m = 1.2, .width_m = 0.9});
  EXPECT_EQ(plain.mesh.triangles.size(), 12u);
  EXPECT_EQ(plain.surfaces.size(), 1u);
  EXPECT_NEAR(volume(plain), 1.2 * 0.9 * 0.01, 1e-15);
  const Box box = box_of(plain);
  EXPECT_EQ(box.high, glm::dvec3(0, 0.45, 1.2));
  EXPECT_EQ(box.low, glm::dvec3(-0.01, -0.45, 0));

  const Model checker = make_asset(
      {.kind = AssetKind::CalibrationBoard, .size_m = 0.7, .width_m = 0.5, .square_m = 0.1});
  EXPECT_NEAR(volume(checker), 0.7 * 0.5 * 0.01, 1e-15);
  EXPECT_NEAR(area_of(checker, "black_paint"), 18 * 0.01, 1e-15);
  EXPECT_NEAR(area_of(checker, "white_paint"), 17 * 0.01, 1e-15);
  for (std::size_t i = 0; i < checker.mesh.triangles.size(); ++i) {
    const std::string& name = checker.surfaces[checker.surface_of[i]].name;
    if (name == "metal") continue;
    const auto p = corners(checker, i);
    const glm::dvec3 middle = (p[0] + p[1] + p[2]) / 3.0;
    EXPECT_EQ(middle.x, 0);
    const int square = static_cast<int>((middle.y + 0.25) / 0.1) + static_cast<int>(middle.z / 0.1);
    EXPECT_EQ(name, square % 2 == 0 ? "black_paint" : "white_paint");
  }
}

TEST(Asset, BytesDependOnTheSeedAlone) {
  for (const AssetKind kind : with_variants) {
    SCOPED_TRACE(asset_name(kind));
    std::set<std::uint64_t> hashes;
    for (const std::uint64_t seed : {0ull, 1ull, 1ull << 40}) {
      const AssetSpec spec{.kind = kind, .seed = {seed}};
      const std::uint64_t hash = hash_of(make_asset(spec));
      EXPECT_EQ(hash_of(make_asset(spec)), hash);
      hashes.insert(hash);
    }
    EXPECT_EQ(hashes.size(), 3u);
  }
}

TEST(Asset, KeepsItsTriangleBudget) {
  struct Budget {
    AssetKind kind;
    std::size_t least, most;
  };
  for (const Budget& budget :
       {Budget{AssetKind::Rock, 1280, 1280}, Budget{AssetKind::Stone, 320, 320},
        Budget{AssetKind::GrassTuft, 100, 300}, Budget{AssetKind::Shrub, 1500, 2000},
        Budget{AssetKind::Conifer, 1500, 2000}, Budget{AssetKind::BroadleafTree, 1500, 2000},
        Budget{AssetKind::Spruce, 1500, 2000}, Budget{AssetKind::Pine, 1500, 2000},
        Budget{AssetKind::Birch, 1500, 2000}, Budget{AssetKind::Oak, 1500, 2000},
        Budget{AssetKind::Bush, 1500, 2000}, Budget{AssetKind::Vehicle, 500, 2000},
        Budget{AssetKind::Pickup, 100000, 120000}, Budget{AssetKind::Ugv, 15000, 25000},
        Budget{AssetKind::Tractor, 30000, 45000}, Budget{AssetKind::HayBale, 33000, 42000},
        Budget{AssetKind::Boulder, 8000, 8000}}) {
    SCOPED_TRACE(asset_name(budget.kind));
    const std::uint64_t variants = with_variants.contains(budget.kind) ? 8 : 1;
    for (std::uint64_t seed = 0; seed < variants; ++seed) {
      const std::size_t count =
          make_asset({.kind = budget.kind, .seed = {seed}}).mesh.triangles.size();
      EXPECT_GE(count, budget.least);
      EXPECT_LE(count, budget.most);
    }
    // The treads of tyres do not depend on detail.
    if (without_detail.contains(budget.kind) || with_wheels.contains(budget.kind)) continue;
    const double fine =
        static_cast<double>(make_asset({.kind = budget.kind, .detail = 4}).mesh.triangles.size());
    EXPECT_GT(fine, 3.2 * static_cast<double>(budget.least));
    EXPECT_LE(fine, 4 * static_cast<double>(budget.most));
  }
}

// Each card is a square of the same size; the opaque fraction of its image is the leaf's fraction.
TEST(Asset, HasTheRequestedLeafAreaIndex) {
  for (const AssetKind kind : leafy) {
    for (const double index : {0.5, 3.0, 8.0}) {
      for (const double detail : {1.0, 2.0}) {
        SCOPED_TRACE(fmt::format("{}, index {}, detail {}", asset_name(kind), index, detail));
        const Model model =
            make_asset({.kind = kind, .leaf_area_index = index, .seed = {4}, .detail = detail});
        const FoliageArea area = foliage_area(model);
        EXPECT_NEAR(area.index(), index, 1e-9 * index);
        const Image8& image = model.surfaces[1].albedo.pixels;
        const std::string name = kind == AssetKind::Conifer ? "leaf" : "broad_leaf";
        ASSERT_EQ(model.surfaces[1].name, name);
        double opaque = 0;
        for (int y = 0; y < image.height(); ++y) {
          for (int x = 0; x < image.width(); ++x) opaque += image.at(x, y)[3] >= 128 ? 1 : 0;
        }
        opaque /= image.width() * image.height();
        EXPECT_NEAR(area.leaf_m2, opaque * area_of(model, name), 1e-12 * area.leaf_m2);
      }
    }
  }
}

// Asner et al. (2003): mean over all biomes without outliers 4.5, standard deviation 2.5.
TEST(Asset, DefaultLeafAreaIndexIsThatOfRealPlants) {
  for (const AssetKind kind : leafy) {
    EXPECT_NEAR(foliage_area(make_asset({.kind = kind})).index(), 4.5, 2.5);
  }
  const FoliageArea rock = foliage_area(make_asset({.kind = AssetKind::Rock}));
  EXPECT_EQ(rock.leaf_m2, 0);
  EXPECT_EQ(rock.index(), 0);
}

// One square metre of horizontal leaf in two triangles; without an image the area is that of the
// geometry alone.
TEST(FoliageArea, MatchesTheAreaOfAFlatSquare) {
  Model model;
  model.mesh.vertices_m = {{0, 0, 2}, {1, 0, 2}, {1, 1, 2}, {0, 1, 2}, {9, 9, 0}};
  model.mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 1, 4}};
  model.surfaces.resize(2);
  model.surfaces[0].name = "leaf";
  model.surfaces[1].name = "rock";
  model.surface_of = {0, 0, 1};
  EXPECT_DOUBLE_EQ(foliage_area(model).leaf_m2, 1);
  EXPECT_DOUBLE_EQ(foliage_area(model).crown_m2, 1);
  model.surfaces[0].albedo.pixels = Image8(2, 2, 4);
  model.surfaces[0].albedo.pixels.at(0, 0)[3] = 255;
  model.surfaces[0].albedo.pixels.at(1, 0)[3] = 127;
  EXPECT_DOUBLE_EQ(foliage_area(model).index(), 0.25);
}

TEST(Asset, TrunkDiameterIsPlausible) {
  for (const AssetKind kind : {AssetKind::Conifer, AssetKind::BroadleafTree}) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Model model = make_asset({.kind = kind, .size_m = 10, .seed = {seed}});
      // The first eight vertices are the base of the thickest tube.
      const double foot = glm::distance(model.mesh.vertices_m[0], model.mesh.vertices_m[4]);
      EXPECT_GT(foot, 10.0 / 80);
      EXPECT_LT(foot, 10.0 / 30);
      EXPECT_LT(box_of(model).low.z, 0);
    }
  }
}

TEST(Asset, LeafImagesHaveAlphaAndTheBrightnessOfTheirMaterial) {
  for (const AssetKind kind : leafy) {
    SCOPED_TRACE(asset_name(kind));
    const Model model = make_asset({.kind = kind});
    const ModelSurface& leaf = model.surfaces.back();
    const Image8& image = leaf.albedo.pixels;
    ASSERT_EQ(image.channels(), 4);
    double opaque = 0, sum = 0, foot = 0, crossings = 0;
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) {
        const bool is_leaf = image.at(x, y)[3] >= 128;
        if (x > 0 && is_leaf != (image.at(x - 1, y)[3] >= 128)) ++crossings;
        if (!is_leaf) continue;
        ++opaque;
        const double srgb = image.at(x, y)[1] / 255.0;
        sum += srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
        if (y == image.height() - 1) foot += std::abs(x + 0.5 - image.width() / 2.0) < 4 ? 1 : -99;
      }
    }
    EXPECT_GT(opaque / (image.width() * image.height()), 0.2);
    EXPECT_LT(opaque / (image.width() * image.height()), 0.7);
    EXPECT_GT(crossings, 500);
    EXPECT_GT(foot, 0);  // the twig reaches the middle of the lower edge: v points up
    // Values of data/materials under D65; the tolerance is that of float.
    const double green = kind == AssetKind::Conifer ? 0.164 : 0.127;
    EXPECT_NEAR(leaf.color.g * sum / opaque, green, 1e-6);
  }
}

TEST(Asset, SurfacesAreNamedAfterMaterialsOrHaveAStandIn) {
  const std::set<std::string> known = {
      "rock",        "gravel",      "dry_grass", "bark",    "wood",
      "leaf",        "broad_leaf",  "metal",     "asphalt", "retro_reflector",
      "white_paint", "black_paint", "litter",    "char",    "dry_soil"};
  for (const AssetSpec& spec : some_specs()) {
    for (const ModelSurface& surface : make_asset(spec).surfaces) {
      // Others have a material that stands in for theirs.
      const std::string stand_in(asset_stand_in(surface.name));
      EXPECT_TRUE(known.contains(stand_in.empty() ? surface.name : stand_in)) << surface.name;
    }
  }
}

std::string message_of(const AssetSpec& spec) {
  try {
    make_asset(spec);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Asset, RejectsMembersThatItsKindDoesNotHave) {
  EXPECT_THAT(
      message_of({.kind = AssetKind::Rock, .size_m = -1, .sag_m = 2, .detail = std::nan("")}),
      AllOf(HasSubstr("AssetSpec"), HasSubstr("size_m = -1 must be from 0.001"),
            HasSubstr("sag_m = 2 is set, but a rock has no sag_m"), HasSubstr("detail = nan")));
  EXPECT_THAT(message_of({.kind = AssetKind::Wire, .size_m = 2, .sag_m = 3}),
              HasSubstr("sag_m = 3 must not exceed the span of 2 m"));
  EXPECT_THAT(message_of({.kind = AssetKind::Conifer, .leaf_area_index = std::nan("")}),
              HasSubstr("leaf_area_index = nan must be from 0.1 to 20"));
  EXPECT_THAT(
      message_of({.kind = AssetKind::CalibrationBoard, .square_m = 0.3}),
      HasSubstr("square_m = 0.3 must divide the board's 0.8 m into a whole number of squares"));
  for (const AssetKind kind : all_kinds()) {
    SCOPED_TRACE(asset_name(kind));
    EXPECT_THAT(message_of({.kind = kind, .seed = {4}}),
                HasSubstr(with_variants.contains(kind) ? "no error" : "has no variants"));
    EXPECT_THAT(message_of({.kind = kind, .detail = 4}),
                HasSubstr(without_detail.contains(kind) ? "always has the same" : "no error"));
  }
  EXPECT_THAT(message_of({.kind = static_cast<AssetKind>(99)}), HasSubstr("kind = 99"));
  try {
    asset_kind("palm");
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("there is no asset 'palm'"), HasSubstr("conifer, broadleaf_tree")));
  }
}

}  // namespace
}  // namespace groundray::asset_test
