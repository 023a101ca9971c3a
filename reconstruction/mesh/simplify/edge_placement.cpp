#include "reconstruction/mesh/simplify/edge_placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

namespace groundray {
namespace {

// Squared sine and cosine of one degree.
constexpr double least_sine2 = 3.0458649045213493e-4, most_cosine2 = 1 - least_sine2;

/// Symmetric quadratic form p * h * p + 2 * c * p.
struct Form {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  glm::dvec3 c{0};

  glm::dvec3 times(const glm::dvec3& p) const {
    return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z,
            xz * p.x + yz * p.y + zz * p.z};
  }
};

// Returns two directions perpendicular to another and to each other.
std::pair<glm::dvec3, glm::dvec3> across(const glm::dvec3& along) {
  const glm::dvec3 size = glm::abs(along);
  glm::dvec3 aside(1, 0, 0);
  if (size.y <= size.x && size.y <= size.z) aside = {0, 1, 0};
  if (size.z <= size.x && size.z < size.y) aside = {0, 0, 1};
  const glm::dvec3 one = glm::cross(along, aside);
  return {one, glm::cross(along, one)};
}

/// Up to three planes that contain the position, no two nearly parallel.
class Planes {
 public:
  std::size_t size() const { return count_; }

  /// Adds normal * p = offset if it is independent of the others.
  void add(const glm::dvec3& normal, double offset) {
    if (count_ == 3) return;
    const double square = glm::dot(normal, normal);
    if (!(square > 0) || !std::isfinite(square)) return;
    if (count_ == 1) {
      const double along = glm::dot(normals_[0], normal);
      if (!(along * along < most_cosine2 * glm::dot(normals_[0], normals_[0]) * square)) return;
    }
    if (count_ == 2) {
      const glm::dvec3 line = glm::cross(normals_[0], normals_[1]);
      const double apart = glm::dot(line, normal);
      if (!(apart * apart > least_sine2 * glm::dot(line, line) * square)) return;
    }
    normals_[count_] = normal;
    offsets_[count_++] = offset;
  }

  /// Adds the conditions that minimise a form within the planes so far.
  void add_least(const Form& form) {
    if (count_ == 0) {
      add({form.xx, form.xy, form.xz}, -form.c.x);
      add({form.xy, form.yy, form.yz}, -form.c.y);
      add({form.xz, form.yz, form.zz}, -form.c.z);
    } else if (count_ == 1) {
      const auto [one, other] = across(normals_[0]);
      add(form.times(one), -glm::dot(form.c, one));
      add(form.times(other), -glm::dot(form.c, other));
    } else if (count_ == 2) {
      const glm::dvec3 line = glm::cross(normals_[0], normals_[1]);
      add(form.times(line), -glm::dot(form.c, line));
    }
  }

  /// Returns the intersection of all three.
  glm::dvec3 meet() const {
    const auto& [a, b, c] = normals_;
    const glm::dvec3 bc = glm::cross(b, c);
    return (offsets_[0] * bc + offsets_[1] * glm::cross(c, a) + offsets_[2] * glm::cross(a, b)) /
           glm::dot(a, bc);
  }

 private:
  std::array<glm::dvec3, 3> normals_{};
  std::array<double, 3> offsets_{};
  std::size_t count_ = 0;
};

// Twice the area vector of the triangles between a position p and the boundary edges is along x p +
// moment. The component of p along `along` is free.
void keep_border(const EdgeSurroundings& edge, Planes& planes) {
  glm::dvec3 along(0), moment(0);
  for (const auto& [begin, end] : edge.borders) {
    along += end - begin;
    moment += glm::cross(begin, end);
  }
  const double square = glm::dot(along, along);
  if (!(square > 0)) return;
  const glm::dvec3 best = glm::cross(along, moment) / square;
  const auto [one, other] = across(along);
  planes.add(one, glm::dot(one, best));
  planes.add(other, glm::dot(other, best));
}

Form form_of(const EdgeSurroundings& edge) {
  const VolumeTerm& v = edge.volume;
  Form form{v.xx, v.xy, v.xz, v.yy, v.yz, v.zz, -edge.pull};
  const double weight = 9 * glm::dot(edge.edge_m, edge.edge_m);
  for (const auto& [begin, end] : edge.borders) {
    const glm::dvec3 e = end - begin;
    const double square = glm::dot(e, e);
    form.xx += weight * (square - e.x * e.x), form.yy += weight * (square - e.y * e.y);
    form.zz += weight * (square - e.z * e.z);
    form.xy -= weight * e.x * e.y, form.xz -= weight * e.x * e.z, form.yz -= weight * e.y * e.z;
    form.c += weight * glm::cross(glm::cross(begin, end), e);
  }
  return form;
}

double cost_of(const EdgeSurroundings& edge, const glm::dvec3& p) {
  double border = 0;
  for (const auto& [begin, end] : edge.borders) {
    const glm::dvec3 area = glm::cross(begin - p, end - p);
    border += glm::dot(area, area);
  }
  const double volume = glm::dot(p, edge.volume.times(p) - 2.0 * edge.pull) + edge.rest;
  return std::max(0.0, volume) / 72 + glm::dot(edge.edge_m, edge.edge_m) * border / 8;
}

}  // namespace

std::optional<EdgePlacement> place_edge(const EdgeSurroundings& edge) noexcept {
  Planes planes;
  if (!edge.borders.empty()) keep_border(edge, planes);
  planes.add(edge.volume.normal, edge.lift);
  if (planes.size() < 3) planes.add_least(form_of(edge));
  if (planes.size() < 3) {
    if (!edge.middle_m) return std::nullopt;
    planes.add_least({.xx = 1, .yy = 1, .zz = 1, .c = -*edge.middle_m});
    if (planes.size() < 3) return std::nullopt;
  }
  const glm::dvec3 place = planes.meet();
  return EdgePlacement{place, cost_of(edge, place)};
}

}  // namespace groundray
