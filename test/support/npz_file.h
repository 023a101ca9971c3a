#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace groundray::testing {

/// CRC-32 of PKWARE's APPNOTE, 4.4.7, bit by bit.
inline std::uint32_t crc32_of(std::string_view bytes) {
  std::uint32_t sum = 0xffffffffU;
  for (const char byte : bytes) {
    sum ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1U) ^ ((sum & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~sum;
}

/// Writes a NumPy archive without compression, as numpy.savez does.
/// @param arrays  name of each array, and its bytes in the .npy format.
inline void write_npz(const std::filesystem::path& path,
                      const std::vector<std::pair<std::string, std::string>>& arrays) {
  std::string bytes, directory;
  const auto put = [](std::string& to, std::uint64_t value, int count) {
    for (; count > 0; --count, value >>= 8U) to.push_back(static_cast<char>(value & 0xffU));
  };
  for (const auto& [array, content] : arrays) {
    const std::string name = array + ".npy";
    std::string facts;  // common to the local header and the directory
    put(facts, 20, 2);
    put(facts, 0, 8);
    put(facts, crc32_of(content), 4);
    put(facts, content.size(), 4);
    put(facts, content.size(), 4);
    put(facts, name.size(), 2);
    put(facts, 0, 2);
    put(directory, 0x02014b50, 4);
    put(directory, 20, 2);
    directory += facts;
    put(directory, 0, 10);
    put(directory, bytes.size(), 4);
    directory += name;
    put(bytes, 0x04034b50, 4);
    bytes += facts;
    bytes += name;
    bytes += content;
  }
  const std::size_t directory_at = bytes.size();
  bytes += directory;
  put(bytes, 0x06054b50, 4);
  put(bytes, 0, 4);
  put(bytes, arrays.size(), 2);
  put(bytes, arrays.size(), 2);
  put(bytes, directory.size(), 4);
  put(bytes, directory_at, 4);
  put(bytes, 0, 2);
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Returns an array of doubles in the .npy format, version 1.0.
inline std::string npy_of(const std::vector<double>& values, const std::string& shape) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': " + shape + ", }";
  header.resize((header.size() + 10 + 64) / 64 * 64 - 10 - 1, ' ');
  header += '\n';
  std::string bytes = std::string("\x93NUMPY\x01\0", 8);
  bytes.push_back(static_cast<char>(header.size() % 256));
  bytes.push_back(static_cast<char>(header.size() / 256));
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
  return bytes;
}

}  // namespace groundray::testing
