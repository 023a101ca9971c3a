#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <utility>

#include "core/tracing/scene.h"
#include "terrain/dem/dem_io.h"

namespace groundray::python {

/// DEM in memory with the scenes that rays see, built on first use.
class TerrainModel {
 public:
  explicit TerrainModel(Dem dem) : dem_(std::move(dem)) {}

  const Dem& dem() const { return dem_; }

  /// Returns the scene of the reference surface itself. Thread-safe.
  /// @throws Error as RayTracer.
  const Scene& scene(Tracing tracing) const;

 private:
  // Scene that is built when it is first requested.
  struct LateScene {
    std::once_flag once;
    std::unique_ptr<const Scene> scene;
  };

  Dem dem_;
  mutable LateScene fast_, exact_;
};

/// Writes a GeoTIFF of float32 heights. It appears only when complete.
/// @throws Error as write_layers.
void write_dem(const Dem& dem, const std::filesystem::path& path);

}  // namespace groundray::python
