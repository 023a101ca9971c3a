#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/image.h"
#include "core/trajectory.h"

namespace groundray {

/// Writes a file so that it appears only when whole: `write` fills a temporary file beside `path`, which is then renamed.
/// @throws Error if the folder is not writable, the disk is full, or `write` throws; nothing is left behind.
void write_whole(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& write);

/// Writes `text` as a whole file. @throws Error as write_whole.
void write_text(const std::filesystem::path& path, std::string_view text);

/// Returns a file's bytes. @throws Error if it cannot be read.
std::string read_text(const std::filesystem::path& path);

/// Writes an image of 1, 3 or 4 channels as 8-bit PNG. @throws Error as write_whole, or for other channel counts.
void write_png(const std::filesystem::path& path, const Image8& image);

/// Writes a multi-channel float32 OpenEXR file, losslessly compressed.
/// @param channels  one name for each channel of `image`: "R", "G", "B", "Z", ...
/// @throws Error as write_whole, or if the names do not match the channels.
void write_exr(const std::filesystem::path& path, const ImageF& image, const std::vector<std::string>& channels);

/// Reads a trajectory in TUM form: lines of `t x y z qx qy qz qw`, seconds and metres; # begins a comment.
/// @throws Error naming file, line and rule for each bad line; Error of Trajectory otherwise.
Trajectory read_tum(const std::filesystem::path& path);

/// As read_tum, of a text already in memory; `name` stands for the file in messages.
Trajectory parse_tum(std::string_view text, const std::string& name);

/// Writes a trajectory in TUM form with 17 significant digits, so that reading it back gives the same numbers;
/// `comment` lines come first. @throws Error as write_whole.
void write_tum(const std::filesystem::path& path, const Trajectory& trajectory, std::string_view comment);

}  // namespace groundray
