#pragma once

#include <filesystem>

namespace groundray::golden {

/// Kind of the compared files.
enum class Subject { Scan, Image, Dem, Mesh };

/// Returns the kind of a file by its extension and, for PLY, by whether it has faces.
/// @throws Error for an unknown extension; the message names the option --as.
Subject subject_of(const std::filesystem::path& file);

/// Returns the common kind of two files; an unknown extension of `other` is taken as the
/// reference's kind.
/// @throws Error as above, or if the kinds differ.
Subject subject_of(const std::filesystem::path& reference, const std::filesystem::path& other);

}  // namespace groundray::golden
