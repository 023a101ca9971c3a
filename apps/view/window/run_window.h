#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/open.h"
#include "apps/view/view.h"

namespace groundray {

/// What the window begins with.
struct WindowStart {
  std::vector<std::filesystem::path> inputs;
  OpenLimits limits{};
  std::optional<glm::dvec3> from_w_m{}, at_w_m{};  ///< else as the inputs are best seen
  /// COLUMN of all layers that have it, or LAYER=COLUMN; else what suits each.
  std::vector<std::string> coloured_by{};
  std::vector<std::string> hidden{};  ///< layers by name, or what their names begin with
  std::optional<double> point_size_px{};
  bool wireframe = false;  ///< of what has triangles
  bool has_legend = true;
  std::filesystem::path settings{};  ///< where it keeps what was opened last; empty: nowhere
};

/// Shows the window until it is closed.
/// @param argc,argv  of the program: what Qt understands of them is taken out.
/// @return the exit code. @throws Error if there is no display.
int run_window(int& argc, char** argv, const WindowStart& start);

}  // namespace groundray
