#pragma once

#include <filesystem>
#include <vector>

#include "apps/view/load_input.h"
#include "apps/view/rendering/offscreen_render.h"

namespace groundray {

/// Initial state of the window.
struct WindowStart {
  std::vector<std::filesystem::path> inputs;
  OpenLimits limits{};
  ViewOptions view{};
  /// File for recently opened files; empty: not stored (run_window() then sets one).
  std::filesystem::path settings{};
};

/// Shows the window until it is closed.
/// @param argc,argv  of the program; Qt removes the arguments that it uses.
/// @return the exit code.
/// @throws Error if there is no display.
int run_window(int& argc, char** argv, const WindowStart& start);

}  // namespace groundray
