#pragma once

#include "apps/golden/conform/pass_folder.h"
#include "apps/golden/report.h"

namespace groundray::golden {

/// Permitted errors of ranges: absolute_m + relative times the range. If `moves_rays`, rays may
/// besides be moved sideways by delta_m, which changes ranges by delta_m over the cosine of
/// incidence.
struct RayBudget {
  double relative = 1e-9;
  double absolute_m = 1e-9;
  bool moves_rays = false;
  double delta_m = 0;  ///< other triangles may be hit only where an edge or silhouette is nearer
};

/// Class `rays`: ranges within the budget, on the same triangles.
Section judge_rays(const PassFolder& ours, const ArrayFolder& theirs, const RayBudget& budget);

}  // namespace groundray::golden
