#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/tracing/passes/leaf_hit.h"
#include "core/tracing/ray_tracer.h"
#include "terrain/lod/pass.h"

namespace groundray::testing {

/// Traces rays through the levels of `tracer` by the passes of core/tracing/passes.
std::vector<Crossing> trace_by_passes(const RayTracer& tracer, std::span<const Ray> rays,
                                      const PassRunner& runner);

/// Returns where crossings differ from what exact tracing finds, to the last bit of their ranges;
/// empty if nowhere.
/// @param tracer  exact.
/// @param met     becomes the number of rays that hit.
std::string difference_from_exact(std::span<const Crossing> found, const RayTracer& tracer,
                                  std::span<const Ray> rays, std::size_t& met);

}  // namespace groundray::testing
