#include "core/model/polygon_soup.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <span>
#include <unordered_map>

#include "core/image/srgb.h"

namespace groundray {
namespace {

using Corner = PolygonSoup::Corner;
using Polygon = PolygonSoup::Polygon;

bool is_finite(const glm::dvec3& p) {
  constexpr double most = std::numeric_limits<float>::max();  // rays are traced in float
  return std::abs(p.x) <= most && std::abs(p.y) <= most && std::abs(p.z) <= most;
}

/// Returns the triangle's normal with twice its area as length, or zero if rounding alone may have
/// produced it: the difference of two products a b is off by at most 4 ulp / 2 of a b, and the
/// threshold is eight times that.
glm::dvec3 area_of(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  constexpr double ulp = std::numeric_limits<double>::epsilon();
  const glm::dvec3 ab = b - a, ac = c - a;
  const glm::dvec3 area = glm::cross(ab, ac);
  const double least = 16 * ulp * glm::length(ab) * glm::length(ac);
  return glm::length(area) > least ? area : glm::dvec3(0);
}

bool has_area(std::span<const glm::dvec3> outline) {
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {
    if (area_of(outline[0], outline[i], outline[i + 1]) != glm::dvec3(0)) return true;
  }
  return false;
}

/// Triangulates a polygon by ear clipping.
/// @see Meisters, Polygons have ears (1975).
class EarCutter {
 public:
  using Triangle = std::array<std::size_t, 3>;

  /// @param most_tests  of a corner against an ear; 10^8 take about a second.
  EarCutter(std::span<const glm::dvec3> outline, std::size_t most_tests)
      : p_(outline), most_tests_(most_tests) {
    for (std::size_t i = 1; i + 1 < p_.size(); ++i) {
      normal_ += glm::cross(p_[i] - p_[0], p_[i + 1] - p_[0]);
    }
    for (std::size_t i = 0; i < p_.size(); ++i) {
      if (i == 0 || p_[i] != p_[i - 1]) rest_.push_back(i);
    }
    while (rest_.size() > 1 && p_[rest_.back()] == p_[rest_[0]]) rest_.pop_back();
    left_ = rest_.size();
    for (std::size_t i = 0; i < left_; ++i) {
      next_.push_back((i + 1) % left_);
      previous_.push_back((i + left_ - 1) % left_);
    }
  }

  /// Returns triangles as indices of corners, the first one at corner 1 if possible; nothing if no
  /// ear is left or the polygon is too complex. Only the last triangle may have no area.
  std::optional<std::vector<Triangle>> cut() {
    std::vector<Triangle> triangles;
    if (left_ < 3) return triangles;
    for (std::size_t i = 0; left_ > 3 && i < left_; ++i) {
      const auto [a, b, c] = ear_at(i);
      if (!(turn(a, b, c) > 0)) blunt_.push_back(b);
    }
    std::size_t first = 0;  // of those left
    for (std::size_t at = 1, tried = 0; left_ > 3; at = next_[at]) {
      const Triangle ear = ear_at(at);
      if (tests_ > most_tests_) return std::nullopt;
      if (is_ear(ear)) {
        triangles.push_back(ear);
        next_[previous_[at]] = next_[at];
        previous_[next_[at]] = previous_[at];
        if (at == first) first = next_[at];
        --left_;
        tried = 0;
      } else if (++tried == left_) {
        return std::nullopt;
      }
    }
    triangles.push_back(ear_at(next_[first]));
    return triangles;
  }

  std::size_t tests() const { return tests_; }

 private:
  Triangle ear_at(std::size_t i) const { return {rest_[previous_[i]], rest_[i], rest_[next_[i]]}; }

  /// Returns a positive number if a, b, c turn in the same sense as the polygon.
  double turn(std::size_t a, std::size_t b, std::size_t c) const {
    return glm::dot(area_of(p_[a], p_[b], p_[c]), normal_);
  }

  bool is_ear(const Triangle& ear) {
    const std::size_t a = ear[0], b = ear[1], c = ear[2];
    if (!(turn(a, b, c) > 0)) return false;
    // Only corners that are not convex are tested: convex ones stay convex and are never the only
    // ones inside an ear.
    tests_ += blunt_.size();
    return std::ranges::none_of(blunt_, [&](std::size_t q) {
      if (p_[q] == p_[a] || p_[q] == p_[b] || p_[q] == p_[c]) return false;
      return turn(a, b, q) >= 0 && turn(b, c, q) >= 0 && turn(c, a, q) >= 0;
    });
  }

  std::span<const glm::dvec3> p_;
  glm::dvec3 normal_{0};
  std::size_t most_tests_;
  std::vector<std::size_t> rest_;             // corners, without repetitions
  std::vector<std::size_t> next_, previous_;  // of each of them, among those left
  std::size_t left_ = 0;
  std::vector<std::size_t> blunt_;  // corners that are not convex
  std::size_t tests_ = 0;
};

/// Merges equal corners into vertices of a model.
class VertexJoiner {
 public:
  VertexJoiner(const PolygonSoup& soup, Model& model) : soup_(soup), model_(model) {
    for (const Corner& corner : soup.corners) {
      has_uv_ = has_uv_ || corner.uv != PolygonSoup::none;
      has_normals_ = has_normals_ || corner.normal != PolygonSoup::none;
    }
  }

  /// Returns the vertex of a corner, and adds it to the model if it is new.
  /// @param flat  normal of the facet, used if the corner's is missing or has no direction.
  std::uint32_t join(const Corner& corner, const glm::vec3& flat) {
    const glm::dvec3 p = soup_.positions[corner.position] + 0.0;  // turns -0 into 0 for the key
    glm::vec2 uv(0);
    if (corner.uv != PolygonSoup::none) uv = soup_.uv[corner.uv] + 0.0f;
    glm::vec3 normal(0);
    if (has_normals_) {
      const glm::dvec3 said(corner.normal == PolygonSoup::none ? flat
                                                               : soup_.normals[corner.normal]);
      const double length = glm::length(said);
      normal = (length > 0 && std::isfinite(length) ? glm::vec3(said / length) : flat) + 0.0f;
    }
    Key key{};
    std::memcpy(key.data(), &p, sizeof p);
    std::memcpy(key.data() + 3, &uv, sizeof uv);
    std::memcpy(key.data() + 4, &normal, sizeof normal);
    const auto [found, is_new] =
        vertices_.try_emplace(key, static_cast<std::uint32_t>(vertices_.size()));
    if (is_new) {
      model_.mesh.vertices_m.push_back(p);
      if (has_uv_) model_.uv.push_back(uv);
      if (has_normals_) model_.normals.push_back(normal);
    }
    return found->second;
  }

 private:
  using Key = std::array<std::uint64_t, 6>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      for (const std::uint64_t word : key) {
        // Multiplier of Knuth's MMIX generator: odd and irregular.
        hash = (hash ^ (hash >> 32) ^ word) * 6364136223846793005u;
      }
      return hash ^ (hash >> 32);
    }
  };

  const PolygonSoup& soup_;
  Model& model_;
  bool has_uv_ = false, has_normals_ = false;
  std::unordered_map<Key, std::uint32_t, Hash> vertices_;
};

/// Returns whether the polygon can be triangulated; counts it if not.
bool is_sound(const PolygonSoup& soup, std::span<const Corner> corners, ModelFaults& faults) {
  const auto within = [](std::uint32_t index, std::size_t count) {
    return index == PolygonSoup::none || index < count;
  };
  for (const Corner& c : corners) {
    if (c.position >= soup.positions.size() || !within(c.uv, soup.uv.size()) ||
        !within(c.normal, soup.normals.size())) {
      ++faults.out_of_range;
      return false;
    }
  }
  for (const Corner& c : corners) {
    const glm::vec2 uv = c.uv == PolygonSoup::none ? glm::vec2(0) : soup.uv[c.uv];
    if (!is_finite(soup.positions[c.position]) || !std::isfinite(uv.x) || !std::isfinite(uv.y)) {
      ++faults.not_finite;
      return false;
    }
  }
  return true;
}

/// Triangle of a polygon.
struct Triangle {
  std::array<Corner, 3> corners;
  glm::dvec3 area;  // normal, with twice the area as length
};

/// Calls `take(polygon, triangle)` for each triangle of the valid polygons, and counts invalid
/// ones.
template <typename Take>
void for_each_triangle(const PolygonSoup& soup, ModelFaults& faults, const Take& take) {
  constexpr std::size_t most_tests = 100'000'000, tests_per_corner = 200;
  std::vector<glm::dvec3> outline;
  std::size_t tests_left = most_tests + tests_per_corner * soup.corners.size();
  for (const Polygon& polygon : soup.polygons) {
    const auto corners = std::span(soup.corners).subspan(polygon.first, polygon.count);
    if (!is_sound(soup, corners, faults)) continue;
    outline.clear();
    for (const Corner& corner : corners) outline.push_back(soup.positions[corner.position]);
    EarCutter cutter(outline, std::min(most_tests, tests_left));
    const auto triangles = cutter.cut();
    tests_left -= std::min(tests_left, cutter.tests());
    if (!triangles || triangles->empty()) {
      ++(has_area(outline) ? faults.entangled : faults.degenerate);
      continue;
    }
    for (const auto& [a, b, c] : *triangles) {
      const glm::dvec3 area = area_of(outline[a], outline[b], outline[c]);
      if (area == glm::dvec3(0)) {
        ++faults.degenerate;
      } else {
        take(polygon, Triangle{{corners[a], corners[b], corners[c]}, area});
      }
    }
  }
}

}  // namespace

glm::vec3 linear_color(const glm::dvec3& encoded) {
  glm::vec3 linear;
  for (int i = 0; i < 3; ++i) {
    const double value = encoded[i] > 0 ? std::min(encoded[i], 1.0) : 0;  // 0 also for NaN
    linear[i] = static_cast<float>(linear_of_srgb(value));
  }
  return linear;
}

Model model_of(const PolygonSoup& soup, ModelFaults& faults) {
  Model model;
  VertexJoiner joiner(soup, model);
  for_each_triangle(soup, faults, [&](const Polygon& polygon, const Triangle& t) {
    const glm::vec3 flat(glm::normalize(t.area));
    glm::uvec3 triangle;
    for (int k = 0; k < 3; ++k)
      triangle[k] = joiner.join(t.corners[static_cast<std::size_t>(k)], flat);
    model.mesh.triangles.push_back(triangle);
    model.surface_of.push_back(static_cast<std::uint16_t>(polygon.surface));
  });
  return model;
}

TriangleMesh stored_mesh_of(const PolygonSoup& soup, ModelFaults& faults) {
  TriangleMesh mesh{.vertices_m = soup.positions};
  for_each_triangle(soup, faults, [&](const Polygon&, const Triangle& t) {
    const auto& [a, b, c] = t.corners;
    mesh.triangles.emplace_back(a.position, b.position, c.position);
  });
  return mesh;
}

std::string why_empty(std::size_t dropped, std::size_t skipped) {
  if (dropped + skipped == 0) return ", as the file has no face: is it a mesh?";
  return fmt::format(
      "; {} broken polygons were dropped, and {} points, lines or curved patches skipped", dropped,
      skipped);
}

}  // namespace groundray
