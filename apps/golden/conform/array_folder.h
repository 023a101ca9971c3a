#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/io/npy_io.h"

namespace groundray::golden {

/// Returns the type of numbers in NumPy's notation: "<f4" for float.
template <typename T>
constexpr std::string_view npy_type() {
  if constexpr (std::is_same_v<T, float>) return "<f4";
  if constexpr (std::is_same_v<T, double>) return "<f8";
  if constexpr (std::is_same_v<T, std::int32_t>) return "<i4";
  if constexpr (std::is_same_v<T, std::uint32_t>) return "<u4";
  if constexpr (std::is_same_v<T, std::uint8_t>) return "|u1";
}

/// An array of a folder of passes; its file is NAME.npy.
struct ArrayEntry {
  std::string name;  ///< "level_00/key_m"
  std::string pass;  ///< that writes it; "input" for what passes read
  int level = -1;    ///< of the quadtree; -1 if it does not belong to one
  std::string unit;  ///< "m", or empty for plain numbers
  std::string type;  ///< in NumPy's notation
  std::vector<std::uint64_t> shape;
  std::string sha256;  ///< of its numbers, in C order
};

/// Numbers of an array and its shape.
template <typename T>
struct Numbers {
  std::vector<std::uint64_t> shape;
  std::vector<T> values;

  std::size_t rows() const { return shape.empty() ? 1 : shape[0]; }
};

/// Shape that an array must have; `any` matches every extent.
inline constexpr std::uint64_t any = ~std::uint64_t{0};

/// Folder of arrays as NPY, which is not trusted: files are regular and inside the folder, they
/// have the required type and shape, and no number is NaN.
class ArrayFolder {
 public:
  explicit ArrayFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& path() const { return folder_; }
  /// Returns the path of a file in the folder.
  /// @throws Error if it is missing, is no regular file, or leads out of the folder.
  std::filesystem::path file(const std::string& name) const;

  /// Reads an array.
  /// @param shape  that it must have.
  /// @param most   largest extent where `shape` has `any`.
  /// @param holes  whether numbers may be NaN.
  /// @throws Error naming the file and the rule that it breaks.
  template <typename T>
  Numbers<T> read(const std::string& name, const std::vector<std::uint64_t>& shape,
                  std::uint64_t most = 0, bool holes = false) const {
    RawNpy raw = read_raw(name, npy_type<T>(), shape, most, holes);
    Numbers<T> numbers{std::move(raw.shape), std::vector<T>(raw.bytes.size() / sizeof(T))};
    std::ranges::copy(std::as_bytes(std::span(raw.bytes)),
                      std::as_writable_bytes(std::span(numbers.values)).begin());
    return numbers;
  }
  /// Reads an array of any type.
  RawNpy read_raw(const std::string& name, std::string_view type,
                  const std::vector<std::uint64_t>& shape, std::uint64_t most = 0,
                  bool holes = false) const;

 private:
  std::filesystem::path folder_;
};

/// Writes arrays into a folder, and remembers their entries.
class ArrayWriter {
 public:
  explicit ArrayWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::vector<ArrayEntry>& entries() const { return entries_; }

  /// Writes an array. `entry` lacks the type and the sum.
  template <typename T>
  void write(ArrayEntry entry, std::span<const T> values) {
    entry.type = npy_type<T>();
    write_bytes(std::move(entry), std::as_bytes(values));
  }
  template <typename T>
  void write(ArrayEntry entry, const std::vector<T>& values) {
    write(std::move(entry), std::span<const T>(values));
  }

 private:
  void write_bytes(ArrayEntry entry, std::span<const std::byte> bytes);

  std::filesystem::path folder_;
  std::vector<ArrayEntry> entries_;
};

}  // namespace groundray::golden
