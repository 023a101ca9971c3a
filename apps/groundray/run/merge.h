#pragma once

#include <filesystem>
#include <vector>

#include "apps/groundray/record/dataset.h"

namespace groundray {

/// Joins the shards of a run to the dataset that one run would have made, to the bit: copies their
/// files, each held against its checksum on the way. Prints what was done, shows progress on
/// standard error.
/// @param use  Resume keeps what an earlier merge into the folder has copied already.
/// @throws Error if the shards are not all of one run, each there once and complete, a file of
/// theirs has changed, or the folder holds anything else or cannot be written; Interrupted.
void merge(const std::vector<std::filesystem::path>& shards, const std::filesystem::path& out,
           FolderUse use);

}  // namespace groundray
