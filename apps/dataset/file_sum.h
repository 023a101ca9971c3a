#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace groundray {

/// Size and checksum that identify the contents of a file.
struct FileSum {
  std::uint64_t bytes = 0;
  std::string sha256;  ///< 64 hexadecimal digits, as sha256sum prints them
  friend bool operator==(const FileSum&, const FileSum&) = default;
};

/// Incremental SHA-256.
/// @see FIPS 180-4, Secure Hash Standard (2015).
class Sha256 {
 public:
  Sha256();

  void add(std::string_view bytes);
  /// Returns the 64 hexadecimal digits for all bytes added so far.
  std::string digits() const;

 private:
  std::unique_ptr<evp_md_ctx_st, void (*)(evp_md_ctx_st*)> context_;  // of OpenSSL
};

/// Returns the SHA-256 of bytes in memory, as Sha256::digits.
std::string sha256_of(std::string_view bytes);

/// Reads a whole file and returns its size and checksum.
/// @throws Error if it cannot be read.
FileSum sum_file(const std::filesystem::path& path);

/// Reads a whole file and returns a description of its difference from `as_written`; nothing if
/// there is none. Any number of threads may call this.
std::optional<std::string> fault_of(const std::filesystem::path& file, const FileSum& as_written);

}  // namespace groundray
