#pragma once

#include <cstddef>
#include <cstdint>

#include "terrain/lod/pass.h"

namespace groundray {

/// Replaces counts by the sums of those before them, modulo 2^32; returns the total.
std::uint64_t sum_up(std::uint32_t* counts, std::size_t size, const PassRunner& runner);

}  // namespace groundray
