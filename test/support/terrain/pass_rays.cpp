#include "test/support/terrain/pass_rays.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/tracing/level_scene.h"
#include "core/tracing/passes/trace_level.h"

namespace groundray::testing {
namespace {

// A level in memory of its own, which a device may copy.
struct CopiedLevel {
  std::vector<float> heights_m;
  std::vector<Leaf> leaves;
  std::vector<std::int32_t> leaf_of_block;
  std::vector<float> high_m;
  LevelView view;

  explicit CopiedLevel(const LevelScene& scene) : view(scene.impl()) {
    const auto size = [](glm::ivec2 of) {
      return static_cast<std::size_t>(of.x) * static_cast<std::size_t>(of.y);
    };
    heights_m.assign(view.heights_m, view.heights_m + size(view.points));
    leaves = scene.level().leaves;
    leaf_of_block.assign(view.leaf_of_block, view.leaf_of_block + size(view.blocks));
    high_m.resize(leaves.size());
    view.heights_m = heights_m.data();
    view.leaves = leaves.data();
    view.leaf_of_block = leaf_of_block.data();
  }
};

}  // namespace

std::vector<Crossing> trace_by_passes(const RayTracer& tracer, std::span<const Ray> rays,
                                      const PassRunner& runner) {
  std::vector<passes::TracedRay> traced;
  traced.reserve(rays.size());
  for (const Ray& ray : rays) traced.push_back({ray.origin, ray.direction, ray.far_m});
  std::vector<Crossing> hits(rays.size());
  const LevelScene::Impl& outermost = tracer.levels().back().impl();
  const GridFrame frame = outermost.level.frame;
  const GroundExtent ground(frame, outermost.first, outermost.last);
  std::uint32_t number = 0;
  for (const LevelScene& scene : tracer.levels()) {
    CopiedLevel level(scene);
    run_pass(runner, level.leaves.size(), passes::HighPointPass{level.view, level.high_m.data()});
    run_pass(runner, rays.size(),
             passes::TraceLevelPass{frame, ground, level.view, number++, level.high_m.data(),
                                    traced.data(), hits.data()});
  }
  return hits;
}

std::string difference_from_exact(std::span<const Crossing> found, const RayTracer& tracer,
                                  std::span<const Ray> rays, std::size_t& met) {
  std::vector<Hit> hits(rays.size());
  std::vector<GroundFacet> facets(rays.size());
  tracer.trace(rays, hits, Batch::Alike, facets);
  met = static_cast<std::size_t>(
      std::ranges::count_if(hits, [](const Hit& hit) { return static_cast<bool>(hit); }));
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto bits = std::bit_cast<std::uint64_t>(found[i].range_m);
    const bool same =
        bits == std::bit_cast<std::uint64_t>(hits[i].range_m) &&
        (!hits[i] || (found[i].facet == facets[i] && found[i].deviation_m == hits[i].deviation_m &&
                      facets[i].level == hits[i].part));
    if (same) continue;
    return fmt::format(
        "ray {}: {:.17g} m on ({}, {}) of level {}, instead of {:.17g} m on ({}, {}) of level {}",
        i, found[i].range_m, found[i].facet.column, found[i].facet.row, found[i].facet.level,
        hits[i].range_m, facets[i].column, facets[i].row, facets[i].level);
  }
  return "";
}

}  // namespace groundray::testing
