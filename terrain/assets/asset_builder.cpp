#include "terrain/assets/asset_builder.h"

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "core/math.h"

namespace groundray {
namespace {

using std::numbers::pi;

struct NamedColor {
  std::string_view material;
  glm::vec3 color;
};

// Linear sRGB of the spectra in data/materials under illuminant D65, for the CIE 1931 observer. A
// spectrum that ends inside the visible range continues with its last value. The paints are
// neutral, with the densities 0.05 and 1.5 of the white and black patches of a ColorChecker.
// Retroreflective sheeting returns white light as white.
constexpr std::array<NamedColor, 12> colors = {{{"rock", {0.202f, 0.170f, 0.140f}},
                                                {"gravel", {0.240f, 0.196f, 0.151f}},
                                                {"dry_grass", {0.134f, 0.073f, 0.027f}},
                                                {"bark", {0.189f, 0.134f, 0.089f}},
                                                {"wood", {0.137f, 0.109f, 0.087f}},
                                                {"leaf", {0.141f, 0.164f, 0.076f}},
                                                {"broad_leaf", {0.065f, 0.127f, 0.033f}},
                                                {"metal", {0.168f, 0.184f, 0.143f}},
                                                {"asphalt", {0.057f, 0.049f, 0.041f}},
                                                {"retro_reflector", {1, 1, 1}},
                                                {"white_paint", {0.891f, 0.891f, 0.891f}},
                                                {"black_paint", {0.032f, 0.032f, 0.032f}}}};

// Returns a unit vector perpendicular to `v`, which must not be 0.
glm::dvec3 any_normal_to(const glm::dvec3& v) {
  const glm::dvec3 axis =
      std::abs(v.z) < 0.7 * glm::length(v) ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
  return glm::normalize(glm::cross(axis, v));
}

// Direction of the tube's centre line at a ring.
glm::dvec3 tangent(std::span<const TubeRing> rings, std::size_t i) {
  const std::size_t before = i == 0 ? 0 : i - 1;
  const std::size_t after = i + 1 == rings.size() ? i : i + 1;
  return glm::normalize(rings[after].p - rings[before].p);
}

double cross_2d(const glm::dvec2& a, const glm::dvec2& b) { return a.x * b.y - a.y * b.x; }

// Triangulates a simple, counter-clockwise polygon by ear clipping.
std::vector<std::array<std::size_t, 3>> ears_of(const std::vector<glm::dvec2>& polygon) {
  std::vector<std::array<std::size_t, 3>> ears;
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < polygon.size(); ++i) left.push_back(i);
  const auto is_ear = [&](std::size_t a, std::size_t b, std::size_t c) {
    const glm::dvec2 pa = polygon[a], pb = polygon[b], pc = polygon[c];
    if (cross_2d(pb - pa, pc - pa) <= 0) return false;
    for (const std::size_t i : left) {
      if (i == a || i == b || i == c) continue;
      const glm::dvec2 p = polygon[i];
      if (cross_2d(pb - pa, p - pa) >= 0 && cross_2d(pc - pb, p - pb) >= 0 &&
          cross_2d(pa - pc, p - pc) >= 0) {
        return false;
      }
    }
    return true;
  };
  for (std::size_t i = 0, tries = 0; left.size() > 3 && tries < left.size(); ++tries) {
    const std::size_t n = left.size();
    const std::array<std::size_t, 3> ear{left[(i + n - 1) % n], left[i % n], left[(i + 1) % n]};
    if (is_ear(ear[0], ear[1], ear[2])) {
      ears.push_back(ear);
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(i % n));
      tries = 0;
    } else {
      ++i;
    }
  }
  assert(left.size() == 3);
  ears.push_back({left[0], left[1], left[2]});
  return ears;
}

}  // namespace

ModelSurface asset_surface(std::string_view material) {
  for (const NamedColor& color : colors) {
    if (color.material != material) continue;
    ModelSurface surface;
    surface.name = material;
    surface.color = color.color;
    return surface;
  }
  assert(false);
  return {};
}

std::uint16_t AssetBuilder::add_surface(ModelSurface surface) {
  model_.surfaces.push_back(std::move(surface));
  return static_cast<std::uint16_t>(model_.surfaces.size() - 1);
}

std::uint16_t AssetBuilder::surface(std::string_view name, const glm::vec3& color) {
  for (std::size_t i = 0; i < model_.surfaces.size(); ++i) {
    if (model_.surfaces[i].name == name) return static_cast<std::uint16_t>(i);
  }
  ModelSurface surface;
  surface.name = name;
  surface.color = color;
  return add_surface(std::move(surface));
}

std::uint32_t AssetBuilder::add_vertex(const glm::dvec3& p) {
  assert(model_.normals.empty());
  model_.mesh.vertices_m.push_back(p);
  return static_cast<std::uint32_t>(model_.mesh.vertices_m.size() - 1);
}

std::uint32_t AssetBuilder::add_vertex(const glm::dvec3& p, const glm::dvec3& normal,
                                       const glm::dvec2& uv) {
  assert(model_.normals.size() == model_.mesh.vertices_m.size());
  model_.mesh.vertices_m.push_back(p);
  model_.normals.emplace_back(normal);
  model_.uv.emplace_back(uv);
  return static_cast<std::uint32_t>(model_.mesh.vertices_m.size() - 1);
}

void AssetBuilder::add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                std::uint16_t surface) {
  model_.mesh.triangles.emplace_back(a, b, c);
  model_.surface_of.push_back(surface);
}

void AssetBuilder::add_tube(std::span<const TubeRing> rings, int sides, std::uint16_t surface) {
  const double widening = pi / (sides * math::sin(pi / sides));
  const bool is_pointed = rings.back().radius == 0;
  const std::size_t ring_count = rings.size() - (is_pointed ? 1 : 0);
  const auto k = static_cast<std::uint32_t>(sides);
  double length = 0;
  for (std::size_t i = 1; i < rings.size(); ++i)
    length += glm::distance(rings[i].p, rings[i - 1].p);
  const auto first = static_cast<std::uint32_t>(model_.mesh.vertices_m.size());
  glm::dvec3 side = any_normal_to(tangent(rings, 0));
  double v = 0;
  for (std::size_t i = 0; i < ring_count; ++i) {
    const glm::dvec3 along = tangent(rings, i);
    // Parallel transport: the cross-section turns no more than the centre line does.
    side = glm::normalize(side - along * glm::dot(side, along));
    const glm::dvec3 up = glm::cross(along, side);
    if (i > 0) v += glm::distance(rings[i].p, rings[i - 1].p) / length;
    for (int s = 0; s < sides; ++s) {
      const double angle = 2 * pi * s / sides;
      const glm::dvec3 out = side * math::cos(angle) + up * math::sin(angle);
      // u runs from 1 to 0 and back around the tube, so that the image has no seam and vertices are
      // shared.
      const double u = std::abs(2.0 * s / sides - 1);
      add_vertex(rings[i].p + out * (rings[i].radius * widening), out, {u, std::min(v, 1.0)});
    }
  }
  for (std::uint32_t s = 2; s < k; ++s) add_triangle(first, first + s, first + s - 1, surface);
  for (std::uint32_t i = 0; i + 1 < ring_count; ++i) {
    for (std::uint32_t s = 0; s < k; ++s) {
      const std::uint32_t a = first + i * k + s, b = first + i * k + (s + 1) % k;
      add_triangle(a, b, b + k, surface);
      add_triangle(a, b + k, a + k, surface);
    }
  }
  const std::uint32_t last = first + static_cast<std::uint32_t>(ring_count - 1) * k;
  if (!is_pointed) {
    for (std::uint32_t s = 2; s < k; ++s) add_triangle(last, last + s - 1, last + s, surface);
    return;
  }
  const std::uint32_t tip = add_vertex(rings.back().p, tangent(rings, ring_count), {0.5, 1});
  for (std::uint32_t s = 0; s < k; ++s) add_triangle(last + s, last + (s + 1) % k, tip, surface);
}

void AssetBuilder::add_cylinder(const glm::dvec3& foot, double height, double radius, int sides,
                                std::uint16_t surface) {
  const auto k = static_cast<std::uint32_t>(sides);
  const auto first = static_cast<std::uint32_t>(model_.mesh.vertices_m.size());
  for (int s = 0; s < sides; ++s) {
    const double angle = 2 * pi * s / sides;
    const glm::dvec3 out{math::cos(angle), math::sin(angle), 0};
    const glm::dvec3 low = foot + radius * out, high = low + glm::dvec3(0, 0, height);
    const double u = std::abs(2.0 * s / sides - 1);
    const glm::dvec2 uv = (glm::dvec2(out) + 1.0) / 2.0;
    add_vertex(low, out, {u, 0});
    add_vertex(high, out, {u, 1});
    add_vertex(low, {0, 0, -1}, uv);
    add_vertex(high, {0, 0, 1}, uv);
  }
  for (std::uint32_t s = 0; s < k; ++s) {
    const std::uint32_t a = first + 4 * s, b = first + 4 * ((s + 1) % k);
    add_triangle(a, b, b + 1, surface);
    add_triangle(a, b + 1, a + 1, surface);
    if (s == 0 || s + 1 == k) continue;
    add_triangle(first + 2, b + 2, a + 2, surface);
    add_triangle(first + 3, a + 3, b + 3, surface);
  }
}

void AssetBuilder::add_loft(std::span<const glm::dvec3> low, std::span<const glm::dvec3> high,
                            std::uint16_t surface) {
  glm::dvec3 normal(0);  // normal of the low polygon, by Newell's method
  const std::size_t n = low.size();
  for (std::size_t i = 0; i < n; ++i)
    normal += glm::cross(low[i] - low[0], low[(i + 1) % n] - low[0]);
  const glm::dvec3 x = any_normal_to(normal), y = glm::cross(glm::normalize(normal), x);
  std::vector<glm::dvec2> flat;
  const auto first = static_cast<std::uint32_t>(model_.mesh.vertices_m.size());
  const auto k = static_cast<std::uint32_t>(n);
  for (const glm::dvec3& p : low) {
    flat.emplace_back(glm::dot(p - low[0], x), glm::dot(p - low[0], y));
    add_vertex(p);
  }
  for (const glm::dvec3& p : high) add_vertex(p);
  for (const auto& ear : ears_of(flat)) {
    const auto a = first + static_cast<std::uint32_t>(ear[0]);
    const auto b = first + static_cast<std::uint32_t>(ear[1]);
    const auto c = first + static_cast<std::uint32_t>(ear[2]);
    add_triangle(a, c, b, surface);
    add_triangle(a + k, b + k, c + k, surface);
  }
  for (std::uint32_t i = 0; i < k; ++i) {
    const std::uint32_t a = first + i, b = first + (i + 1) % k;
    add_triangle(a, b, b + k, surface);
    add_triangle(a, b + k, a + k, surface);
  }
}

void AssetBuilder::append(const Model& part, const Pose& pose) {
  const auto first = static_cast<std::uint32_t>(model_.mesh.vertices_m.size());
  for (const glm::dvec3& p : part.mesh.vertices_m) model_.mesh.vertices_m.push_back(pose * p);
  for (const glm::vec3& normal : part.normals)
    model_.normals.emplace_back(pose.rotation * glm::dvec3(normal));
  for (std::size_t i = 0; i < part.mesh.triangles.size(); ++i) {
    const ModelSurface& worn = part.surfaces[part.surface_of[i]];
    const glm::uvec3 corners = part.mesh.triangles[i] + first;
    add_triangle(corners.x, corners.y, corners.z, surface(worn.name, worn.color));
  }
}

void AssetBuilder::scale(double factor) {
  for (glm::dvec3& p : model_.mesh.vertices_m) p *= factor;
}

void AssetBuilder::smooth() {
  const auto& p = model_.mesh.vertices_m;
  std::vector<glm::dvec3> sums(p.size(), glm::dvec3(0));
  for (const glm::uvec3& t : model_.mesh.triangles) {
    const glm::dvec3 normal = glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]);
    for (int i = 0; i < 3; ++i) sums[t[i]] += normal;
  }
  model_.normals.clear();
  for (const glm::dvec3& sum : sums) model_.normals.emplace_back(glm::normalize(sum));
}

}  // namespace groundray
