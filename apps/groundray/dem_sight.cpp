#include "apps/groundray/dem_sight.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <optional>

#include "core/error.h"
#include "reconstruction/dem/sight_bound.h"
#include "reconstruction/scan/scan_mesh.h"

namespace groundray {
namespace {

// Whether a point lies on the measured ground or above it: within what the bound will be raised by.
bool is_sound(const DemLayers& layers, const glm::dvec3& end_m, double margin_m) {
  constexpr double sds = 2;
  const glm::dvec2 at = glm::round(layers.frame.to_grid(glm::dvec2(end_m)));
  const glm::ivec2 samples = layers.frame.samples;
  if (!(at.x >= 0 && at.y >= 0 && at.x < samples.x && at.y < samples.y)) return false;
  const std::size_t i = static_cast<std::size_t>(at.y) * static_cast<std::size_t>(samples.x) +
                        static_cast<std::size_t>(at.x);
  const double below_m = layers.elevation_m[i] - end_m.z;  // NaN where nothing was measured
  return below_m <= margin_m + sds * std::sqrt(layers.variance_m2[i]);
}

// The same faces without those that an unsound point is a corner of.
OcclusionFaces sound_faces(const DemLayers& layers, double margin_m, OcclusionFaces faces) {
  std::vector<bool> is_kept;
  for (const glm::dvec3& vertex_m : faces.shape.vertices_m)
    is_kept.push_back(is_sound(layers, vertex_m, margin_m));
  std::erase_if(faces.shape.triangles, [&](const glm::uvec3& t) {
    return !(is_kept[t.x] && is_kept[t.y] && is_kept[t.z]);
  });
  return faces;
}

// What is between neighbouring beams; nothing if beams have no order.
std::optional<OcclusionFaces> faces_of(const ScanFiles& files, const ScanFile& scan,
                                       const ScanTaking& taking, std::vector<std::string>& notes) {
  OrganisedInput input;
  try {
    input = read_organised(files, scan, taking);
  } catch (const Error& error) {
    notes.push_back(fmt::format("{}: bounded by its beams alone: {}", scan.name, error.what()));
    return std::nullopt;
  }
  const ScreeningLimits limits =
      scan.is_range_grid ? ScreeningLimits::object() : ScreeningLimits::ground();
  return link(input.cells, limits).occlusion;
}

}  // namespace

void bound_by_sight(const ScanFiles& files, const ScanFile& scan, const ScanTaking& taking,
                    SightUse use, double margin_m, DemLayers& layers,
                    std::vector<std::string>& notes) {
  if (use == SightUse::None) return;
  OcclusionFaces faces;
  if (use == SightUse::Faces) {
    if (auto found = faces_of(files, scan, taking, notes))
      faces = sound_faces(layers, margin_m, *found);
  }
  const PointInput input = read_points(files, scan, taking);
  std::vector<SightLine> lines;
  for (std::size_t i = 0; i < input.points_m.size(); ++i) {
    if (is_sound(layers, input.points_m[i], margin_m))
      lines.push_back({.origin_m = input.origins_m[i], .end_m = input.points_m[i]});
  }
  const std::vector<float> bound_m = sight_bound(layers.frame, faces, lines, margin_m);
  for (std::size_t i = 0; i < bound_m.size(); ++i)
    layers.upper_bound_m[i] = std::fmin(layers.upper_bound_m[i], bound_m[i]);
}

}  // namespace groundray
