#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/dataset/file_sum.h"

namespace groundray {

/// Reads a whole file and returns a description of its difference from `as_written`; nothing if
/// there is none. Any number of threads may call this.
std::optional<std::string> fault_of(const std::filesystem::path& file, const FileSum& as_written);

}  // namespace groundray
