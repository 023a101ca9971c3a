#pragma once

#include "apps/golden/report.h"
#include "apps/golden/suite/columns.h"
#include "apps/golden/suite/golden_case.h"

namespace groundray::golden {

/// Holds each row's value against its formula; pictures show them if the rows are pixels. An
/// infinite value must be equal, and NaN passes nothing. @throws Error as evaluate; if there is no
/// row.
void check_rows(const RowsCheck& check, const std::string& because, const Columns& columns,
                Section& into);

/// Holds a figure of all rows against a number. @throws Error as evaluate; if there is no row, or
/// one whose value is NaN.
void check_figure(const FigureCheck& check, const std::string& because, const Columns& columns,
                  Section& into);

}  // namespace groundray::golden
