#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

namespace groundray {

/// Writes a file so that it appears only when complete: `write` fills a temporary file next to
/// `path` (its name and ".part"), which is then renamed and replaces any existing file. Only one
/// thread or process at a time may write a path.
/// @param write  reports system errors by std::system_error, which is converted to Error.
/// @throws Error if the folder is not writable, the disk is full, or `path` is a folder or device;
///         and whatever else `write` throws. The temporary file is removed.
void write_whole(const std::filesystem::path& path,
                 const std::function<void(const std::filesystem::path&)>& write);

/// Writes a file, as write_whole does, from the blocks of bytes that `next_block` returns until it
/// returns an empty one. Each block need only stay valid until the next call.
/// @throws Error as write_whole.
void write_blocks(const std::filesystem::path& path,
                  const std::function<std::string_view()>& next_block);

/// Writes `text` to a file, as write_whole does.
/// @throws Error as write_whole.
void write_text(const std::filesystem::path& path, std::string_view text);

/// Returns a file's bytes.
/// @throws Error if it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// Returns the extension of a file's name in lower case, with its dot: ".ply" for "scan.PLY". Empty
/// if there is none.
std::string file_ending(const std::filesystem::path& path);

/// @throws Error unless the name ends in one of `endings`, in upper or lower case.
void check_ending(const std::filesystem::path& path, std::initializer_list<const char*> endings);

}  // namespace groundray
