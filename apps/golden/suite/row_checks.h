#pragma once

#include "apps/golden/report.h"
#include "apps/golden/suite/columns.h"
#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// Checks each row's value against its formula; adds pictures if the rows are pixels. Infinite
/// values must be equal, and NaN never passes.
/// @throws Error as evaluate, or if there are no rows.
void check_rows(const RowsCheck& check, const std::string& because, const Columns& columns,
                Section& into);

/// Checks a statistic of all rows against a number.
/// @throws Error as evaluate; if a value is NaN, the tolerance is not finite, or, except for a
///         count, there are no rows.
void check_figure(const FigureCheck& check, const std::string& because, const Columns& columns,
                  Section& into);

}  // namespace groundray::golden
