#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/geometry/height_grid.h"
#include "core/tracing/ray.h"

namespace groundray::benchmark {

/// Upper limit of the achievable speed: the surface as one robust Embree grid scene, traced on all
/// threads in native packets that were filled beforehand; only the single-precision distance is
/// kept.
class RawEmbree {
 public:
  RawEmbree(const HeightGrid& grid, std::span<const Ray> rays);
  ~RawEmbree();
  RawEmbree(const RawEmbree&) = delete;
  RawEmbree& operator=(const RawEmbree&) = delete;

  /// Traces all rays and returns their single-precision ranges, infinite for misses.
  std::span<const float> trace();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace groundray::benchmark
