#pragma once

#include <string>
#include <vector>

#include "apps/scan/command_text.h"

namespace groundray {

/// Returns a script that completes a program's command lines in bash.
/// @param names  names that the program knows, which complete arguments with FilesAndNames.
std::string bash_completion(const CommandText& program, const std::vector<std::string>& names);

/// Returns a script that completes a program's command lines in zsh, for a folder of its `fpath`.
/// @param names  as for bash_completion.
std::string zsh_completion(const CommandText& program, const std::vector<std::string>& names);

}  // namespace groundray
