#pragma once

#include <filesystem>
#include <string>

#include "apps/golden/report.h"
#include "apps/golden/suite/columns.h"

namespace groundray::golden {

/// Returns the C library, compiler and processor of this program, with a hash of values that the
/// library's functions return here. Files stored with the same text must match bit for bit.
std::string made_with();

/// Criterion for equality with stored values.
enum class Equal {
  Bits,   ///< equal values; NaN equals NaN
  Nearly  ///< for another C library: doubles to 1e-12 relative, floats equal or adjacent
};

/// Compares a product with a stored one, column by column.
/// @throws Error if the names of their columns or their sizes differ.
void check_equal(const Columns& columns, const Columns& stored, Equal equal,
                 const std::string& because, Section& into);

}  // namespace groundray::golden
