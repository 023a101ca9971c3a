#pragma once

#include <filesystem>
#include <optional>

#include "apps/groundray/describe/facts.h"

namespace groundray {

/// Kinds of files that are recognised by their names.
enum class FileKind { Mesh, Cloud, Image, Bag };

/// Returns the kind of a file by the extension of its name, and of .ply by whether it has faces; a
/// folder with a metadata.yaml is a bag. Returns nothing for others.
std::optional<FileKind> file_kind_of(const std::filesystem::path& file);

/// Describes a mesh: its size, topology, attributes, surfaces and images.
/// @throws Error as read_mesh.
Facts mesh_facts(const std::filesystem::path& file);

/// Describes a file of points: its columns with their ranges, and the returns that a scan has.
/// @throws Error as read_cloud and scan_of.
Facts cloud_facts(const std::filesystem::path& file);

/// Describes an image: its size, and the range of each channel's values.
/// @throws Error as read_exr, read_image8 and read_image_f.
Facts image_facts(const std::filesystem::path& file);

/// Describes a ROS bag or MCAP file by groundray's Python package: its topics with their types and
/// numbers of messages, and the time that it spans.
/// @throws Error as run_python_module.
Facts bag_facts(const std::filesystem::path& file);

/// Describes a file of a kind.
/// @throws Error as the functions above.
Facts facts_of(const std::filesystem::path& file, FileKind kind);

}  // namespace groundray
