#pragma once

#include <filesystem>
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
  std::optional<Look> look{};  ///< else where the inputs are best seen from
  std::string coloured_by{};   ///< a column, of all layers that have it; else what suits each
  bool wireframe = false;      ///< of what has triangles
};

/// Shows the window until it is closed.
/// @param argc,argv  of the program: what Qt understands of them is taken out.
/// @return the exit code. @throws Error if there is no display.
int run_window(int& argc, char** argv, const WindowStart& start);

}  // namespace groundray
