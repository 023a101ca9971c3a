#pragma once

#include <optional>

namespace CLI {
class App;
}  // namespace CLI

namespace groundray {

/// Parses a command line. Reports one that cannot be parsed, with the likely intention behind
/// unknown commands and options; or prints the help or the version that was requested.
/// @return the exit code with which the program has to end then: 2 or 0.
std::optional<int> parse_arguments(CLI::App& app, int count, const char* const* arguments);

}  // namespace groundray
