#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "core/closest_point.h"
#include "core/mesh.h"
#include "core/pose.h"
#include "core/random.h"
#include "core/scene.h"
#include "sensors/lidar.h"

namespace groundray::testing {

/// Where reconstructions are held against the truth: fractal ground 64 m wide, about 70 boulders
/// half buried in it and 40 bare trunks, and poses of a robot that drives through, about D's
/// origin.
struct ClosedLoopScene {
  Scene scene;
  TriangleMesh truth;      ///< all surfaces of the scene, buried parts too, in D
  std::vector<Pose> X_DS;  ///< of the sensor, 1.9 m above ground
};

/// Makes the scene of a seed; the same whatever the number of poses.
/// @param poses  one amid the scene, or several about 6 m apart, of more than five 4 m.
ClosedLoopScene closed_loop_scene(Seed seed, int poses);

/// The scene's lidar: beams from -25 to 3 degrees, ranges up to 100 m, and noise of 2 cm.
struct ClosedLoopLidar {
  int rings = 64;
  int columns = 1800;
  static constexpr double lowest_deg = -25, highest_deg = 3, noise_m = 0.02;

  Lidar lidar() const;
};

/// Returns one scan from each pose, as a dataset would hold it.
std::vector<PointCloud> scans_of(const ClosedLoopScene& scene, const ClosedLoopLidar& lidar,
                                 Seed seed);

/// Returns points of the truth that a beam of the lidar could have met from a pose, up to
/// `within_m` away: each stands for the same area.
/// @param samples  of the whole truth.
std::vector<glm::dvec3> visible_samples(const ClosedLoopScene& scene, double within_m,
                                        std::size_t samples, Seed seed);

/// How well a mesh is what the truth is, at a tolerance.
struct ClosedLoopScore {
  double precision = 0;     ///< share of the mesh's area that is so near the truth
  double completeness = 0;  ///< share of the visible truth that is so near the mesh
  double f1 = 0;            ///< their harmonic mean
};

/// Scores a mesh by as many samples of it as there are visible ones: shares are within 0.002 of
/// what endless samples would give, in 19 of 20 cases, for 200 000 of each.
/// @throws Error as ClosestPoint.
ClosedLoopScore score(const TriangleMesh& mesh, const ClosestPoint& truth,
                      std::span<const glm::dvec3> visible, double tolerance_m);

}  // namespace groundray::testing
