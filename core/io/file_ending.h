#pragma once

#include <filesystem>
#include <string>

namespace groundray {

/// Returns the extension of a file's name in lower case, with its dot: ".ply" for "scan.PLY". Empty
/// if there is none.
std::string file_ending(const std::filesystem::path& path);

}  // namespace groundray
