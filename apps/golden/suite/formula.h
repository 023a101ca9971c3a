#pragma once

#include <string>
#include <vector>

#include "apps/golden/suite/columns.h"

namespace groundray::golden {

/// Returns a formula's value for each row. It is arithmetic over the names of columns and `pi`: + -
/// * / ^, comparisons, && || and a ? b : c, and sin cos tan asin acos atan atan2 exp ln log10 sqrt
/// cbrt hypot erf abs sign
/// floor rint mod (never negative) min max; angles are radians.
/// @throws Error that shows the formula and what in it is wrong.
std::vector<double> evaluate(const std::string& formula, const Columns& columns);

}  // namespace groundray::golden
