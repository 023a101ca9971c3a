#pragma once

#include <filesystem>

namespace groundray {

/// Runs a scene and writes its dataset; says on standard output what was made, shows progress on
/// standard error. Frames made so far stay when it stops early, and the same call goes on.
/// @throws Error as load_world and Dataset; Interrupted between two frames.
void generate(const std::filesystem::path& scene, const std::filesystem::path& out);

}  // namespace groundray
