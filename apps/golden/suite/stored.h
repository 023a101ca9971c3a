#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// Returns the path of the file that a product must equal.
std::filesystem::path stored_file(const GoldenCase& golden, const std::string& product);

/// Returns the path of the EXR file with the mean and variance of a product.
std::filesystem::path stored_moments(const GoldenCase& golden, const std::string& product);

/// Stores present results as the expected ones of a case: the files of one run, and the moments of
/// `statistical_runs` runs.
/// @param run  makes the dataset with a given seed, or with the scene's own seed for 0, and returns
///             its folder, which the next call may replace.
/// @throws Error if there is nothing to store; as read_columns, Moments and write_whole.
void store(const GoldenCase& golden,
           const std::function<std::filesystem::path(std::uint64_t seed)>& run);

}  // namespace groundray::golden
