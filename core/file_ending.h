#pragma once

#include <filesystem>
#include <string>

namespace groundray {

/// Returns what a file's name ends in, with its dot and in small letters: ".ply" of "scan.PLY".
/// Empty if there is no dot.
std::string file_ending(const std::filesystem::path& path);

}  // namespace groundray
