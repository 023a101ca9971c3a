#pragma once

#include <filesystem>
#include <vector>

namespace groundray {

/// Reads every file of datasets through and holds it against what their dataset.yaml says; prints
/// each fault, and how much was checked. A dataset or a shard of which frames are missing yet, and
/// a file that is none of its own, are at fault as well.
/// @throws Error after all were checked, if any is at fault; Interrupted.
void verify(const std::vector<std::filesystem::path>& datasets);

}  // namespace groundray
