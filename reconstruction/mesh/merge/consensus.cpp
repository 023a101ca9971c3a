#include "reconstruction/mesh/merge/consensus.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace groundray {
namespace {

// Lower bound of standard deviations, so that weights stay finite.
constexpr double least_sd_m = 1e-6;
constexpr float least_worth = 1e-3f;

/// Weighted sum of all scans' measurements of one vertex.
class Votes {
 public:
  /// Adds one measurement.
  /// @param along_m  position of the surface along the normal.
  void add(double along_m, double sd_m, float worth, std::uint16_t label, float confidence) {
    const double variance = std::max(sd_m, least_sd_m) * std::max(sd_m, least_sd_m);
    const double weight = std::max(worth, least_worth) / variance;
    weights_ += weight;
    along_ += weight * along_m;
    variances_ += weight * weight * sd_m * sd_m;
    if (!(worth > most_worth_)) return;
    most_worth_ = worth;
    label_ = label;
    confidence_ = confidence;
  }

  void apply_to(StitchedVertex& vertex) const {
    vertex.p += along_ / weights_ * glm::dvec3(vertex.normal);
    vertex.sd_m = static_cast<float>(std::sqrt(variances_) / weights_);
    vertex.label = label_;
    vertex.confidence = confidence_;
  }

 private:
  double weights_ = 0, along_ = 0, variances_ = 0;
  float most_worth_ = -1, confidence_ = 1;
  std::uint16_t label_ = 0;
};

class Consensus {
 public:
  explicit Consensus(std::span<const ConsensusScan> scans) : scans_(scans) {
    for (const ConsensusScan& scan : scans) worth_.push_back(worth_of_vertices(*scan.rated));
  }

  /// Moves a vertex; returns true if a scan other than its own has seen it.
  bool move(StitchedVertex& vertex) const {
    Votes votes;
    votes.add(0, vertex.sd_m, own_worth(vertex), vertex.label, vertex.confidence);
    bool is_seen_again = false;
    for (std::size_t s = 0; s < scans_.size(); ++s) {
      if (s == vertex.scan) continue;
      const std::uint32_t triangle = cover_of(vertex, s);
      if (triangle == not_covered) continue;
      is_seen_again = true;
      vote(vertex, s, triangle, votes);
    }
    if (is_seen_again) votes.apply_to(vertex);
    return is_seen_again;
  }

 private:
  float own_worth(const StitchedVertex& vertex) const {
    return vertex.vertex == no_vertex ? 0 : worth_[vertex.scan][vertex.vertex];
  }

  std::uint32_t cover_of(const StitchedVertex& vertex, std::size_t s) const {
    if (vertex.vertex != no_vertex) return scans_[vertex.scan].covers->of(vertex.vertex)[s];
    std::uint32_t near = scans_[vertex.scan].covers->of(vertex.nearest)[s];
    if (near == not_covered) near = 0;
    const CoverAnswer answer =
        scans_[s].rated->surface.at({vertex.p, vertex.normal, vertex.sd_m}, 0, near);
    const std::uint32_t triangle = answer.nearest.triangle;
    const bool is_seen = answer.cover == Cover::Inside && !scans_[s].rated->refutes(triangle);
    return is_seen ? triangle : not_covered;
  }

  void vote(const StitchedVertex& vertex, std::size_t s, std::uint32_t triangle,
            Votes& votes) const {
    const CoverSurface& surface = scans_[s].rated->surface;
    const TriangleMesh& mesh = surface.mesh();
    const glm::uvec3& t = mesh.triangles[triangle];
    const glm::dvec3 to = vector_to_triangle(vertex.p, mesh.vertices_m[t.x], mesh.vertices_m[t.y],
                                             mesh.vertices_m[t.z]);
    const glm::dvec3 shares = shares_of_corners(mesh, triangle, vertex.p + to);
    const double sd_m =
        shares.x * surface.sd_m(t.x) + shares.y * surface.sd_m(t.y) + shares.z * surface.sd_m(t.z);
    const int most =
        shares.x >= shares.y ? (shares.x >= shares.z ? 0 : 2) : (shares.y >= shares.z ? 1 : 2);
    const MeasuredMesh& known = *scans_[s].mesh;
    votes.add(glm::dot(to, glm::dvec3(vertex.normal)), sd_m, scans_[s].rated->worth[triangle],
              known.labels.empty() ? std::uint16_t{0} : known.labels[t[most]],
              known.confidence.empty() ? 1 : known.confidence[t[most]]);
  }

  std::span<const ConsensusScan> scans_;
  std::vector<std::vector<float>> worth_;
};

}  // namespace

std::size_t move_to_consensus(StitchedMesh& stitched, std::span<const ConsensusScan> scans) {
  const Consensus consensus(scans);
  std::vector<char> is_moved(stitched.vertices.size());
  tbb::parallel_for(std::size_t{0}, stitched.vertices.size(), [&](std::size_t i) {
    is_moved[i] = consensus.move(stitched.vertices[i]) ? 1 : 0;
  });
  return static_cast<std::size_t>(std::ranges::count(is_moved, char{1}));
}

}  // namespace groundray
