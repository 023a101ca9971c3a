#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace groundray {

/// Returns a file's bytes; of one whose name ends in .gz, what is packed in it.
/// @throws Error if it cannot be read, is damaged or cut short, or holds more than 4 GB.
std::string read_packed(const std::filesystem::path& path);

/// Returns what is packed by gzip, all of its members one after the other; `name` stands for it in
/// messages.
/// @throws Error as read_packed, or if something else follows.
std::string unpack(std::string_view packed, const std::string& name);

}  // namespace groundray
