#pragma once

namespace groundray::testing {

/// Number type of the oracles: 64 bits of mantissa on x86.
using Real = long double;

}  // namespace groundray::testing
