// Fences of wooden posts and five wires. Posts of 6 feet, of which 24 inches are in the ground, and
// of 3.5 inches, wires up to 42 inches, and bays of at most 14 feet follow USDA NRCS Kentucky, code
// 382, containment barbed wire fence (2007): "at least five wires", "not less than 42 inches", "a
// minimum of 3-4 inches", "a maximum interval of 14 feet". Posts at corners and ends are our own.
#include "terrain/assets/fence.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>

#include "core/error.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_defaults.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_shapes.h"

namespace groundray {
namespace {

constexpr double inch_m = 0.0254;
constexpr double post_height_m = 48 * inch_m, buried_m = 24 * inch_m;
constexpr double post_radius_m = 3.5 * inch_m / 2, end_radius_m = 5 * inch_m / 2;
constexpr double top_wire_m = 42 * inch_m;
constexpr double wire_radius_m = 0.0025;  // two strands of 2.5 mm, 12 1/2 gauge
constexpr int wires = 5;

class FenceMaker {
 public:
  FenceMaker(AssetBuilder& builder, std::span<const glm::dvec3> posts, AssetRandom random,
             double detail)
      : builder_(builder),
        posts_(posts),
        random_(random),
        sides_(std::max(8, 2 * static_cast<int>(std::lround(6 * std::sqrt(detail))))),
        wood_(builder.add_surface(asset_surface("wood"))),
        metal_(builder.add_surface(asset_surface("metal"))) {}

  void add() {
    for (std::size_t i = 0; i < posts_.size(); ++i) add_post(i);
    for (int wire = 0; wire < wires; ++wire) add_wire(top_wire_m * (wire + 1) / wires);
  }

 private:
  // Direction of the fence in plan from post i - 1 or i to the next one; both at the ends.
  glm::dvec3 along(std::size_t bay) const {
    glm::dvec3 step = posts_[bay + 1] - posts_[bay];
    step.z = 0;
    return glm::normalize(step);
  }
  glm::dvec3 before(std::size_t i) const { return along(i == 0 ? 0 : i - 1); }
  glm::dvec3 after(std::size_t i) const { return along(std::min(i, posts_.size() - 2)); }

  bool is_end(std::size_t i) const {
    return i == 0 || i + 1 == posts_.size() || glm::dot(before(i), after(i)) < 0.966;
  }
  double radius(std::size_t i) const { return is_end(i) ? end_radius_m : post_radius_m; }

  // A post that leans a little, with a crooked axis and a bevelled top.
  void add_post(std::size_t i) {
    const double lean_x = 0.015 * random_.normal();
    const double lean_y = 0.015 * random_.normal();
    const double taller = 0.02 * random_.normal();
    const double thick = radius(i) * random_.between(0.94, 1.06);
    const double top = post_height_m + taller + (is_end(i) ? 0.08 : 0);
    std::vector<TubeRing> rings;
    for (const double z : {-buried_m, 0.0, 0.4 * top, 0.8 * top, top - 0.15 * thick, top}) {
      const double bend = 0.004 * random_.normal();
      rings.push_back({posts_[i] + glm::dvec3(lean_x * z + bend, lean_y * z - bend, z),
                       (z == top ? 0.85 : 1.0) * thick * random_.between(0.97, 1.03)});
    }
    add_pipe(builder_, rings, sides_, wood_);
  }

  // A wire on the left side of the posts; outside of them where the line turns right.
  void add_wire(double height) {
    std::vector<TubeRing> rings;
    for (std::size_t i = 0; i < posts_.size(); ++i) {
      const glm::dvec3 direction = before(i) + after(i);
      const glm::dvec3 left = glm::normalize(glm::dvec3(-direction.y, direction.x, 0));
      rings.push_back(
          {posts_[i] + 0.95 * radius(i) * left + glm::dvec3(0, 0, height), wire_radius_m});
    }
    add_pipe(builder_, rings, 6, metal_);
  }

  AssetBuilder& builder_;
  std::span<const glm::dvec3> posts_;
  AssetRandom random_;
  int sides_;
  std::uint16_t wood_, metal_;
};

Model fence_of(std::span<const glm::dvec3> posts, const AssetRandom& random, double detail) {
  AssetBuilder builder;
  FenceMaker(builder, posts, random, detail).add();
  return creased(builder.take(), 0.8);
}

}  // namespace

std::vector<glm::dvec2> fence_posts(const AssetSpec& fence, std::span<const glm::dvec2> line_m) {
  if (line_m.size() < 2)
    throw Error("a fence needs a line of at least two points, but has {}", line_m.size());
  const double bay_m = fence.width_m.value_or(*asset_defaults(AssetKind::Fence).width_m);
  for (std::size_t i = 1; i + 1 < line_m.size(); ++i) {
    const glm::dvec2 before = line_m[i] - line_m[i - 1], after = line_m[i + 1] - line_m[i];
    if (glm::dot(before, after) < -0.99 * glm::length(before) * glm::length(after))
      throw Error("the fence's line turns back at point {}: make it two fences", i + 1);
  }
  std::vector<glm::dvec2> posts{line_m.front()};
  for (std::size_t i = 1; i < line_m.size(); ++i) {
    const double length_m = glm::distance(line_m[i - 1], line_m[i]);
    if (!(length_m > 0))
      throw Error("points {} and {} of the fence's line are equal: remove one", i, i + 1);
    const double bays = std::ceil(length_m / bay_m * (1 - 1e-12));
    if (!(static_cast<double>(posts.size()) + bays <= 10000))
      throw Error("the fence would have more than 10000 posts: make it several, or width_m larger");
    for (int k = 1; k <= static_cast<int>(bays); ++k)
      posts.push_back(k == static_cast<int>(bays) ? line_m[i]
                                                  : glm::mix(line_m[i - 1], line_m[i], k / bays));
  }
  return posts;
}

Model make_fence(const AssetSpec& fence, std::span<const glm::dvec3> posts_m) {
  check_asset(fence);
  return fence_of(posts_m, AssetRandom(fence.kind, fence.seed), fence.detail);
}

Model make_straight_fence(AssetShape shape) {
  const std::array<glm::dvec2, 2> ends = {{{-shape.size_m / 2, 0}, {shape.size_m / 2, 0}}};
  std::vector<glm::dvec3> posts;
  for (const glm::dvec2& p :
       fence_posts({.kind = AssetKind::Fence, .width_m = shape.width_m}, ends))
    posts.emplace_back(p, 0);
  return fence_of(posts, shape.random, shape.detail);
}

}  // namespace groundray
