#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "reconstruction/merge/cover_surface.h"
#include "reconstruction/merge/redundant_faces.h"
#include "reconstruction/work.h"

namespace groundray {

/// A scan's surface and where its beams began, in the surface's frame.
struct BeamSurface {
  const RatedSurface* rated = nullptr;
  std::vector<glm::dvec3> origins_m;  ///< of each vertex, or none if it is not known
};

/// Returns for each scan which of its triangles other scans have seen through: a beam met such a
/// triangle first of its scan's and ended behind it, by more than noise explains. Where beams
/// passed what this beam met, too, it counts only if that is worth more: of two surfaces that poses
/// put apart one stays. Only triangles so long that they may be farther than noise from what is
/// between their corners are looked at: one beam is enough to tell that they bridge something.
/// @param interpolation  how far, for each metre of its longest edge, that may be.
std::vector<std::vector<char>> find_seen_through(std::span<const BeamSurface> scans,
                                                 const CoverTolerance& limits, double interpolation,
                                                 const Work& work);

/// Returns which of some triangles, long ones as above, beams of any scan have passed.
/// @param sd_m  of each vertex.
std::vector<char> find_passed(const TriangleMesh& mesh, std::span<const float> sd_m,
                              std::span<const BeamSurface> scans, const CoverTolerance& tolerance,
                              double interpolation, const Work& work);

}  // namespace groundray
