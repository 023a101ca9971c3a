#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// The file that a product is held against, bit for bit.
std::filesystem::path stored_file(const GoldenCase& golden, const std::string& product);

/// The EXR file of mean and variance that a product is held against.
std::filesystem::path stored_moments(const GoldenCase& golden, const std::string& product);

/// What the stored files were made with, as made_with says it. @throws Error if that is missing.
std::string stored_made_with(const GoldenCase& golden);

/// Stores what a case expects from now on: the files of one run, and the moments of
/// `statistical_runs` runs.
/// @param run  makes the dataset of a seed of its own, or of the scene's own for 0, and returns its
///             folder, which may be replaced by the next one.
/// @throws Error if there is nothing to store; as read_columns, Moments and write_whole.
void store(const GoldenCase& golden,
           const std::function<std::filesystem::path(std::uint64_t seed)>& run);

}  // namespace groundray::golden
