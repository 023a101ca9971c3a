#pragma once

#include <filesystem>
#include <optional>

#include "core/random.h"

namespace groundray {

/// Runs a scene and writes its dataset; says on standard output what was made, shows progress on
/// standard error. Frames made so far stay when it stops early, and the same call goes on.
/// @throws Error as load_world and Dataset; Interrupted between two frames.
/// @param seed  instead of the scene's own: another draw of its noise and of its scattered things.
void generate(const std::filesystem::path& scene, const std::filesystem::path& out,
              std::optional<Seed> seed);

}  // namespace groundray
