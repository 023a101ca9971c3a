#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/dataset/file_sum.h"

namespace groundray {

/// Returns in words what makes a file another one than it was, reading it through; nothing if it is
/// the same to the bit. Any number of threads may check.
std::optional<std::string> fault_of(const std::filesystem::path& file, const FileSum& as_written);

}  // namespace groundray
