#include "reconstruction/mesh/merge/visibility_conflict.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "core/math.h"
#include "core/model/model.h"
#include "core/tracing/object_tracer.h"
#include "core/tracing/ray_tracer.h"
#include "reconstruction/mesh/mesh_arrays.h"

namespace groundray {
namespace {

constexpr std::size_t beams_in_block = 512;

// Noise moves vertices along beams, and thus less across a triangle: most triangles that are long
// for their beams' spacing are seen at an incidence of 60 degrees or more.
constexpr double across = 0.5;

double longest_edge_m(const TriangleMesh& mesh, const glm::uvec3& t) {
  const glm::dvec3 &a = mesh.vertices_m[t.x], &b = mesh.vertices_m[t.y], &c = mesh.vertices_m[t.z];
  return std::max({glm::distance(a, b), glm::distance(b, c), glm::distance(c, a)});
}

/// Beam and a triangle that it passed through.
struct Passage {
  std::uint32_t beam = 0, triangle = 0;
};

/// Long triangles of a mesh, prepared for tracing the beams of scans.
class LongTriangles {
 public:
  /// @param mesh  must outlive this, as must sd_m, which may be empty for 0.
  LongTriangles(const RayDevice& device, const TriangleMesh& mesh, std::span<const float> sd_m,
                const CoverTolerance& limits, double interpolation)
      : mesh_(mesh), sd_m_(sd_m), limits_(limits) {
    Model model;
    model.mesh.vertices_m = mesh.vertices_m;
    model.surfaces.resize(1);
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const glm::uvec3& t = mesh.triangles[i];
      const double may_be_off_m = interpolation * longest_edge_m(mesh, t);
      if (!(may_be_off_m > margin_m(0, largest_sd_m(t)))) continue;
      numbers_.push_back(i);
      model.mesh.triangles.push_back(t);
    }
    if (numbers_.empty()) return;
    model.surface_of.resize(numbers_.size());
    tracer_ = ObjectTracer(device, {ModelScene(device, std::move(model), Tracing::Fast)},
                           {PlacedObject{}}, {});
  }

  /// Returns the triangles that the beams of another scan passed through.
  std::vector<Passage> passed_by(const BeamSurface& other) const {
    if (numbers_.empty()) return {};
    const std::size_t beams = other.origins_m.size(),
                      blocks = (beams + beams_in_block - 1) / beams_in_block;
    std::vector<std::vector<Passage>> passed(blocks);
    tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
      passed[block] =
          passed_by(other, block * beams_in_block, std::min(beams, (block + 1) * beams_in_block));
    });
    std::vector<Passage> all;
    for (const std::vector<Passage>& part : passed) all.insert(all.end(), part.begin(), part.end());
    return all;
  }

 private:
  double largest_sd_m(const glm::uvec3& t) const {
    return sd_m_.empty() ? 0 : std::max({sd_m_[t.x], sd_m_[t.y], sd_m_[t.z]});
  }

  double margin_m(double sd_m, double other_sd_m) const {
    return across * limits_.noise_sds * math::hypot(sd_m, other_sd_m) + limits_.apart_m;
  }

  std::vector<Passage> passed_by(const BeamSurface& other, std::size_t begin,
                                 std::size_t end) const {
    std::vector<Ray> rays(end - begin);
    std::vector<Hit> hits(end - begin);
    for (std::size_t v = begin; v < end; ++v) {
      const glm::dvec3 along = other.rated->surface.mesh().vertices_m[v] - other.origins_m[v];
      const double range_m = glm::length(along);
      Ray& ray = rays[v - begin];
      ray.origin = other.origins_m[v];
      if (range_m > 0) ray.direction = along / range_m;
      hits[v - begin].range_m = range_m;
    }
    tracer_.trace(rays, hits);
    std::vector<Passage> passed;
    for (std::size_t v = begin; v < end; ++v) {
      if (hits[v - begin].object == 0) continue;
      const Passage passage{static_cast<std::uint32_t>(v), numbers_[hits[v - begin].part]};
      if (is_behind(other, passage.beam, passage.triangle)) passed.push_back(passage);
    }
    return passed;
  }

  bool is_behind(const BeamSurface& other, std::uint32_t vertex, std::uint32_t triangle) const {
    const glm::uvec3& t = mesh_.triangles[triangle];
    const glm::dvec3 normal = area_vector_m2(mesh_, t);
    const glm::dvec3& p = other.rated->surface.mesh().vertices_m[vertex];
    const double off = glm::dot(p - mesh_.vertices_m[t.x], normal);
    const double margin = margin_m(other.rated->surface.sd_m(vertex), largest_sd_m(t));
    return std::abs(off) > margin * glm::length(normal);
  }

  const TriangleMesh& mesh_;
  std::span<const float> sd_m_;
  CoverTolerance limits_;
  std::vector<std::uint32_t> numbers_;  // of the long triangles in `mesh_`
  ObjectTracer tracer_;
};

/// Returns 1 for each vertex of a marked triangle, otherwise 0.
std::vector<char> at_marked(const TriangleMesh& mesh, const std::vector<char>& is_marked) {
  std::vector<char> is_at(mesh.vertices_m.size());
  for (std::size_t i = 0; i < is_marked.size(); ++i) {
    for (int k = 0; k < 3 && is_marked[i] != 0; ++k) is_at[mesh.triangles[i][k]] = 1;
  }
  return is_at;
}

}  // namespace

std::vector<std::vector<char>> find_visibility_conflicts(std::span<const BeamSurface> scans,
                                                         const CoverTolerance& limits,
                                                         double interpolation,
                                                         const RunControl& work) {
  const std::size_t count = scans.size();
  const RayDevice device;
  std::vector<std::vector<Passage>> passages(count * count);  // by scan of triangles, then of beams
  std::vector<std::vector<char>> passed;
  for (std::size_t s = 0; s < count; ++s) {
    passed.emplace_back(scans[s].rated->worth.size());
    const CoverSurface& surface = scans[s].rated->surface;
    const LongTriangles triangles(device, surface.mesh(), surface.sds_m(), limits, interpolation);
    for (std::size_t other = 0; other < count; ++other) {
      if (other == s) continue;
      passages[s * count + other] = triangles.passed_by(scans[other]);
      for (const Passage& passage : passages[s * count + other]) passed[s][passage.triangle] = 1;
      work.report(static_cast<double>(s * count + other + 1) / static_cast<double>(count * count));
    }
  }
  std::vector<std::vector<char>> refuted;
  for (std::size_t s = 0; s < count; ++s) refuted.emplace_back(passed[s].size());
  for (std::size_t other = 0; other < count; ++other) {
    const std::vector<char> in_doubt = at_marked(scans[other].rated->surface.mesh(), passed[other]);
    const std::vector<float> worth = worth_of_vertices(*scans[other].rated);
    for (std::size_t s = 0; s < count; ++s) {
      for (const Passage& passage : passages[s * count + other]) {
        if (in_doubt[passage.beam] == 0 ||
            worth[passage.beam] > scans[s].rated->worth[passage.triangle])
          refuted[s][passage.triangle] = 1;
      }
    }
  }
  return refuted;
}

std::vector<char> find_passed(const TriangleMesh& mesh, std::span<const float> sd_m,
                              std::span<const BeamSurface> scans, const CoverTolerance& tolerance,
                              double interpolation, const RunControl& work) {
  const RayDevice device;
  const LongTriangles triangles(device, mesh, sd_m, tolerance, interpolation);
  std::vector<char> is_passed(mesh.triangles.size());
  for (std::size_t s = 0; s < scans.size(); ++s) {
    for (const Passage& passage : triangles.passed_by(scans[s])) is_passed[passage.triangle] = 1;
    work.report(static_cast<double>(s + 1) / static_cast<double>(scans.size()));
  }
  return is_passed;
}

}  // namespace groundray
