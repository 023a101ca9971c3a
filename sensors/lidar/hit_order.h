#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/tracing/ray.h"

namespace groundray {

/// Lists the hits of a pulse's sub-rays by range; hits of equal range keep their order, and those
/// without a surface are omitted. There must be at least one sub-ray.
void sort_hits(std::span<const Hit> hits, std::vector<std::uint32_t>& order);

}  // namespace groundray
