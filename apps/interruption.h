#pragma once

namespace groundray {

/// Thrown where work stops because it was asked to.
struct Interrupted {};

/// From now on the first SIGINT or SIGTERM only asks for an orderly end; the second ends the
/// process as usual.
void catch_interruptions();

/// Whether an end has been asked for.
bool is_interrupted() noexcept;

/// @throws Interrupted if an end has been asked for.
void stop_if_interrupted();

}  // namespace groundray
