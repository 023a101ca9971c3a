#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "reconstruction/mesh/merge/cover_surface.h"
#include "reconstruction/mesh/merge/redundant_faces.h"
#include "reconstruction/run_control.h"

namespace groundray {

/// Surface of a scan and the origins of its beams, in the surface's frame.
struct BeamSurface {
  const RatedSurface* rated = nullptr;
  std::vector<glm::dvec3> origins_m;  ///< of each vertex; empty if unknown
};

/// Returns for each scan which of its triangles other scans have seen through: such a triangle is
/// the first long one of its scan that a beam hit, and the beam ended behind it by more than noise
/// explains. If beams also passed through the surface that this beam hit, the conflict counts only
/// if that surface has the greater weight, so that one of two surfaces separated by errors of the
/// poses remains. Only triangles so long that they may deviate from the surface between their
/// corners by more than noise are tested; for these, one beam suffices.
/// @param interpolation  permitted deviation per metre of a triangle's longest edge.
std::vector<std::vector<char>> find_visibility_conflicts(std::span<const BeamSurface> scans,
                                                         const CoverTolerance& limits,
                                                         double interpolation,
                                                         const RunControl& work);

/// Returns which of some triangles beams of any scan have passed through; only long ones, as above.
/// @param sd_m  of each vertex.
std::vector<char> find_passed(const TriangleMesh& mesh, std::span<const float> sd_m,
                              std::span<const BeamSurface> scans, const CoverTolerance& tolerance,
                              double interpolation, const RunControl& work);

}  // namespace groundray
