#pragma once

#include <string>
#include <vector>

#include "apps/golden/suite/columns.h"

namespace groundray::golden {

/// Evaluates a formula for each row: arithmetic over the names of columns and `pi` with + - * / ^,
/// comparisons, && || and a ? b : c, and the functions sin cos tan asin acos atan atan2 exp ln
/// log10 sqrt cbrt hypot erf abs sign floor rint mod (never negative for a positive divisor) min
/// max; angles are in radians.
/// @throws Error that quotes the formula and states the fault.
std::vector<double> evaluate(const std::string& formula, const Columns& columns);

}  // namespace groundray::golden
