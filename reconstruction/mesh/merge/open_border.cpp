#include "reconstruction/mesh/merge/open_border.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <numeric>
#include <tuple>
#include <utility>

#include "reconstruction/mesh/manifold_mesh.h"

namespace groundray {
namespace {

struct Part {
  std::uint32_t begin = 0, end = 0;
  int axis = 0;

  std::uint32_t middle() const { return begin + (end - begin) / 2; }
  Part before() const { return {begin, middle(), (axis + 1) % 3}; }
  Part behind() const { return {middle() + 1, end, (axis + 1) % 3}; }
};

}  // namespace

OpenBorder::OpenBorder(const StitchedMesh& stitched)
    : number_of_(stitched.vertices.size(), no_vertex) {
  const std::vector<std::uint32_t> twins =
      pair_edges(stitched.triangles, stitched.vertices.size()).twins;
  const auto number = [&](std::uint32_t vertex) {
    if (number_of_[vertex] == no_vertex) {
      number_of_[vertex] = static_cast<std::uint32_t>(vertices_.size());
      vertices_.push_back(vertex);
      after_.emplace_back();
      before_.emplace_back();
    }
    return number_of_[vertex];
  };
  for (std::uint32_t e = 0; e < twins.size(); ++e) {
    if (twins[e] != none) continue;
    const std::uint32_t from = corner_of(stitched.triangles, e);
    const std::uint32_t to = corner_of(stitched.triangles, next_of(e));
    after_[number(from)].push_back(to);
    before_[number(to)].push_back(from);
  }
  for (std::uint32_t e = 0; e < twins.size(); ++e) {
    if (twins[e] == none) continue;
    const std::uint32_t from = corner_of(stitched.triangles, e);
    const std::uint32_t to = corner_of(stitched.triangles, next_of(e));
    if (number_of_[from] != no_vertex && number_of_[to] != no_vertex)
      inner_.insert(key_of(from, to));
  }
}

bool OpenBorder::has(std::uint32_t from, std::uint32_t to) const {
  return std::ranges::find(after(from), to) != after(from).end();
}

bool OpenBorder::is_free(std::uint32_t from, std::uint32_t to) const {
  return !has(from, to) && !inner_.contains(key_of(from, to));
}

void OpenBorder::add(const glm::uvec3& triangle) {
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t from = triangle[k], to = triangle[(k + 1) % 3];
    if (has(to, from)) {
      std::erase(after_[number_of_[to]], from);
      std::erase(before_[number_of_[from]], to);
      inner_.insert(key_of(from, to));
      inner_.insert(key_of(to, from));
    } else {
      after_[number_of_[from]].push_back(to);
      before_[number_of_[to]].push_back(from);
    }
  }
}

PointTree::PointTree(std::vector<glm::dvec3> points_m)
    : points_m_(std::move(points_m)), numbers_(points_m_.size()) {
  std::iota(numbers_.begin(), numbers_.end(), 0u);
  std::vector<Part> parts{{0, static_cast<std::uint32_t>(numbers_.size()), 0}};
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    if (part.end - part.begin < 2) continue;
    std::nth_element(numbers_.begin() + part.begin, numbers_.begin() + part.middle(),
                     numbers_.begin() + part.end, [&](std::uint32_t a, std::uint32_t b) {
                       return std::tie(points_m_[a][part.axis], a) <
                              std::tie(points_m_[b][part.axis], b);
                     });
    parts.push_back(part.before());
    parts.push_back(part.behind());
  }
  std::vector<glm::dvec3> arranged;
  arranged.reserve(numbers_.size());
  for (const std::uint32_t number : numbers_) arranged.push_back(points_m_[number]);
  points_m_ = std::move(arranged);
}

std::vector<std::uint32_t> PointTree::near(const glm::dvec3& place_m, double within_m) const {
  std::vector<std::uint32_t> found;
  std::array<Part, 40> parts;  // at most one for each halving, of which there are 32
  std::size_t count = 0;
  parts[count++] = {0, static_cast<std::uint32_t>(numbers_.size()), 0};
  while (count > 0) {
    const Part part = parts[--count];
    if (part.begin == part.end) continue;
    const glm::dvec3& p = points_m_[part.middle()];
    if (glm::distance(p, place_m) <= within_m) found.push_back(numbers_[part.middle()]);
    if (place_m[part.axis] - within_m <= p[part.axis]) parts[count++] = part.before();
    if (place_m[part.axis] + within_m >= p[part.axis]) parts[count++] = part.behind();
  }
  return found;
}

}  // namespace groundray
