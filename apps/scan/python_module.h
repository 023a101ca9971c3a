#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace groundray {

/// Limits of a process.
struct ProcessLimits {
  double most_bytes = 64 << 20;   ///< of its output; more is a fault
  std::function<void()> check{};  ///< called some ten times a second; ends it by throwing
};

/// Runs a module of groundray's Python package in a process of its own: `python3 -P -m MODULE
/// WORD...`, without a shell. $GROUNDRAY_PYTHON names another interpreter, by path or by a name in
/// PATH. Thread-safe.
///
/// Libraries in Python read formats for which groundray has no reader of its own. A process keeps
/// their faults, and the memory that a hostile file makes them take, out of this one.
/// @param subject  the file that is read: begins messages. The words name it by absolute paths, so
///                 that none is mistaken for an option.
/// @return what the module prints on standard output.
/// @throws Error if there is no interpreter, or it lacks the package or one that the package needs,
///         with the command that installs it; and the module's own message if it fails.
std::string run_python_module(const std::string& module, const std::vector<std::string>& words,
                              const std::filesystem::path& subject,
                              const ProcessLimits& limits = {});

}  // namespace groundray
