#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/number_column.h"
#include "core/point_cloud.h"

namespace groundray {

/// A NumPy array as a table. A structured one has a column for each field, of the field's name (and
/// `_0`, `_1`, ... if it holds several numbers). A plain one of shape (n,) or () has one column,
/// and one of shape (..., k) has k columns named 0 to k - 1; earlier axes run in C's order.
struct NpyArray {
  std::string name;                  ///< in an archive, without ".npy"; else empty
  std::vector<std::uint64_t> shape;  ///< as NumPy says it
  bool is_structured = false;
  PointCloud cloud{};
  std::vector<ColumnOrigin> origins;  ///< what is to be added to columns of 64-bit whole numbers
  std::vector<std::string> unread;    ///< fields of no number: texts, complex numbers
};

/// The arrays of an archive, and those that hold no numbers.
struct NpzFile {
  std::vector<NpyArray> arrays;
  std::vector<std::pair<std::string, std::string>> unread;  ///< name and why
};

/// Reads an array of numbers of any byte order, in C's order or Fortran's; versions 1 to 3.
/// @throws Error naming the file if it is no such file, is cut short, or holds no numbers.
/// @see NumPy Enhancement Proposal 1: a simple file format for NumPy arrays.
NpyArray read_npy(const std::filesystem::path& path);

/// As read_npy, of bytes already in memory; `name` stands for the file in messages.
NpyArray parse_npy(std::string_view bytes, const std::string& name);

/// Reads an archive as numpy.savez and numpy.savez_compressed write it, in its order.
/// @throws Error naming file and member if it is damaged.
NpzFile read_npz(const std::filesystem::path& path);

/// As read_npz, of bytes already in memory; `name` stands for the file in messages.
NpzFile parse_npz(std::string_view bytes, const std::string& name);

}  // namespace groundray
