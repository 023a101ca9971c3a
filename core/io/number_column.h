#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/io/point_cloud.h"

/// Numbers as stored in third-party point files, and their conversion to PointCloud columns.
namespace groundray {

/// Type of the numbers of a column.
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
  Bool  ///< one byte
};

/// Byte order of a number: the least or the most significant byte first.
enum class ByteOrder { Little, Big };

/// C++ types of the NumberTypes, in their order; a Float16 is held as its bits, a Bool as a byte.
using NumberTypes =
    std::tuple<std::uint16_t, float, double, std::int8_t, std::int16_t, std::int32_t, std::int64_t,
               std::uint8_t, std::uint16_t, std::uint32_t, std::uint64_t, std::uint8_t>;

/// Returns f(T()) for the C++ type T of `type`.
template <std::size_t I = 0, typename F>
auto with_number_type(NumberType type, const F& f) {
  if constexpr (I + 1 < std::tuple_size_v<NumberTypes>) {
    if (static_cast<std::size_t>(type) != I) return with_number_type<I + 1>(type, f);
  }
  return f(std::tuple_element_t<I, NumberTypes>());
}

/// Returns the size of one number, bytes.
std::size_t size_of(NumberType type);

/// Returns the type of a kind, in NumPy's notation f, i, u or b, and size; nothing if there is
/// none.
std::optional<NumberType> number_type_of(char kind, std::size_t bytes);

/// Numbers at a constant stride in memory.
struct NumberRun {
  const char* first = nullptr;
  std::size_t step_bytes = 0;
  NumberType type = NumberType::Float32;
  ByteOrder order = ByteOrder::Little;
};

/// Constant that was subtracted from all values of a column.
struct ColumnOrigin {
  std::string column;
  std::int64_t origin = 0;
};

/// Adds a column of `cloud.rows()` numbers, bit for bit where PointCloud has their type. A Float16
/// becomes a float, a Bool one byte. 64-bit integers become doubles. If some of them lie beyond
/// 2^53 and all span at most 2^53, as time stamps in nanoseconds do, the smallest is subtracted
/// from all and recorded in `origins`, which is exact. If they span more, they are rounded.
/// @throws Error if a column of that name exists.
void add_column(PointCloud& cloud, std::string_view name, const NumberRun& run,
                std::vector<ColumnOrigin>& origins);

}  // namespace groundray
