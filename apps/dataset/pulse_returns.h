#pragma once

#include "apps/scan/scan.h"
#include "reconstruction/mesh/scan/organised_scan.h"

namespace groundray {

/// Returns true if columns identify the pulse of each return (pulse, or else ring and time) and its
/// number within the pulse (return_index).
bool tells_returns(const Scan& scan);

/// Keeps one return per pulse, in the original order. If no columns identify the pulses, keeps all
/// returns, and adds a note unless all are first returns.
/// @throws Error naming the scan if the strongest return is requested, but there is no intensity.
void take_returns(ReturnChoice choice, Scan& scan);

}  // namespace groundray
