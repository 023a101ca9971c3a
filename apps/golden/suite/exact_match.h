#pragma once

#include <filesystem>
#include <string>

#include "apps/golden/report.h"
#include "apps/golden/suite/columns.h"

namespace groundray::golden {

/// The C library, compiler and processor of this program, with a print of what the library's
/// functions return here: stored files share their last bits.
std::string made_with();

/// Which values count as those that are stored.
enum class Equal {
  Bits,   ///< equal; NaN is NaN
  Nearly  ///< doubles to 1e-12 relative, floats equal or neighbours: of another C library
};

/// Holds a product against a stored one, column by column. @throws Error if they do not have the
/// same columns and rows.
void check_equal(const Columns& columns, const Columns& stored, Equal equal,
                 const std::string& because, Section& into);

}  // namespace groundray::golden
