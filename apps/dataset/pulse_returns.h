#pragma once

#include "apps/scan/scan.h"
#include "reconstruction/scan/organised_scan.h"

namespace groundray {

/// Returns whether columns tell which returns are of one pulse (pulse, or else ring and time) and
/// which of them each is (return_index).
bool tells_returns(const Scan& scan);

/// Leaves one return of each pulse, in the order that they had; all of them, with a note if there
/// are others than first ones, where columns do not tell.
/// @throws Error naming the scan if the strongest is asked for, but there is no intensity.
void take_returns(ReturnChoice choice, Scan& scan);

}  // namespace groundray
