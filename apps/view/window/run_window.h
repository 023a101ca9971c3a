#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/load_input.h"
#include "apps/view/rendering/view.h"

namespace groundray {

/// Initial state of the window.
struct WindowStart {
  std::vector<std::filesystem::path> inputs;
  OpenLimits limits{};
  std::optional<glm::dvec3> from_w_m{}, at_w_m{};  ///< default: as recommended for the inputs
  /// COLUMN for all layers that have it, or LAYER=COLUMN; default: each layer's own choice.
  std::vector<std::string> coloured_by{};
  std::vector<std::string> hidden{};  ///< layers by name, or all those under a name in the tree
  std::optional<double> point_size_px{};
  bool wireframe = false;  ///< true to draw surfaces as wireframes
  bool has_legend = true;
  /// File for recently opened files; empty: not stored (run_window() then sets one).
  std::filesystem::path settings{};
};

/// Shows the window until it is closed.
/// @param argc,argv  of the program; Qt removes the arguments that it uses.
/// @return the exit code.
/// @throws Error if there is no display.
int run_window(int& argc, char** argv, const WindowStart& start);

}  // namespace groundray
