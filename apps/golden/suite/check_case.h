#pragma once

#include <filesystem>

#include "apps/golden/report.h"
#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// Holds a dataset against what its case expects. A file that is missing or damaged, or a formula
/// that cannot be worked out, fails the check that needs it.
/// @param dataset  what `groundray generate` made of the case's scene.
Section check_case(const GoldenCase& golden, const std::filesystem::path& dataset);

}  // namespace groundray::golden
