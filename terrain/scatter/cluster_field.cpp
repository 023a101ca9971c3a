#include "terrain/scatter/cluster_field.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "terrain/scatter/dart_field.h"

// Every cell of a square lattice has a point that is uniformly distributed in it, and with
// probability 1/2 a cluster there. In units of cells, a cluster at the distance d from its point is
//
//     2 k (1 - d^2 / R^2)^2 for d < R, 0 elsewhere, with R = 3/4 and k = 3 / (pi R^2) = 16 / (3 pi)
//
// whose integral is 2. The mean of the sum at any position is therefore 1/2 times the sum over
// cells of the integral of a cluster over the cell, which is 1: it does not depend on the position.
//
// The sum is at most 8 k. Let b(s) = max(0, 1 - s), so that b(s + t) <= b(s) b(t), and sum b(s)^2
// over the columns of cells, with R^2 s the squared distance from the column: it is 1 for the
// position's own column and (1 - x^2 / R^2)^2 + (1 - (1 - x)^2 / R^2)^2 <= 1 for those at x and
// 1 - x beside it, where terms beyond R are left out. The sum of all clusters is at most 2 k times
// the product of these sums over columns and rows, 2 k 2 2.

namespace groundray {
namespace {

constexpr double radius = 0.75;
constexpr double peak = 2 * 3 / (std::numbers::pi * radius * radius);
constexpr std::uint32_t cluster_draw = 2 * max_darts;  // beyond the random numbers of darts

}  // namespace

ClusterField::ClusterField(const Clusters& clusters, Seed seed, std::uint32_t layer)
    : clusters_(clusters), seed_(seed), layer_(layer) {}

double ClusterField::at(glm::dvec2 p_W) const noexcept {
  const glm::dvec2 p = p_W / clusters_.size_m;
  const glm::ivec2 own(glm::floor(p));
  double sum = 0;
  for (int i = 0; i < 9; ++i) {
    const glm::ivec2 cell = own + glm::ivec2(i % 3 - 1, i / 3 - 1);
    const glm::dvec2 corner = glm::dvec2(cell) - p;
    const glm::dvec2 nearest = glm::clamp(glm::dvec2(0), corner, corner + 1.0);
    if (glm::dot(nearest, nearest) >= radius * radius) continue;
    const auto bits = random_bits({.seed = seed_,
                                   .sensor = layer_,
                                   .frame = static_cast<std::uint32_t>(cell.x),
                                   .pulse = static_cast<std::uint32_t>(cell.y),
                                   .sub_ray = cluster_draw,
                                   .stream = RandomStream::Scatter});
    if (bits[2] % 2 == 0) continue;
    const glm::dvec2 off = corner + (glm::dvec2(bits[0], bits[1]) + 0.5) * 0x1p-32;
    const double inside = std::max(0.0, 1 - glm::dot(off, off) / (radius * radius));
    sum += peak * inside * inside;
  }
  return 1 + clusters_.contrast * (sum - 1);
}

double ClusterField::highest() const noexcept { return 1 + clusters_.contrast * (4 * peak - 1); }

}  // namespace groundray
