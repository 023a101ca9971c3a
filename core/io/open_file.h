#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

namespace groundray {

/// Deleter that closes a file of the C library.
struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};

/// File of the C library, closed by its owner's destructor.
using OwnedFile = std::unique_ptr<std::FILE, CloseFile>;

/// Creates an empty file for reading and writing. A file or link of its name is removed before;
/// links are not followed, so that no other file changes.
/// @return its descriptor, which the caller closes.
/// @throws std::system_error if it cannot be created: EEXIST in place of a folder, pipe or device.
int create_file(const std::filesystem::path& path);

/// Opens a regular file for reading: not a folder, pipe, socket or device, which may not end or
/// never begin.
/// @throws Error naming the file and the fault.
OwnedFile open_file(const std::filesystem::path& path);

/// Opens a regular file as a binary stream. For anything else, the stream has failed, and errno
/// says why: EISDIR for a folder, ESPIPE for a pipe, socket or device.
std::ifstream open_stream(const std::filesystem::path& path);

/// Returns in words why a file cannot be read, from the errno of the functions above.
std::string why_not_read(const std::filesystem::path& path, int fault);

/// Reads a line, without its end, as std::getline does; but a line of more than 64 MiB, as in a
/// file without line ends, ends the reading.
/// @return false at the end, or if reading fails.
bool next_line(std::istream& file, std::string& line);

}  // namespace groundray
