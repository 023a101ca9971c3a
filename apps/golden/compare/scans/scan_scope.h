#pragma once

#include <cstddef>

#include "apps/golden/compare/scans/scan_pairing.h"
#include "apps/golden/compare/scope.h"
#include "apps/scan/scan.h"

namespace groundray::golden {

/// Numbers of returns that a scope leaves out.
struct LeftOut {
  std::size_t outside_reference = 0, outside_other = 0;  ///< outside the box
  std::size_t ignored_reference = 0, ignored_other = 0;  ///< in the box, but too far away
};

/// Removes from `pairs` what a scope leaves out. The box is in the W of the reference's sensor
/// pose; both scans are placed there with it. A pair is in the box if the reference's return is. A
/// return is too far away if no return of the other scan is within the limit of distance, and a
/// pair if either of its returns is.
LeftOut leave_out(const Scan& reference, const Scan& other, const Scope& scope, Pairs& pairs);

}  // namespace groundray::golden
