#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "apps/golden/report.h"
#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// How cases are run.
struct SuiteOptions {
  std::filesystem::path program;  ///< `groundray`
  std::filesystem::path out;      ///< folder for a folder of each case: its datasets and logs
  unsigned jobs = 1;              ///< cases at a time, at least 1
};

/// Makes the dataset of each case anew and holds it against what the case expects. A program that
/// fails, fails its case. Shows progress on standard error.
/// @return a section for each case, in order, whatever the number of jobs.
/// @throws Error if the folder cannot be written or the program not be started; Interrupted.
Report run_cases(const std::vector<GoldenCase>& cases, const SuiteOptions& options);

/// Stores what a case expects from now on, of its checks `exact` and `statistical`: the files of
/// one run, and mean and variance of `statistical_runs` runs with seeds of their own.
/// @throws Error if the case stores nothing, a run fails, or as write_whole; Interrupted.
void accept_case(const GoldenCase& golden, const SuiteOptions& options);

/// Writes the results as JUnit's XML: a test suite for each case, a test for each of its figures
/// that is held against something. @throws Error as write_whole.
void write_junit(const std::filesystem::path& path, const Report& report);

}  // namespace groundray::golden
