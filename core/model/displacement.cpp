#include "core/model/displacement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/appearance/texture.h"
#include "core/error.h"
#include "core/geometry/corner_stars.h"

namespace groundray {
namespace {

void check_displacement(const Model& model, const Displacement& by) {
  Violations broken("displacement");
  broken.unless(!model.uv.empty(), "the model has no uv, which an image requires");
  broken.unless(by.cell_m > 0 && std::isfinite(by.cell_m), "cell_m = {} must be positive",
                by.cell_m);
  broken.unless(by.amplitude_m > 0 && std::isfinite(by.amplitude_m),
                "amplitude_m = {} must be positive", by.amplitude_m);
  broken.unless(std::isfinite(by.middle), "middle must be finite");
  broken.throw_if_any();
  // Estimates the final number of triangles: after halving, edges are 3/4 of a cell long on
  // average, which makes the area of a triangle 1/4 of a squared cell.
  double triangles = 0;
  for (const glm::uvec3& t : model.mesh.triangles) {
    const auto& p = model.mesh.vertices_m;
    const double area_m2 = glm::length(glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x])) / 2;
    triangles += std::max(1.0, area_m2 / (0.25 * by.cell_m * by.cell_m));
  }
  if (triangles > static_cast<double>(most_displaced_triangles)) {
    throw Error(
        "displacement: cells of {} m result in about {:.3g} triangles, more than {}; increase "
        "cell_m",
        by.cell_m, triangles, most_displaced_triangles);
  }
}

// Halves long edges. Whether and where an edge is halved depends only on the positions of its ends.
// Neighbours therefore agree, also across a seam, where the ends are different vertices at the same
// positions.
class Refiner {
 public:
  Refiner(Model& model, double cell_m) : model_(model), cell_m_(cell_m) {}

  void run() {
    while (halve_once()) {
    }
  }

 private:
  static constexpr std::uint32_t whole = ~0u;  // the edge is not halved

  bool halve_once() {
    middles_.clear();
    std::vector<glm::uvec3> triangles;
    std::vector<std::uint16_t> surfaces;
    for (std::size_t i = 0; i < model_.mesh.triangles.size(); ++i) {
      const std::size_t before = triangles.size();
      part(model_.mesh.triangles[i], triangles);
      surfaces.insert(surfaces.end(), triangles.size() - before, model_.surface_of[i]);
    }
    const bool any = triangles.size() > model_.mesh.triangles.size();
    model_.mesh.triangles = std::move(triangles);
    model_.surface_of = std::move(surfaces);
    return any;
  }

  void part(const glm::uvec3& corners, std::vector<glm::uvec3>& into) {
    std::array<std::uint32_t, 3> middle{};
    int halved = 0, longest = 0;
    double length_m = -1;
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = corners[k], b = corners[(k + 1) % 3];
      middle[static_cast<std::size_t>(k)] = middle_of(a, b);
      if (middle[static_cast<std::size_t>(k)] != whole) ++halved;
      const double own_m = length(a, b);
      if (own_m > length_m) {
        length_m = own_m;
        longest = k;
      }
    }
    // Splits at the longest edge first: each of the two parts then has at most one more halved
    // edge.
    const auto corner = [&](int k) { return corners[(longest + k) % 3]; };
    const auto half = [&](int k) { return middle[static_cast<std::size_t>((longest + k) % 3)]; };
    if (halved == 0) {
      into.push_back(corners);
      return;
    }
    const std::uint32_t m = half(0);  // the longest edge is halved if any is
    const auto add_side = [&](std::uint32_t a, std::uint32_t b, std::uint32_t between) {
      if (between == whole) {
        into.emplace_back(a, b, m);
      } else {
        into.emplace_back(a, between, m);
        into.emplace_back(between, b, m);
      }
    };
    add_side(corner(1), corner(2), half(1));
    add_side(corner(2), corner(0), half(2));
  }

  double length(std::uint32_t a, std::uint32_t b) const {
    return glm::distance(model_.mesh.vertices_m[a], model_.mesh.vertices_m[b]);
  }

  std::uint32_t middle_of(std::uint32_t a, std::uint32_t b) {
    if (length(a, b) <= cell_m_) return whole;
    const std::uint64_t key = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    const auto [found, is_new] =
        middles_.try_emplace(key, static_cast<std::uint32_t>(model_.mesh.vertices_m.size()));
    if (!is_new) return found->second;
    const auto middle = [&](auto& values) {
      using Value = typename std::decay_t<decltype(values)>::value_type;
      values.push_back(Value((values[a] + values[b]) / typename Value::value_type(2)));
    };
    middle(model_.mesh.vertices_m);
    middle(model_.uv);
    if (!model_.normals.empty()) middle(model_.normals);
    return found->second;
  }

  Model& model_;
  double cell_m_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;  // by edge
};

// Sums of the area-weighted facet normals at each position; not normalised.
std::vector<glm::dvec3> facet_normals(const Model& model,
                                      const std::vector<std::uint32_t>& places) {
  std::vector<glm::dvec3> normals(places.size(), glm::dvec3(0));
  const auto& p = model.mesh.vertices_m;
  for (const glm::uvec3& t : model.mesh.triangles) {
    const glm::dvec3 normal = glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]);
    for (int k = 0; k < 3; ++k) normals[places[t[k]]] += normal;
  }
  return normals;
}

glm::dvec3 unit(const glm::dvec3& v) {
  const double size = glm::length(v);
  return size > 0 ? v / size : glm::dvec3(0);
}

}  // namespace

Model displaced(const Model& model, const Displacement& by) {
  check_displacement(model, by);
  const Texture heights(by.image, Wrap::Repeat);
  Model result = model;
  Refiner(result, by.cell_m).run();
  auto& vertices_m = result.mesh.vertices_m;
  const std::vector<std::uint32_t> places = place_numbers(vertices_m);
  std::vector<glm::dvec3> normals = facet_normals(result, places);
  if (!result.normals.empty()) {
    std::ranges::fill(normals, glm::dvec3(0));
    for (std::size_t i = 0; i < vertices_m.size(); ++i)
      normals[places[i]] += glm::dvec3(result.normals[i]);
  }
  std::vector<double> height_m(places.size()), copies(places.size());
  for (std::size_t i = 0; i < vertices_m.size(); ++i) {
    const double value = heights.color(glm::dvec2(result.uv[i])).r;
    height_m[places[i]] += by.amplitude_m * (value - by.middle);
    ++copies[places[i]];
  }
  for (std::size_t i = 0; i < vertices_m.size(); ++i) {
    const std::uint32_t place = places[i];
    vertices_m[i] += unit(normals[place]) * (height_m[place] / copies[place]);
  }
  if (result.normals.empty()) return result;
  normals = facet_normals(result, places);
  for (std::size_t i = 0; i < vertices_m.size(); ++i) {
    const glm::dvec3 normal = unit(normals[places[i]]);
    result.normals[i] = normal == glm::dvec3(0) ? glm::vec3(0, 0, 1) : glm::vec3(normal);
  }
  return result;
}

}  // namespace groundray
