#pragma once

namespace groundray::testing {

/// Returns how many times as much CPU time this machine needs now for a fixed computation as the
/// machine for which the proofs' limits of time are stated: 1 to 4. Proofs multiply their limits by
/// it, so that they judge groundray and not the machine. Records it in the running test's results.
double slowness();

}  // namespace groundray::testing
