#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/image.h"
#include "core/trajectory.h"

namespace groundray {

/// Writes a file so that it appears only when whole: `write` fills a temporary file beside `path`
/// (its name and
/// ".part"), which is then renamed; what was there before is replaced. One thread or process at a
/// time for a path.
/// @param write  reports a fault of the system by std::system_error, which becomes an Error.
/// @throws Error if the folder is not writable, the disk is full, or `path` is a folder or device;
/// and whatever else
///         `write` throws. Nothing is left behind.
void write_whole(const std::filesystem::path& path,
                 const std::function<void(const std::filesystem::path&)>& write);

/// Writes as a whole file the blocks of bytes that `next_block` returns, until it returns an empty
/// one. Each need last only until the next call. @throws Error as write_whole.
void write_blocks(const std::filesystem::path& path,
                  const std::function<std::string_view()>& next_block);

/// Writes `text` as a whole file. @throws Error as write_whole.
void write_text(const std::filesystem::path& path, std::string_view text);

/// Returns a file's bytes. @throws Error if it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// Writes an image of 1, 3 or 4 channels as 8-bit PNG: grey, RGB, or RGB and alpha.
/// @throws Error as write_whole, or for other channel counts.
void write_png(const std::filesystem::path& path, const Image8& image);

/// As above, of 16 bits a value: numbers, of which the file does not say what colours they are.
/// @throws Error likewise.
void write_png(const std::filesystem::path& path, const Image16& image);

/// Reads a trajectory in TUM form: lines of `t x y z qx qy qz qw`, seconds and metres; # begins a
/// comment. Times are read as decimals, exact to the nanosecond, within 4.6e9 s of zero.
/// Quaternions are set to norm 1: files often hold but four decimals, so a norm may be off by 1e-3.
/// @throws Error naming file, line and rule for each bad line (the first 100); Error of Trajectory
/// otherwise.
/// @see Sturm et al., A benchmark for the evaluation of RGB-D SLAM systems (2012).
Trajectory read_tum(const std::filesystem::path& path);

/// As read_tum, of a text already in memory; `name` stands for the file in messages.
Trajectory parse_tum(std::string_view text, const std::string& name);

/// Writes a trajectory in TUM form: seconds with 9 decimals, else 17 significant digits, so that
/// reading it back gives the same times and positions, and rotations up to rounding. The lines of
/// `comment` come first, if it is not empty.
/// @throws Error as write_whole.
void write_tum(const std::filesystem::path& path, const Trajectory& trajectory,
               std::string_view comment);

}  // namespace groundray
