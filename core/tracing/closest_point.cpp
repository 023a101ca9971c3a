#include "core/tracing/closest_point.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/geometry/mesh.h"
#include "core/tracing/device.h"
#include "core/tracing/embree_adapter.h"

namespace groundray {
namespace {

float float_below(double value) {
  return std::nextafter(static_cast<float>(value), -std::numeric_limits<float>::infinity());
}

float float_above(double value) {
  return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
}

bool is_before(const glm::dvec3& a, const glm::dvec3& b) noexcept {
  if (a.x != b.x) return a.x < b.x;
  return a.y != b.y ? a.y < b.y : a.z < b.z;
}

// Vector from the origin to the segment from a to b. The result does not depend on the order of the
// ends, so two triangles are equally distant if their common edge is the nearest part of both.
glm::dvec3 vector_to_segment(glm::dvec3 a, glm::dvec3 b) noexcept {
  if (is_before(b, a)) std::swap(a, b);
  const glm::dvec3 along = b - a;
  const double ahead = -glm::dot(a, along), square = glm::dot(along, along);
  if (!(ahead > 0)) return a;
  return ahead < square ? a + (ahead / square) * along : b;
}

glm::dvec3 nearer(const glm::dvec3& a, const glm::dvec3& b) noexcept {
  return glm::dot(b, b) < glm::dot(a, a) ? b : a;
}

}  // namespace

// Points in the triangle's plane are described by components along one edge (the base) and across
// it. The component along the base is first subtracted from both p and the apex. The remainders are
// accurate to an ulp of the lengths involved, and so is the result, even for needle-shaped
// triangles.
glm::dvec3 vector_to_triangle(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b,
                              const glm::dvec3& c) noexcept {
  const glm::dvec3 base = b - a, side = c - a, from = a - p;
  const double square = glm::dot(base, base);
  if (square > 0) {
    const double foot = glm::dot(side, base) / square;  // of the apex, projected to the base
    const glm::dvec3 across = side - foot * base;
    const double ahead = -glm::dot(from, base) / square;
    const double up = -glm::dot(from + ahead * base, across) / glm::dot(across, across);
    const double along = ahead - up * foot;
    if (up > 0 && along > 0 && up + along < 1) return from + along * base + up * side;
  }
  const glm::dvec3 to = b - p, apex = c - p;
  return nearer(nearer(vector_to_segment(from, to), vector_to_segment(to, apex)),
                vector_to_segment(apex, from));
}

struct ClosestPoint::Impl {
  Impl(TriangleMesh content, const RayDevice& with);

  glm::dvec3 vector_to(const glm::dvec3& p, std::uint32_t triangle) const noexcept {
    const glm::uvec3& corners = mesh.triangles[triangle];
    return vector_to_triangle(p, mesh.vertices_m[corners.x], mesh.vertices_m[corners.y],
                              mesh.vertices_m[corners.z]);
  }

  TriangleMesh mesh;
  RayDevice device;
  glm::dvec3 centre_m{0};  // origin of the scene's float coordinates
  double rounding_m = 0;   // bound of the rounding of distances in double
  Owned<RTCScene> scene;
};

namespace {

// Nearest triangle so far.
struct Search {
  const ClosestPoint::Impl* target = nullptr;
  glm::dvec3 p{0};
  glm::dvec3 vector{0};
  double square_m2 = 0;
  std::uint32_t triangle = 0;
  double slack_m = 0;  // bound of rounding: of the query point to float, and of distances in double

  bool take(std::uint32_t other) noexcept {
    const glm::dvec3 to_other = target->vector_to(p, other);
    const double square = glm::dot(to_other, to_other);
    if (!(square < square_m2 || (square == square_m2 && other < triangle))) return false;
    vector = to_other;
    square_m2 = square;
    triangle = other;
    return true;
  }

  // Embree compares, in float, the squares of this radius and of the distance to a box. Both have a
  // relative error of a few 2^-24; the last term keeps the squares out of the range of denormals.
  float radius_m() const noexcept {
    return float_above((std::sqrt(square_m2) + slack_m) * (1 + 1e-6) + 1e-15);
  }
};

bool visit(RTCPointQueryFunctionArguments* arguments) {
  auto& search = *static_cast<Search*>(arguments->userPtr);
  if (!search.take(arguments->primID)) return false;
  const float radius_m = search.radius_m();
  if (!(radius_m < arguments->query->radius)) return false;
  arguments->query->radius = radius_m;
  return true;
}

void bound_triangle(const RTCBoundsFunctionArguments* arguments) {
  const auto& target = *static_cast<const ClosestPoint::Impl*>(arguments->geometryUserPtr);
  const glm::uvec3& corners = target.mesh.triangles[arguments->primID];
  const glm::dvec3& a = target.mesh.vertices_m[corners.x];
  const glm::dvec3& b = target.mesh.vertices_m[corners.y];
  const glm::dvec3& c = target.mesh.vertices_m[corners.z];
  const glm::dvec3 low = glm::min(a, glm::min(b, c)) - target.centre_m;
  const glm::dvec3 high = glm::max(a, glm::max(b, c)) - target.centre_m;
  *arguments->bounds_o = {float_below(low.x),  float_below(low.y),  float_below(low.z),  0,
                          float_above(high.x), float_above(high.y), float_above(high.z), 0};
}

TriangleMesh checked_mesh(TriangleMesh mesh) {
  check_mesh(mesh, "mesh", EmptyMesh::Refuse);
  if (mesh.triangles.size() >= std::numeric_limits<std::uint32_t>::max())
    throw Error("mesh: it has {} triangles; there must be fewer than 2^32 - 1: split it",
                mesh.triangles.size());
  return mesh;
}

}  // namespace

ClosestPoint::Impl::Impl(TriangleMesh content, const RayDevice& with)
    : mesh(checked_mesh(std::move(content))), device(with), scene(new_scene(with)) {
  glm::dvec3 low = mesh.vertices_m[mesh.triangles[0].x], high = low;
  for (const glm::uvec3& corners : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      low = glm::min(low, mesh.vertices_m[corners[k]]);
      high = glm::max(high, mesh.vertices_m[corners[k]]);
    }
  }
  centre_m = 0.5 * (low + high);
  rounding_m = 1e-14 * glm::length(high - low);
  attach_primitives(device, scene.get(), 0, mesh.triangles.size(), this, bound_triangle, nullptr);
  commit(scene.get());
  check(device, "building a mesh for closest-point queries");
}

ClosestPoint::ClosestPoint(TriangleMesh mesh, const RayDevice& device)
    : impl_(std::make_shared<const Impl>(std::move(mesh), device)) {}

NearestPoint ClosestPoint::nearest(const glm::dvec3& p, std::uint32_t near) const noexcept {
  Search search{.target = impl_.get(), .p = p, .triangle = near};
  search.vector = impl_->vector_to(p, near);
  search.square_m2 = glm::dot(search.vector, search.vector);
  const glm::dvec3 p_L = p - impl_->centre_m;
  const double far_m = glm::length(p_L);
  constexpr double most_m = 1e16;  // squares of smaller lengths are finite in float
  if (far_m < most_m) {
    search.slack_m = far_m * 0x1p-23 + impl_->rounding_m;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    RTCPointQuery query{static_cast<float>(p_L.x), static_cast<float>(p_L.y),
                        static_cast<float>(p_L.z), 0, search.radius_m()};
    rtcPointQuery(impl_->scene.get(), &query, &context, visit, &search);
  } else {
    for (std::uint32_t i = 0; i < impl_->mesh.triangles.size(); ++i) search.take(i);
  }
  return {std::sqrt(search.square_m2), p + search.vector, search.triangle};
}

double ClosestPoint::distance_m(const glm::dvec3& p, std::uint32_t triangle) const noexcept {
  return glm::length(impl_->vector_to(p, triangle));
}

const TriangleMesh& ClosestPoint::mesh() const noexcept { return impl_->mesh; }

}  // namespace groundray
