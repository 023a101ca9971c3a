#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace groundray {

/// One field of a row of a NumPy array.
struct NpyField {
  std::string_view name;
  std::string_view type;  ///< in NumPy's notation: "<u4", "<f8"
};

/// Writes a one-dimensional array as a .npy file (NEP 1, version 1.0), which appears only when
/// complete.
/// @param fields  of a structured row, packed in this order; one field without a name makes a plain
///                array.
/// @param rows    number of rows in `bytes`, little-endian.
/// @throws Error as write_whole.
void write_npy(const std::filesystem::path& path, const std::vector<NpyField>& fields,
               std::size_t rows, std::span<const std::byte> bytes);

}  // namespace groundray
