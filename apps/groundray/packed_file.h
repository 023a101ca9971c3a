#pragma once

#include <filesystem>
#include <string>

namespace groundray {

/// Returns a file's bytes; of one whose name ends in .gz, what is packed in it.
/// @throws Error if it cannot be read, is damaged or cut short, or holds more than 4 GB.
std::string read_packed(const std::filesystem::path& path);

}  // namespace groundray
