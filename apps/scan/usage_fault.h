#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace groundray {

/// Parses a command line. Reports one that cannot be parsed, with the likely intention behind
/// unknown commands and options; or prints the help, the version, the manual page or the completion
/// script that was requested, for which it adds options. A program with commands that is called
/// without arguments prints what it is and can do.
/// @param app    its name is that of the program.
/// @param names  names that complete arguments of the type file_or_name.
/// @return the exit code with which the program has to end then: 2 or 0.
std::optional<int> parse_arguments(CLI::App& app, int count, const char* const* arguments,
                                   const std::function<std::vector<std::string>()>& names = {});

}  // namespace groundray
