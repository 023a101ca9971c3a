#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "apps/golden/report.h"
#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// Options for running cases.
struct SuiteOptions {
  std::filesystem::path program;  ///< path of `groundray`
  std::filesystem::path out;      ///< folder with one folder of datasets and logs per case
  unsigned jobs = 1;              ///< concurrent cases, at least 1
};

/// Generates the dataset of each case and checks it against the expectations. A failed run of the
/// program fails its case. Shows progress on standard error.
/// @return one section per case, in the order of `cases` for any number of jobs.
/// @throws Error if the folder cannot be written or is in use, or the program cannot be started;
///         Interrupted.
Report run_cases(const std::vector<GoldenCase>& cases, const SuiteOptions& options);

/// Stores present results as the expected ones of a case, for its checks `exact` and `statistical`:
/// the files of one run, and the mean and variance of `statistical_runs` runs with different seeds.
/// @throws Error if the case has no such check, a run fails, or as write_whole; Interrupted.
void accept_case(const GoldenCase& golden, const SuiteOptions& options);

/// Writes the results as JUnit XML: one test suite per case, one test per figure with a verdict.
/// @throws Error as write_whole.
void write_junit(const std::filesystem::path& path, const Report& report);

}  // namespace groundray::golden
