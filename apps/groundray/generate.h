#pragma once

#include <filesystem>

namespace groundray {

/// How a run ended.
enum class RunEnd { Done, Interrupted };

/// Runs a scene and writes its dataset; says on standard output what was made, shows progress on
/// standard error. Stops between two frames when the process gets SIGINT or SIGTERM; frames made so
/// far stay, and the same call goes on.
/// @throws Error as load_world and Dataset.
RunEnd generate(const std::filesystem::path& scene, const std::filesystem::path& out);

}  // namespace groundray
