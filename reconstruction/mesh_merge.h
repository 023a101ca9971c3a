#pragma once

#include <cstddef>
#include <span>

#include "reconstruction/scan_mesh.h"
#include "reconstruction/work.h"

namespace groundray {

/// When surfaces of two scans are taken for one.
struct MergeLimits {
  double noise_sds = 3;   ///< apart by at most so many standard deviations of both,
  double apart_m = 0;     ///< and this besides: what poses are off
  double turned_rad = 0;  ///< between normals, at most
};

/// What merging did.
struct MergeCounts {
  std::size_t redundant = 0;  ///< triangles left out, for another scan saw the place better
  std::size_t clipped = 0;    ///< triangles cut at borders of others
  std::size_t moved = 0;      ///< vertices moved to the consensus of several scans
};

/// Scans as one mesh.
struct MergedMesh {
  MeasuredMesh mesh;
  MergeCounts counts;
};

}  // namespace groundray
