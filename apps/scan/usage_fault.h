#pragma once

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace groundray {

/// Reports a command line that cannot be parsed, with the likely intention behind unknown commands
/// and options; or prints the help or the version that was requested.
/// @return true if it was a request.
bool report_usage(const CLI::App& app, const CLI::ParseError& fault);

}  // namespace groundray
