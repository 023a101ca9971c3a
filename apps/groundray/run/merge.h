#pragma once

#include <filesystem>
#include <vector>

#include "apps/groundray/record/dataset_writer.h"

namespace groundray {

/// Joins the shards of a run to the dataset that a single run would have made, bit for bit: copies
/// their files, and verifies each checksum on the way. Prints a summary, and shows progress on
/// standard error.
/// @param use  Resume keeps the files that an earlier merge into the folder has copied.
/// @throws Error if the shards are not all of one run, each given once and complete; if one of
///         their files has changed; or if the folder has other contents or cannot be written;
///         Interrupted.
void merge(const std::vector<std::filesystem::path>& shards, const std::filesystem::path& out,
           FolderUse use);

}  // namespace groundray
