#pragma once

// Private to the library: the objects of each kind of ground.
#include <cmath>
#include <cstdint>

#include "terrain/textures/canvas.h"
#include "terrain/textures/dice.h"
#include "terrain/textures/noise.h"

namespace groundray::ground {

/// Parameters of the shade that is part of the albedo.
struct Finish {
  double shade_m = 0.005;   ///< height below its surroundings at which a point is dark
  double radius_m = 0.012;  ///< half the width of those surroundings
  double depth = 0.6;       ///< darkest shade, relative
};

/// Ground in the making.
struct Site {
  Canvas canvas;
  Dice dice;
  Field spots;  ///< fine noise that colours stones and leaves

  Site(int pixels, double size_m, std::uint64_t seed, const PassRunner& runner);
  Field noise(double longest_m, double shortest_m, double hurst = 0.8) {
    return ground::noise({longest_m, shortest_m, hurst}, canvas.side, canvas.size_m, dice.seed(),
                         canvas.runner);
  }
  glm::vec2 place() {
    const double x = dice.unit(), y = dice.unit();
    return glm::vec2(x, y) * static_cast<float>(canvas.side);
  }
  glm::vec2 direction();
  /// Returns the number of objects at a density.
  int count(double per_m2) const {
    return static_cast<int>(std::lround(per_m2 * canvas.area_m2()));
  }
};

Finish make_bare_soil(Site& site);
Finish make_mud(Site& site);
Finish make_gravel(Site& site);
Finish make_sand(Site& site);
Finish make_forest_litter(Site& site);
Finish make_moss(Site& site);
Finish make_short_grass(Site& site);
Finish make_dead_grass(Site& site);
Finish make_rock(Site& site);
Finish make_heath(Site& site);

}  // namespace groundray::ground
