#include "reconstruction/mesh/merge/cover_surface.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "reconstruction/mesh/surface_mesh.h"

namespace groundray {
namespace {

// Patches of about four rings of triangles: noise turns their normals a quarter as far as those of
// single triangles.
constexpr int normal_smoothing_rounds = 3;

// Distance beyond the boundary, relative to a triangle's size, up to which a position is on the
// surface.
constexpr double rim_share = 0.1;

// Upper bound, due to rounding, of the opposite corner's coordinate for a point on an edge.
constexpr double edge_share = 1e-9;

glm::dvec3 area_vector(const TriangleMesh& mesh, std::size_t triangle) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::dvec3& a = mesh.vertices_m[t.x];
  return 0.5 * glm::cross(mesh.vertices_m[t.y] - a, mesh.vertices_m[t.z] - a);
}

glm::vec3 unit(const glm::dvec3& v) {
  const double length = glm::length(v);
  return length > 0 ? glm::vec3(v / length) : glm::vec3(0);
}

}  // namespace

std::vector<glm::vec3> smooth_normals(const TriangleMesh& mesh) {
  std::vector<glm::dvec3> faces(mesh.triangles.size()), vertices(mesh.vertices_m.size());
  for (std::size_t i = 0; i < faces.size(); ++i) faces[i] = area_vector(mesh, i);
  for (int round = 0; round < normal_smoothing_rounds; ++round) {
    std::ranges::fill(vertices, glm::dvec3(0));
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (int k = 0; k < 3; ++k) vertices[mesh.triangles[i][k]] += faces[i];
    }
    if (round + 1 == normal_smoothing_rounds) break;
    for (std::size_t i = 0; i < faces.size(); ++i) {
      const glm::uvec3& t = mesh.triangles[i];
      faces[i] = (vertices[t.x] + vertices[t.y] + vertices[t.z]) / 9.0;
    }
  }
  std::vector<glm::vec3> normals(vertices.size());
  std::ranges::transform(vertices, normals.begin(), unit);
  return normals;
}

glm::dvec3 shares_of_corners(const TriangleMesh& mesh, std::uint32_t triangle,
                             const glm::dvec3& p) {
  const glm::uvec3& t = mesh.triangles[triangle];
  const glm::dvec3& a = mesh.vertices_m[t.x];
  const glm::dvec3 ab = mesh.vertices_m[t.y] - a, ac = mesh.vertices_m[t.z] - a, ap = p - a;
  const glm::dvec3 normal = glm::cross(ab, ac);
  const double square = glm::dot(normal, normal);
  if (!(square > 0)) return {1, 0, 0};
  const double b = glm::dot(glm::cross(ap, ac), normal) / square;
  const double c = glm::dot(glm::cross(ab, ap), normal) / square;
  return {1 - b - c, b, c};
}

CoverSurface::CoverSurface(TriangleMesh mesh, std::vector<float> sd_m, const CoverTolerance& limits)
    : nearest_(std::move(mesh)),
      sd_m_(std::move(sd_m)),
      limits_(limits),
      borders_(this->mesh().triangles.size()),
      is_at_border_(this->mesh().vertices_m.size()),
      normals_(smooth_normals(this->mesh())) {
  const SurfaceMesh surface = to_surface(this->mesh());
  for (std::uint32_t i = 0; i < borders_.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      if (triangle_across(surface, half_edge_of(surface, i, k)) != none) continue;
      borders_[i] = static_cast<std::uint8_t>(borders_[i] | 1 << k);
      const glm::uvec3& t = this->mesh().triangles[i];
      is_at_border_[t[k]] = is_at_border_[t[(k + 1) % 3]] = 1;
    }
  }
}

double CoverSurface::area_m2(std::uint32_t triangle) const noexcept {
  return glm::length(area_vector(mesh(), triangle));
}

CoverAnswer CoverSurface::at(const MeasuredPlace& place, double slack_m,
                             std::uint32_t near) const noexcept {
  CoverAnswer answer{.nearest = nearest_.nearest(place.p, near)};
  const std::uint32_t triangle = answer.nearest.triangle;
  const glm::uvec3& t = mesh().triangles[triangle];
  const glm::dvec3 shares = shares_of_corners(mesh(), triangle, answer.nearest.point);
  const double sd = shares.x * sd_m(t.x) + shares.y * sd_m(t.y) + shares.z * sd_m(t.z) + place.sd_m;
  if (!(answer.nearest.distance_m <= limits_.noise_sds * sd + limits_.apart_m + slack_m))
    return answer;
  const glm::vec3 normal = normals_[t.x] + normals_[t.y] + normals_[t.z];
  const float length = glm::length(normal);
  if (!(length > 0 && glm::dot(normal, place.normal) >= limits_.least_cosine * length))
    return answer;
  const glm::dvec3 from = place.p - answer.nearest.point, up = glm::normalize(normal);
  const double beside_m = glm::length(from - glm::dot(from, up) * up);
  const bool is_beside = beside_m > rim_share * std::sqrt(2 * area_m2(triangle));
  answer.cover = is_beside && is_on_border(triangle, shares) ? Cover::Border : Cover::Inside;
  return answer;
}

bool CoverSurface::is_on_border(std::uint32_t triangle, const glm::dvec3& shares) const noexcept {
  const glm::uvec3& t = mesh().triangles[triangle];
  for (int k = 0; k < 3; ++k) {
    const bool is_on_edge = shares[(k + 2) % 3] < edge_share;
    if (is_on_edge && is_border(triangle, k)) return true;
    if (shares[k] > 1 - 2 * edge_share && is_at_border(t[k])) return true;
  }
  return false;
}

void for_blocks(std::size_t count, std::size_t in_block,
                const std::function<void(std::size_t begin, std::size_t end)>& visit) {
  tbb::parallel_for(std::size_t{0}, (count + in_block - 1) / in_block, [&](std::size_t block) {
    visit(block * in_block, std::min(count, (block + 1) * in_block));
  });
}

}  // namespace groundray
