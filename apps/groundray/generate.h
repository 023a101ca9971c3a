#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/dataset/shard.h"
#include "apps/groundray/record/dataset.h"
#include "core/random.h"

namespace groundray {

/// How a scene is to be run.
struct GenerateOptions {
  std::optional<Seed>
      seed;  ///< instead of the scene's own: another draw of noise and of scattering
  FolderUse use = FolderUse::New;
  std::optional<Shard> shard;  ///< of the frames; nothing for all of them
  std::string log;             ///< as of RunLog
};

/// Runs a scene and writes its dataset; says on standard output what was made, shows progress on
/// standard error. A frame is written while the next one is traced, so that two are in memory at
/// most. Frames made so far stay when it stops early, for a run with FolderUse::Resume.
/// @throws Error as load_world, Dataset and RunLog; Interrupted between two frames.
void generate(const std::filesystem::path& scene, const std::filesystem::path& out,
              const GenerateOptions& options);

}  // namespace groundray
