#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace groundray::golden {

/// Runs a program and waits until it ends.
/// @param command  the program's path and its arguments.
/// @param log  file for standard output and standard error; replaced.
/// @return its exit code, or 128 plus the number of the signal that ended it.
/// @throws Error if the program cannot be started or the log cannot be written.
int run_process(const std::vector<std::string>& command, const std::filesystem::path& log);

}  // namespace groundray::golden
