#pragma once

#include <filesystem>
#include <vector>

namespace groundray {

/// Reads every file of datasets and compares it with its entry in dataset.yaml; prints each fault,
/// and the number of files checked. Missing frames of a dataset or shard, and files that do not
/// belong to it, are faults as well.
/// @throws Error after all datasets have been checked, if any has a fault; Interrupted.
void verify(const std::vector<std::filesystem::path>& datasets);

}  // namespace groundray
