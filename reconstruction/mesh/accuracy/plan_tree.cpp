#include "reconstruction/mesh/accuracy/plan_tree.h"

#include <algorithm>
#include <glm/common.hpp>
#include <utility>

namespace groundray {
namespace {

// Returns the bits of a number, with a zero before each.
std::uint64_t spread(std::uint64_t bits) {
  bits = (bits | bits << 16) & 0x0000ffff0000ffffull;
  bits = (bits | bits << 8) & 0x00ff00ff00ff00ffull;
  bits = (bits | bits << 4) & 0x0f0f0f0f0f0f0f0full;
  bits = (bits | bits << 2) & 0x3333333333333333ull;
  return (bits | bits << 1) & 0x5555555555555555ull;
}

}  // namespace

// Sorts triangles along a Morton curve, so that neighbours in the order are close to each other.
PlanTree::PlanTree(const TriangleMesh& mesh) {
  Box all;
  std::vector<Box> each(mesh.triangles.size());
  for (std::size_t i = 0; i < each.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const glm::dvec2 p_m(mesh.vertices_m[mesh.triangles[i][k]]);
      each[i].low_m = glm::min(each[i].low_m, p_m);
      each[i].high_m = glm::max(each[i].high_m, p_m);
    }
    all.low_m = glm::min(all.low_m, each[i].low_m);
    all.high_m = glm::max(all.high_m, each[i].high_m);
  }
  const double size_m = std::max(all.high_m.x - all.low_m.x, all.high_m.y - all.low_m.y);
  const double scale = size_m > 0 ? 4294967295.0 / size_m : 0;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> places(each.size());
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    const glm::dvec2 cell = scale * (0.5 * (each[i].low_m + each[i].high_m) - all.low_m);
    const auto x = static_cast<std::uint64_t>(cell.x), y = static_cast<std::uint64_t>(cell.y);
    places[i] = {spread(x) | spread(y) << 1, i};
  }
  std::sort(places.begin(), places.end());
  while (leaves_ * in_leaf < places.size()) leaves_ *= 2;
  boxes_.resize(2 * leaves_);
  for (const auto& [place, triangle] : places) {
    Box& box = boxes_[leaves_ + order_.size() / in_leaf];
    box.low_m = glm::min(box.low_m, each[triangle].low_m);
    box.high_m = glm::max(box.high_m, each[triangle].high_m);
    order_.push_back(triangle);
  }
  for (std::size_t node = leaves_ - 1; node > 0; --node) {
    const Box &a = boxes_[2 * node], &b = boxes_[2 * node + 1];
    boxes_[node] = {glm::min(a.low_m, b.low_m), glm::max(a.high_m, b.high_m)};
  }
}

}  // namespace groundray
