#pragma once

#include <filesystem>

#include "apps/golden/report.h"
#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// Checks a dataset against the expectations of its case. A missing or damaged file, or a formula
/// that cannot be evaluated, fails the check that needs it.
/// @param dataset  folder that `groundray generate` made from the case's scene.
Section check_case(const GoldenCase& golden, const std::filesystem::path& dataset);

}  // namespace groundray::golden
