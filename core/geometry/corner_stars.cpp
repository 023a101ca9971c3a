#include "core/geometry/corner_stars.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>

namespace groundray {
namespace {

bool less(const glm::dvec3& a, const glm::dvec3& b) {
  return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

}  // namespace

std::vector<std::uint32_t> place_numbers(const std::vector<glm::dvec3>& vertices_m) {
  std::vector<std::uint32_t> order(vertices_m.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(
      order, [&](std::uint32_t a, std::uint32_t b) { return less(vertices_m[a], vertices_m[b]); });
  std::vector<std::uint32_t> places(vertices_m.size());
  for (std::size_t i = 1; i < order.size(); ++i) {
    places[order[i]] =
        places[order[i - 1]] + (vertices_m[order[i]] != vertices_m[order[i - 1]] ? 1u : 0u);
  }
  return places;
}

CornerStars::CornerStars(const TriangleMesh& mesh) : places_(place_numbers(mesh.vertices_m)) {
  const std::size_t count =
      places_.empty() ? 0 : std::size_t{*std::ranges::max_element(places_)} + 1;
  first_.resize(count + 1);
  const auto for_each_corner = [&](const auto& act) {
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) act(places_[mesh.triangles[i][k]], i);
    }
  };
  for_each_corner([&](std::uint32_t place, std::uint32_t) { ++first_[place + 1]; });
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  triangles_.resize(3 * mesh.triangles.size());
  std::vector<std::uint32_t> next = first_;
  for_each_corner(
      [&](std::uint32_t place, std::uint32_t triangle) { triangles_[next[place]++] = triangle; });
  link_twins(mesh);
}

void CornerStars::link_twins(const TriangleMesh& mesh) {
  struct Corners {
    std::array<std::uint32_t, 3> places;  // ascending
    std::uint32_t triangle;
  };
  std::vector<Corners> all(mesh.triangles.size());
  for (std::uint32_t i = 0; i < all.size(); ++i) {
    const glm::uvec3& t = mesh.triangles[i];
    all[i] = {{places_[t.x], places_[t.y], places_[t.z]}, i};
    std::ranges::sort(all[i].places);
  }
  std::ranges::sort(all, {}, [](const Corners& c) { return std::tie(c.places, c.triangle); });
  for (std::size_t first = 0, end; first < all.size(); first = end) {
    for (end = first + 1; end < all.size() && all[end].places == all[first].places;) ++end;
    if (end == first + 1) continue;
    if (twins_.empty()) {
      twins_.resize(all.size());
      std::iota(twins_.begin(), twins_.end(), 0u);
    }
    for (std::size_t i = first; i < end; ++i)
      twins_[all[i].triangle] = all[i + 1 < end ? i + 1 : first].triangle;
  }
}

}  // namespace groundray
