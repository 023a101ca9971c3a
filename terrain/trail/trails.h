#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <string_view>
#include <vector>

#include "terrain/trail/trail.h"

namespace groundray {

/// All trails of a scene, each over those before it. Immutable; any number of threads may query
/// them.
class Trails {
 public:
  /// @param dem         ground without trails, in D.
  /// @param origin_w_m  position of D in W.
  /// @param cell_m      size of the cells that will represent them.
  /// @throws Error as Trail.
  Trails(std::span<const TrailSpec> specs, const Trail::GroundHeight& dem, glm::dvec2 origin_w_m,
         double cell_m);

  std::span<const Trail> all() const noexcept { return trails_; }

  /// Returns the trail with a name.
  /// @throws Error if there is none.
  const Trail& named(std::string_view name) const;

  /// Returns the height of the ground with trails at `p` (D), metres; NaN if `dem_m` is.
  /// @param dem_m     height of the DEM's surface.
  /// @param relief_m  displacement by the relief.
  double height_m(glm::dvec2 p, double dem_m, double relief_m) const noexcept {
    Trail::Shape ground{dem_m, 1};
    for (const Trail& trail : trails_) trail.apply(p, ground);
    return ground.height_m + ground.relief_share * relief_m;
  }

  /// Returns a hash that identifies their shapes.
  std::uint64_t fingerprint() const noexcept;

 private:
  std::vector<Trail> trails_;
};

}  // namespace groundray
