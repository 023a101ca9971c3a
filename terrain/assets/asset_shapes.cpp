#include "terrain/assets/asset_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>
#include <tuple>
#include <utility>

#include "core/math.h"

namespace groundray {
namespace {

using std::numbers::pi;

// Joins two rings of vertices, the second farther along; `a` and `b` are their first vertices.
void join(AssetBuilder& builder, std::uint32_t a, std::uint32_t b, std::uint32_t count,
          std::uint16_t surface) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    builder.add_triangle(a + i, a + next, b + next, surface);
    builder.add_triangle(a + i, b + next, b + i, surface);
  }
}

glm::dvec3 middle_of(const Section& section) {
  glm::dvec3 sum(0);
  for (const glm::dvec3& p : section) sum += p;
  return sum / static_cast<double>(section.size());
}

}  // namespace

void add_sweep(AssetBuilder& builder, std::span<const Section> sections, std::uint16_t surface) {
  const auto count = static_cast<std::uint32_t>(sections.front().size());
  const std::uint32_t foot = builder.add_vertex(middle_of(sections.front()));
  const std::uint32_t first = foot + 1;
  for (const Section& section : sections) {
    for (const glm::dvec3& p : section) builder.add_vertex(p);
  }
  const auto steps = static_cast<std::uint32_t>(sections.size() - 1);
  const std::uint32_t last = first + steps * count;
  const std::uint32_t head = builder.add_vertex(middle_of(sections.back()));
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    builder.add_triangle(foot, first + next, first + i, surface);
    builder.add_triangle(head, last + i, last + next, surface);
  }
  for (std::uint32_t s = 0; s < steps; ++s)
    join(builder, first + s * count, first + (s + 1) * count, count, surface);
}

Section round_rectangle(double x, const glm::dvec2& low_yz, const glm::dvec2& high_yz,
                        double radius) {
  constexpr std::array<glm::dvec2, 4> corners = {{{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};
  const glm::dvec2 centre = (low_yz + high_yz) / 2.0, inner = (high_yz - low_yz) / 2.0 - radius;
  Section section;
  for (int c = 0; c < 4; ++c) {
    for (int i = 0; i < 4; ++i) {
      const double angle = (c + i / 3.0) * pi / 2;
      const glm::dvec2 p = centre + corners[static_cast<std::size_t>(c)] * inner +
                           radius * glm::dvec2(math::cos(angle), math::sin(angle));
      section.emplace_back(x, p.x, p.y);
    }
  }
  return section;
}

void add_block(AssetBuilder& builder, const glm::dvec3& low, const glm::dvec3& high, double radius,
               std::uint16_t surface) {
  std::vector<Section> sections;
  constexpr int steps = 3;
  const glm::dvec2 low_yz(low.y, low.z), high_yz(high.y, high.z);
  for (int i = 0; i <= steps; ++i) {
    const double angle = pi / 2 * i / steps, inset = 0.85 * radius * (1 - math::sin(angle));
    sections.push_back(round_rectangle(low.x + radius * (1 - math::cos(angle)), low_yz + inset,
                                       high_yz - inset, radius - inset));
  }
  for (int i = steps; i >= 0; --i) {
    const double angle = pi / 2 * i / steps, inset = 0.85 * radius * (1 - math::sin(angle));
    sections.push_back(round_rectangle(high.x - radius * (1 - math::cos(angle)), low_yz + inset,
                                       high_yz - inset, radius - inset));
  }
  add_sweep(builder, sections, surface);
}

void add_pipe(AssetBuilder& builder, std::span<const TubeRing> rings, int sides,
              std::uint16_t surface) {
  std::vector<Section> sections;
  glm::dvec3 side(0.36, 0.48, 0.8);  // parallel to no axis
  for (std::size_t i = 0; i < rings.size(); ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, rings.size() - 1);
    const glm::dvec3 along = glm::normalize(rings[after].p - rings[before].p);
    side = glm::normalize(side - along * glm::dot(side, along));
    const glm::dvec3 up = glm::cross(along, side);
    Section& section = sections.emplace_back();
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * pi * k / sides;
      section.push_back(rings[i].p +
                        rings[i].radius * (side * math::cos(angle) + up * math::sin(angle)));
    }
  }
  add_sweep(builder, sections, surface);
}

void add_lathe(AssetBuilder& builder, const glm::dvec3& centre, int axis,
               std::span<const LatheRing> profile, int sides) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  // About y, u is z and v is x; the first corner is then at the lowest point.
  const double from = axis == 2 ? 0 : axis == 1 ? pi : -pi / 2;
  const auto at = [&](const LatheRing& ring, int side) {
    const double angle = from + 2 * pi * side / sides;
    glm::dvec3 p = centre;
    p[axis] += ring.along;
    p[u] += ring.radius * math::cos(angle);
    p[v] += ring.radius * math::sin(angle);
    return p;
  };
  const auto count = static_cast<std::uint32_t>(sides);
  const std::uint32_t foot = builder.add_vertex(at(profile.front(), 0));
  for (const LatheRing& ring : profile.subspan(1, profile.size() - 2)) {
    for (int side = 0; side < sides; ++side) builder.add_vertex(at(ring, side));
  }
  const std::uint32_t head = builder.add_vertex(at(profile.back(), 0));
  const std::uint32_t last = head - count;
  const std::uint16_t top = profile[profile.size() - 2].surface;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    builder.add_triangle(foot, foot + 1 + next, foot + 1 + i, profile.front().surface);
    builder.add_triangle(head, last + i, last + next, top);
  }
  for (std::size_t r = 1; r + 2 < profile.size(); ++r) {
    const std::uint32_t ring = foot + 1 + static_cast<std::uint32_t>(r - 1) * count;
    join(builder, ring, ring + count, count, profile[r].surface);
  }
}

Model creased(Model model, double most_rad) {
  const auto& old = model.mesh.vertices_m;
  auto& triangles = model.mesh.triangles;
  std::vector<glm::dvec3> normals;
  std::vector<std::vector<std::size_t>> around(old.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const glm::uvec3& t = triangles[i];
    normals.push_back(glm::cross(old[t.y] - old[t.x], old[t.z] - old[t.x]));
    for (int k = 0; k < 3; ++k) around[t[k]].push_back(i);
  }
  const double least = math::cos(most_rad);
  std::vector<glm::dvec3> vertices;
  std::vector<glm::vec3> of_vertex;
  std::map<std::tuple<std::uint32_t, double, double, double>, std::uint32_t> numbers;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      std::uint32_t& corner = triangles[i][k];
      glm::dvec3 sum(0);
      for (const std::size_t other : around[corner]) {
        const double both = glm::length(normals[i]) * glm::length(normals[other]);
        if (other == i || glm::dot(normals[i], normals[other]) > least * both)
          sum += normals[other];
      }
      sum = glm::normalize(sum);
      const auto [it, is_new] = numbers.try_emplace({corner, sum.x, sum.y, sum.z}, vertices.size());
      if (is_new) {
        vertices.push_back(old[corner]);
        of_vertex.emplace_back(sum);
      }
      corner = it->second;
    }
  }
  model.mesh.vertices_m = std::move(vertices);
  model.normals = std::move(of_vertex);
  return model;
}

Model stood(AssetBuilder& builder, double length_m) {
  const ModelBounds bounds = bounds_of(builder.model().mesh);
  const double factor = length_m / (bounds.high_m.x - bounds.low_m.x);
  Model model = builder.take();
  for (glm::dvec3& p : model.mesh.vertices_m) {
    p.z -= bounds.low_m.z;
    p *= factor;
  }
  return creased(std::move(model), 40 * pi / 180);
}

}  // namespace groundray
