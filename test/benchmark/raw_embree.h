#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/height_grid.h"
#include "core/ray_tracer.h"

namespace groundray::benchmark {

/// The limit to compare with: the surface as one Embree grid scene, robust, traced in native
/// packets that were filled beforehand, on all threads, nothing but the float distance kept.
class RawEmbree {
 public:
  RawEmbree(const HeightGrid& grid, std::span<const Ray> rays);
  ~RawEmbree();
  RawEmbree(const RawEmbree&) = delete;
  RawEmbree& operator=(const RawEmbree&) = delete;

  /// Traces all rays and returns their float ranges, infinite for none.
  std::span<const float> trace();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace groundray::benchmark
