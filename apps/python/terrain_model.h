#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "core/scene.h"
#include "terrain/dem.h"

namespace groundray::python {

/// A DEM in memory, and what rays see of it: built when it is asked for first.
class TerrainModel {
 public:
  explicit TerrainModel(Dem dem) : dem_(std::move(dem)) {}

  const Dem& dem() const { return dem_; }

  /// Of the reference surface itself, every facet decided in double. @throws Error as RayTracer.
  const Scene& scene() const;

 private:
  Dem dem_;
  mutable std::once_flag once_;
  mutable std::unique_ptr<const Scene> scene_;
};

}  // namespace groundray::python
