#pragma once

#include <filesystem>

#include "apps/golden/report.h"

namespace groundray::golden {

/// Judges what another mesher or tracer made of a folder of passes, in the classes that its
/// manifest.json claims (docs/guide/gpu.md). THEIRS is not trusted.
/// @param passes  folder that write_pass_folder has written.
/// @param theirs  folder with a manifest.json and arrays of the same names.
/// @throws Error naming the file and the rule that it breaks.
Report judge_conformity(const std::filesystem::path& passes, const std::filesystem::path& theirs);

}  // namespace groundray::golden
