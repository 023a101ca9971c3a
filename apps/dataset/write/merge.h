#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "apps/dataset/write/dataset_folder.h"

namespace groundray {

/// Numbers of frames and bytes of a merged dataset.
struct Merged {
  std::uint64_t frames = 0;
  std::uint64_t bytes = 0;  ///< size of its files, without dataset.yaml
};

/// Joins the shards of a run to the dataset that a single run would have made, bit for bit: copies
/// their files, and verifies each checksum on the way.
/// @param use  Resume keeps the files that an earlier merge into the folder has copied.
/// @throws Error if the shards are not all of one run, each given once and complete; if one of
///         their files has changed; or if the folder has other contents or cannot be written;
///         Interrupted.
Merged merge(const std::vector<std::filesystem::path>& shards, const std::filesystem::path& out,
             FolderUse use, const FolderMessages& messages = {});

}  // namespace groundray
