#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "apps/dataset/run_part.h"
#include "apps/dataset/write/dataset_writer.h"
#include "core/random.h"

namespace groundray {

/// Options of a run.
struct GenerateOptions {
  std::optional<Seed> seed;            ///< replaces the scene's own, for other noise and scattering
  std::optional<std::uint32_t> world;  ///< one of the scene's worlds (docs/reference/sampling.md)
  FolderUse use = FolderUse::New;
  RunPart part;     ///< shard, or chosen sensors and frames; all by default
  std::string log;  ///< target, as for RunLog
};

/// Runs a scene and writes its dataset. Shows progress on standard error, and prints a summary on
/// standard output, or on standard error if the log is on standard output. If the run stops early,
/// finished frames stay for a run with FolderUse::Resume.
/// @throws Error as load_simulation, DatasetWriter, make_frames and RunLog; Interrupted between two
/// frames.
void generate(const std::filesystem::path& scene, const std::filesystem::path& out,
              const GenerateOptions& options);

}  // namespace groundray
