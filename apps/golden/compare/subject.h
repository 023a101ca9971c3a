#pragma once

#include <filesystem>

namespace groundray::golden {

/// What is compared.
enum class Subject { Scan, Image, Dem, Mesh };

/// Returns what a file holds, by the end of its name and, for PLY, whether it has faces.
/// @throws Error if that does not tell, with the option that does.
Subject subject_of(const std::filesystem::path& file);

/// Returns what two files hold, each as above; what the other's name does not tell is the
/// reference's.
/// @throws Error also if they hold different things.
Subject subject_of(const std::filesystem::path& reference, const std::filesystem::path& other);

}  // namespace groundray::golden
