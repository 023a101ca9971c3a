// Rocks, stones and spheres: icospheres whose vertices are moved along their radii. For any radius
// function, triangles therefore intersect only at shared edges, and all face outward.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/fracture.h"

namespace groundray {
namespace {

using std::numbers::pi;

constexpr std::array<glm::uvec3, 20> icosahedron = {
    {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
     {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
     {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};

std::array<glm::dvec3, 12> icosahedron_corners() {
  const double g = std::numbers::phi;
  return {{{-1, g, 0},
           {1, g, 0},
           {-1, -g, 0},
           {1, -g, 0},
           {0, -1, g},
           {0, 1, g},
           {0, -1, -g},
           {0, 1, -g},
           {g, 0, -1},
           {g, 0, 1},
           {-g, 0, -1},
           {-g, 0, 1}}};
}

struct Icosphere {
  std::vector<glm::dvec3> directions;
  std::vector<glm::uvec3> triangles;
};

// Icosahedron with each edge divided into n: 20 n^2 triangles. A vertex is identified by its
// weights at the icosahedron's corners, so that adjacent faces share it exactly.
class IcosphereMaker {
 public:
  explicit IcosphereMaker(int n) : n_(n) {
    for (const glm::uvec3& face : icosahedron) add_face(face);
  }
  Icosphere take() { return std::move(sphere_); }

 private:
  using Weights = std::vector<std::pair<unsigned, int>>;  // by corner; zero weights are omitted

  void add_face(const glm::uvec3& face) {
    const auto at = [&](int i, int j) { return vertex(face, {n_ - i - j, i, j}); };
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; i + j < n_; ++j) {
        sphere_.triangles.emplace_back(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 2 > n_) continue;
        sphere_.triangles.emplace_back(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
    }
  }

  unsigned vertex(const glm::uvec3& face, const std::array<int, 3>& weights) {
    Weights key;
    for (int i = 0; i < 3; ++i) {
      const int weight = weights[static_cast<std::size_t>(i)];
      if (weight > 0) key.emplace_back(face[i], weight);
    }
    std::ranges::sort(key);
    const auto [it, is_new] = numbers_.try_emplace(key, sphere_.directions.size());
    if (is_new) {
      glm::dvec3 sum(0);
      for (const auto& [corner, weight] : key) sum += corners_[corner] * double(weight);
      sphere_.directions.push_back(glm::normalize(sum));
    }
    return static_cast<unsigned>(it->second);
  }

  int n_;
  std::array<glm::dvec3, 12> corners_ = icosahedron_corners();
  std::map<Weights, std::size_t> numbers_;
  Icosphere sphere_;
};

// Parameters of the shape of a rock or stone.
struct RockShape {
  std::string_view material;
  double frequency;  // divisions of an edge of the icosahedron at detail 1
  double sharpness;  // of the edges between the rock's faces: exponent of a norm
  double roughness;  // amplitude of the longest waves on the unit sphere
};

// Radius as a function of direction: faces at random distances, combined by a norm, and waves on
// them that are no shorter than three edges of the mesh.
class RockRadius {
 public:
  RockRadius(const RockShape& shape, int n, AssetRandom& random) : shape_(shape) {
    constexpr int face_count = 22;
    for (int i = 0; i < face_count; ++i) {
      // Sunflower arrangement (golden angle) on the sphere, so that faces cover all sides.
      const double z = 1 - (2 * i + 1.0) / face_count, angle = i * pi * (3 - std::sqrt(5.0));
      const glm::dvec3 even{std::sqrt(1 - z * z) * math::cos(angle),
                            std::sqrt(1 - z * z) * math::sin(angle), z};
      const glm::dvec3 normal = glm::normalize(even + 0.28 * random.direction());
      faces_.push_back(normal / random.between(0.78, 1.04));
    }
    // Wave number of the longest waves, and ratio of successive wave numbers.
    constexpr double longest = 3, ratio = 1.25;
    const double edge = math::acos(1 / std::sqrt(5.0)) / n;
    const double shortest = 2 * pi / (3 * edge);
    for (double number = longest; number < shortest; number *= ratio) {
      for (int i = 0; i < 2; ++i) {
        const double amplitude = shape.roughness * math::pow(number / longest, -1.5);
        waves_.push_back({random.direction() * number, random.angle_rad(), amplitude});
      }
    }
  }

  double operator()(const glm::dvec3& direction) const {
    double sum = 0;
    for (const glm::dvec3& face : faces_) {
      sum += math::pow(std::max(0.0, glm::dot(face, direction)), shape_.sharpness);
    }
    double noise = 0;
    for (const Wave& wave : waves_) {
      noise += wave.amplitude * math::sin(glm::dot(wave.vector, direction) + wave.phase);
    }
    return math::pow(sum, -1 / shape_.sharpness) * math::exp(noise);
  }

 private:
  struct Wave {
    glm::dvec3 vector;
    double phase;
    double amplitude;
  };
  RockShape shape_;
  std::vector<glm::dvec3> faces_;  // normal divided by distance
  std::vector<Wave> waves_;
};

int cuts(double at_usual, double detail) {
  return std::max(2, static_cast<int>(std::lround(at_usual * std::sqrt(detail))));
}

// Returns a model of moved vertices, scaled to a largest extent, with a share of its height below
// the ground.
Model finished(const Icosphere& moved, std::string_view material, double size_m, double buried) {
  AssetBuilder builder;
  const std::uint16_t surface = builder.add_surface(asset_surface(material));
  glm::dvec3 low(1e9), high(-1e9);
  for (const glm::dvec3& p : moved.directions) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::dvec3 extent = high - low;
  const double scale = size_m / std::max({extent.x, extent.y, extent.z});
  const glm::dvec3 origin{(low.x + high.x) / 2, (low.y + high.y) / 2, low.z + buried * extent.z};
  for (const glm::dvec3& p : moved.directions) builder.add_vertex((p - origin) * scale);
  for (const glm::uvec3& t : moved.triangles) builder.add_triangle(t.x, t.y, t.z, surface);
  builder.smooth();
  return builder.take();
}

Model fragment(const RockShape& rock, AssetShape shape) {
  const int n = cuts(rock.frequency, shape.detail);
  Icosphere sphere = IcosphereMaker(n).take();
  // Rock fragments have axes of 2 : sqrt 2 : 1 on average (Michikami et al., Icarus 264 (2016)
  // 316).
  const glm::dvec3 axes{1, std::numbers::sqrt2 / 2 * shape.random.between(0.85, 1.15),
                        0.5 * shape.random.between(0.8, 1.2)};
  const RockRadius radius(rock, n, shape.random);
  for (glm::dvec3& p : sphere.directions) p *= axes * radius(p);
  return finished(sphere, rock.material, shape.size_m, 0.2);
}

// Radii of a weathered block of a jointed rock mass: a convex block whose edges are rounded, and
// waves on it that are no shorter than three edges of the mesh.
class BlockRadius {
 public:
  BlockRadius(double edge_angle, AssetRandom& random) {
    // Bedding and two sets of joints, the latter nearly at right angles to each other and to it.
    const auto tilted = [&](const glm::dvec3& normal) {
      return glm::normalize(normal + 0.16 * random.direction());
    };
    const JointSet bedding{tilted({0, 0, 1}), 0.62}, first{tilted({1, 0, 0}), 1};
    const JointSet second{tilted({0, 1, 0}), 0.8};
    planes_ =
        rock_block({.sets = {bedding, first, second}, .scatter_rad = 0.05, .chips = 14}, random);
    const std::vector<glm::dvec3> corners = corners_of(planes_);
    for (const glm::dvec3& p : corners) reach_ = glm::max(reach_, glm::abs(p));
    edge_ = boulder_edge * 2 * std::max({reach_.x, reach_.y, reach_.z});
    constexpr double longest = 5, ratio = 1.3;
    const double shortest = 2 * pi / (3 * edge_angle);
    for (double number = longest; number < shortest; number *= ratio) {
      for (int i = 0; i < 3; ++i) {
        const glm::dvec3 direction = random.direction();
        const double phase = random.angle_rad();
        waves_.push_back({direction * number, phase, math::pow(number / longest, -0.85)});
      }
    }
    double square = 0;
    for (const Wave& wave : waves_) square += wave.amplitude * wave.amplitude / 2;
    for (Wave& wave : waves_) wave.amplitude *= boulder_relief / std::sqrt(square);
  }

  // Half-extents of the block.
  const glm::dvec3& reach() const { return reach_; }

  double operator()(const glm::dvec3& direction) const {
    double low = 0, high = 2 * glm::length(reach_);
    for (int i = 0; i < 48; ++i) {
      const double middle = (low + high) / 2;
      (rounded_level(planes_, edge_, direction * middle) < 0 ? low : high) = middle;
    }
    double noise = 0;
    for (const Wave& wave : waves_)
      noise += wave.amplitude * math::sin(glm::dot(wave.vector, direction) + wave.phase);
    return high * math::exp(noise);
  }

 private:
  struct Wave {
    glm::dvec3 vector;
    double phase;
    double amplitude;
  };
  std::vector<RockPlane> planes_;
  std::vector<Wave> waves_;
  glm::dvec3 reach_{0};
  double edge_ = 0;
};

}  // namespace

Model make_rock(AssetShape shape) { return fragment({"rock", 8, 22, 0.03}, shape); }

Model make_stone(AssetShape shape) { return fragment({"gravel", 4, 6, 0.02}, shape); }

Model make_boulder(AssetShape shape) {
  const int n = cuts(20, shape.detail);
  const BlockRadius radius(math::acos(1 / std::sqrt(5.0)) / n, shape.random);
  Icosphere sphere = IcosphereMaker(n).take();
  for (glm::dvec3& p : sphere.directions) {
    // Directions are spread as the block is, so that its far ends get as many vertices.
    p = glm::normalize(p * radius.reach());
    p *= radius(p);
  }
  // It lies on its bedding, turned at random, an eighth of its height below the ground.
  const double yaw = shape.random.angle_rad();
  const double c = math::cos(yaw), s = math::sin(yaw);
  for (glm::dvec3& p : sphere.directions) p = {c * p.x - s * p.y, s * p.x + c * p.y, p.z};
  return finished(sphere, "rock", shape.size_m, 0.125);
}

Model make_sphere_target(AssetShape shape) {
  const Icosphere sphere = IcosphereMaker(cuts(16, shape.detail)).take();
  AssetBuilder builder;
  const std::uint16_t surface = builder.add_surface(asset_surface("metal"));
  for (const glm::dvec3& direction : sphere.directions) {
    builder.add_vertex((direction + glm::dvec3(0, 0, 1)) * (shape.size_m / 2));
  }
  for (const glm::uvec3& t : sphere.triangles) builder.add_triangle(t.x, t.y, t.z, surface);
  builder.smooth();
  return builder.take();
}

}  // namespace groundray
