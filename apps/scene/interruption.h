#pragma once

#include <cstdint>
#include <cstdio>
#include <optional>

#include "core/progress.h"

namespace groundray {

/// Exception that stops work on request.
struct Interrupted {};

/// Installs signal handlers: the first SIGINT, SIGTERM or SIGHUP only requests an orderly end; the
/// second ends the process as usual.
void catch_interruptions();

/// Returns true if an end has been requested.
bool is_interrupted() noexcept;

/// Stops work if an end has been requested.
/// @throws Interrupted in that case.
void stop_if_interrupted();

/// Progress display for the certification of a terrain; shows nothing if there is none. Stops the
/// certification on interruption.
class Certifying {
 public:
  void update(double share) {
    stop_if_interrupted();
    constexpr std::uint64_t steps = 1000;
    if (!progress_) progress_.emplace(stderr, "certifying the terrain, per mille", steps);
    progress_->update(static_cast<std::uint64_t>(share * steps));
  }

 private:
  std::optional<Progress> progress_;
};

}  // namespace groundray
