#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/point_cloud.h"

/// Numbers as other people's point files hold them, and the columns that they become.
namespace groundray {

/// What the numbers of a column are.
enum class NumberType {
  Float16,
  Float32,
  Float64,
  Int8,
  Int16,
  Int32,
  Int64,
  UInt8,
  UInt16,
  UInt32,
  UInt64,
  Bool  ///< a byte
};

/// Which byte of a number comes first: the lowest, or the highest.
enum class ByteOrder { Little, Big };

/// Returns how many bytes one number takes.
std::size_t size_of(NumberType type);

/// Numbers at equal steps in memory.
struct NumberRun {
  const char* first = nullptr;
  std::size_t step_bytes = 0;
  NumberType type = NumberType::Float32;
  ByteOrder order = ByteOrder::Little;
};

/// What was taken off every value of a column.
struct ColumnOrigin {
  std::string column;
  std::int64_t origin = 0;
};

/// Adds a column of `cloud.rows()` numbers, bit for bit, but for those that PointCloud has no type
/// for: a Float16 becomes a float, a Bool a byte. Whole numbers of 64 bits become doubles: if some
/// are beyond 2^53, their least is taken off all and noted in `origins`, which is exact if they
/// spread over less than 2^53, such as stamps in nanoseconds; if they do not, they are rounded.
/// @throws Error if there is a column of that name.
void add_column(PointCloud& cloud, std::string_view name, const NumberRun& run,
                std::vector<ColumnOrigin>& origins);

}  // namespace groundray
