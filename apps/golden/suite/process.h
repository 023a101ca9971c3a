#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace groundray::golden {

/// Runs a program to its end.
/// @param command  the program's path and its arguments.
/// @param log      file for what it says on standard output and standard error; replaced.
/// @return its exit code, or 128 and the number of the signal that ended it.
/// @throws Error if it cannot be started, or the log not be written.
int run_process(const std::vector<std::string>& command, const std::filesystem::path& log);

}  // namespace groundray::golden
