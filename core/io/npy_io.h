#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/io/number_column.h"
#include "core/io/point_cloud.h"

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

/// Writes an array of any shape in C order, as write_npy.
/// @param type  of its numbers, in NumPy's notation.
void write_npy(const std::filesystem::path& path, std::string_view type,
               std::span<const std::uint64_t> shape, std::span<const std::byte> bytes);

/// Plain array as stored, in C order.
struct RawNpy {
  NumberType type = NumberType::Float32;
  ByteOrder order = ByteOrder::Little;
  std::vector<std::uint64_t> shape;
  std::string bytes;
};

/// Reads an array of numbers of any shape, but not a structured one.
/// @throws Error as read_npy, or if the array is structured.
RawNpy read_raw_npy(const std::filesystem::path& path);

/// NumPy array as a table. A structured array has one column for each field, with the field's name;
/// a field of several numbers becomes columns with the suffixes `_0`, `_1`, .... A plain array of
/// shape (n,) or () has one column with an empty name, and one of shape (..., k) has k columns
/// named 0 to k - 1; the other axes are the rows, in C order.
struct NpyArray {
  std::string name;                  ///< name in the archive, without ".npy"; else empty
  std::vector<std::uint64_t> shape;  ///< as stored in the file
  bool is_structured = false;
  PointCloud cloud{};
  std::vector<ColumnOrigin> origins;  ///< constants to add to columns of 64-bit integers
  std::vector<std::string> unread;    ///< fields that do not hold numbers: texts, complex numbers
};

/// Arrays of an archive, and the members that do not hold numbers.
struct NpzFile {
  std::vector<NpyArray> arrays;
  std::vector<std::pair<std::string, std::string>> unread;  ///< name and reason
};

/// Reads an array of numbers in any byte order, and in C or Fortran order; format versions 1 to 3.
/// @throws Error naming the file if it is not a NumPy array, is truncated, or does not hold
///         numbers.
/// @see NumPy Enhancement Proposal 1: a simple file format for NumPy arrays.
NpyArray read_npy(const std::filesystem::path& path);

/// Parses bytes in memory as read_npy does; `name` is the file name in error messages.
NpyArray parse_npy(std::string_view bytes, const std::string& name);

/// Reads an archive written by numpy.savez or numpy.savez_compressed; the arrays keep its order.
/// @throws Error naming file and member if it is damaged.
NpzFile read_npz(const std::filesystem::path& path);

/// Parses bytes in memory as read_npz does; `name` is the file name in error messages.
NpzFile parse_npz(std::string_view bytes, const std::string& name);

}  // namespace groundray
