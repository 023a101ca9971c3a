#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "core/model.h"

namespace groundray {

/// Which axis of a file points up in O. The next one of x, y, z, x points forward and the one after
/// that to the left: nothing is mirrored and no coordinate is rounded.
enum class UpAxis { X, Y, Z };

/// What to do with parts of a model that are no surface.
enum class BrokenParts { Refuse, Drop };

/// What to do with a model beyond what its file says.
struct ModelOptions {
  std::optional<double> metres_per_unit;  ///< else what the file says: 1 where it says nothing
  std::optional<UpAxis> up;  ///< else what the file says: Y for glTF, Z where it says nothing
  BrokenParts broken = BrokenParts::Refuse;
};

/// Parts of a model that are no surface, each counted once, by the first that applies.
struct ModelFaults {
  std::size_t out_of_range = 0;  ///< polygons that name a vertex that is not there
  std::size_t not_finite = 0;    ///< polygons with a position or uv that is NaN, infinite or > 3e38
  std::size_t degenerate = 0;    ///< polygons and triangles without an area
  std::size_t entangled = 0;  ///< polygons that cross themselves, so that triangles cannot be cut
  std::size_t total() const { return out_of_range + not_finite + degenerate + entangled; }
};

/// A model as read, and what was left out.
struct ModelFile {
  Model model;
  ModelFaults dropped;
  std::size_t skipped = 0;  ///< points, lines and curved patches, which no Model can hold
  /// Positions may differ by this much along each axis from those that the file spells or means,
  /// for they came as floats; 0 where they came as doubles.
  double rounding_m = 0;
};

/// Reads a model in the form that the name's end says: .obj (with .mtl), .ply, .stl, .gltf, .glb or
/// .dae. Nodes' transforms are applied, polygons cut into triangles, and vertices joined that are
/// equal in position, uv and normal, in the order in which triangles first name them. Surfaces
/// that no triangle has are left out. Images are sought, not read, but for those inside the file.
/// @throws Error if the file cannot be read or has no triangle; if an image or .mtl that it names
///         is missing; and, with BrokenParts::Refuse, if it has broken parts, or if positions that
///         came as floats are coarser than both 1e-6 of the model's size and a micrometre.
/// @see docs/models.md for what is read of each form.
ModelFile read_model(const std::filesystem::path& path, const ModelOptions& options);

}  // namespace groundray
