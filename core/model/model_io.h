#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "core/model/model.h"

namespace groundray {

/// Axis of a file that points up in O. The next axis in the cyclic order x, y, z, x points forward,
/// and the one after that to the left: nothing is mirrored and no coordinate is rounded.
enum class UpAxis { X, Y, Z };

/// Treatment of invalid parts of a model.
enum class BrokenParts { Refuse, Drop };

/// Options that override or complete a model's file.
struct ModelOptions {
  std::optional<double> metres_per_unit;  ///< default: 1
  std::optional<UpAxis> up;               ///< default: the file's, or Y for glTF, Z for others
  BrokenParts broken = BrokenParts::Refuse;
};

/// Numbers of invalid parts of a model, each counted once, by the first kind that applies.
struct ModelFaults {
  std::size_t out_of_range = 0;  ///< polygons with a vertex, uv or normal index out of range
  std::size_t not_finite = 0;  ///< polygons with a position or uv that is NaN, infinite or > 3.4e38
  std::size_t degenerate = 0;  ///< polygons and triangles without area
  std::size_t entangled = 0;   ///< polygons that intersect themselves or cannot be triangulated
  std::size_t total() const { return out_of_range + not_finite + degenerate + entangled; }
};

/// A model as read, and the numbers of omitted parts.
struct ModelFile {
  Model model;
  ModelFaults dropped;
  std::size_t skipped = 0;  ///< points, lines and curved patches, which a Model cannot represent
  /// Bound of the rounding error of each coordinate if positions came as floats, including that of
  /// nodes' transforms; 0 if they came as doubles.
  double rounding_m = 0;
};

/// Reads a model in the format of the file extension: .obj (with .mtl), .ply, .stl, .gltf or .glb.
/// Nodes' transforms are applied and polygons triangulated. Vertices that are equal in
/// position, uv and normal are merged, in the order in which triangles first refer to them. Unused
/// surfaces are omitted. Image files are located but not read; embedded images are decoded.
/// @throws Error if the file cannot be read or has no triangle; if an image or .mtl that it refers
///         to is missing; and, with BrokenParts::Refuse, if it has invalid parts, or if positions
///         that came as floats are coarser than both 1e-6 of the model's size and a micrometre.
/// @see docs/reference/models.md for the data read from each format.
ModelFile read_model(const std::filesystem::path& path, const ModelOptions& options);

/// Returns triangles in memory, in O, as a model of one surface, "default": equal to that of a .ply
/// file of the same vertices and triangles.
/// @param name  begins error messages.
/// @throws Error as read_model with BrokenParts::Refuse.
Model model_from(const TriangleMesh& mesh, const std::string& name);

}  // namespace groundray
