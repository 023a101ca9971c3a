#pragma once

namespace groundray {

/// Exception that stops work on request.
struct Interrupted {};

/// Installs signal handlers: the first SIGINT or SIGTERM only requests an orderly end; the second
/// ends the process as usual.
void catch_interruptions();

/// Returns true if an end has been requested.
bool is_interrupted() noexcept;

/// Stops work if an end has been requested.
/// @throws Interrupted in that case.
void stop_if_interrupted();

}  // namespace groundray
