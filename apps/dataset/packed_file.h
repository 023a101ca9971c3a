#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace groundray {

/// Returns a file's bytes, decompressed if its name ends in .gz.
/// @throws Error if it cannot be read, is damaged or cut short, or holds more than 4 GB.
std::string read_packed(const std::filesystem::path& path);

/// Decompresses all members of gzip data and returns them concatenated. `name` identifies the data
/// in messages.
/// @throws Error as read_packed, or if other data follow the last member.
std::string unpack(std::string_view packed, const std::string& name);

}  // namespace groundray
