#pragma once

#include "core/random.h"
#include "terrain/lod/pass.h"

namespace groundray::testing {

/// A runner that calls a pass for its indices one by one, in an order that `seed` shuffles.
PassRunner shuffled_runner(Seed seed);

/// The runner that the applications use, on `count` threads.
PassRunner threaded_runner(int count);

}  // namespace groundray::testing
