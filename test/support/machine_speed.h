#pragma once

namespace groundray::testing {

/// Returns how many times as much CPU time this machine needs now for a fixed computation as the
/// machine for which the proofs' limits of time are stated; at least 1. Proofs multiply their
/// limits by it, so that they judge groundray and not the machine.
double slowness();

}  // namespace groundray::testing
