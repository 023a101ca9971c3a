#pragma once

#include <filesystem>

namespace groundray {

/// Returns true if the header of a PLY file declares faces or triangle strips: a mesh, not a cloud.
/// False for any other file, and one that cannot be read.
bool has_faces(const std::filesystem::path& ply);

}  // namespace groundray
