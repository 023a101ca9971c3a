#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace groundray {

/// Allocator that leaves new numbers uninitialised: a column is written once, by the code that
/// resized it.
template <typename T>
struct UnsetAllocator : std::allocator<T> {
  /// Rebinds the allocator to another type, as containers require.
  template <typename U>
  struct rebind {
    using other = UnsetAllocator<U>;
  };
  template <typename U>
  void construct(U* place) noexcept(std::is_nothrow_default_constructible_v<U>) {
    ::new (static_cast<void*>(place)) U;
  }
  template <typename U, typename... Args>
  void construct(U* place, Args&&... args) {
    ::new (static_cast<void*>(place)) U(std::forward<Args>(args)...);
  }
};

/// Table of points: named columns of equal length, each of one numeric type (structure of arrays).
class PointCloud {
 public:
  template <typename T>
  using Values = std::vector<T, UnsetAllocator<T>>;
  using AnyValues = std::variant<Values<float>, Values<double>, Values<std::uint8_t>,
                                 Values<std::uint16_t>, Values<std::uint32_t>, Values<std::int8_t>,
                                 Values<std::int16_t>, Values<std::int32_t>>;
  /// Named column with one number for each row.
  struct Column {
    std::string name;
    AnyValues values;
  };

  /// Constructs a table of `rows` rows and no columns.
  explicit PointCloud(std::size_t rows = 0) : rows_(rows) {}

  std::size_t rows() const { return rows_; }
  const std::vector<Column>& columns() const { return columns_; }

  /// Adds a column and returns its `rows()` values, uninitialised, to be filled. The span stays
  /// valid when further columns are added.
  /// @throws Error if a column of that name exists.
  template <typename T>
  std::span<T> add(std::string_view name) {
    return std::get<Values<T>>(add_values(name, Values<T>(rows_)));
  }

  /// Returns the values of the column `name`.
  /// @throws Error if there is no such column, or if it holds another type than T.
  template <typename T>
  std::span<const T> column(std::string_view name) const {
    const auto* values = std::get_if<Values<T>>(&find(name));
    if (values == nullptr) throw_type_mismatch(name);
    return *values;
  }

  bool has(std::string_view name) const;

  /// Removes all rows from index `rows` on.
  void truncate(std::size_t rows);

 private:
  AnyValues& add_values(std::string_view name, AnyValues values);
  const AnyValues& find(std::string_view name) const;
  [[noreturn]] static void throw_type_mismatch(std::string_view name);

  std::size_t rows_ = 0;
  std::vector<Column> columns_;
};

}  // namespace groundray
