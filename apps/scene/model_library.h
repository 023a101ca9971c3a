#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "apps/scene/fingerprint.h"
#include "apps/scene/palette.h"
#include "core/object_tracer.h"
#include "core/scene.h"
#include "sensors/world_spec.h"

namespace groundray {

/// The models of a scene: each is loaded once, however many entries show it, and every entry has
/// what it says of it.
class ModelLibrary {
 public:
  ModelLibrary(RayDevice device, Tracing tracing);

  /// Adds a model with a label and materials; returns its index among `models` and `truths`.
  /// @throws Error if it cannot be loaded, or a surface that `spec` names is not there or has no
  ///         material.
  std::uint32_t add(const ModelSpec& spec, std::uint16_t label, Palette& palette);

  std::vector<ModelScene> models() const;  ///< those from one source share it
  const std::vector<ModelTruth>& truths() const { return truths_; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(truths_.size()); }
  /// What was loaded, each shape once.
  const std::vector<ModelScene>& shapes() const { return shapes_; }
  /// Of vertices, triangles and images; the device knows of the rest.
  std::size_t memory_bytes() const;

  /// Adds all that tells these models from others.
  void add_to(Fingerprint& print) const;

 private:
  using Source = std::variant<AssetSpec, ModelSource>;
  std::uint32_t load(const Source& source);  // index of the shape

  RayDevice device_;
  Tracing tracing_;
  std::vector<Source> sources_;  // of the shapes
  std::vector<ModelScene> shapes_;
  std::vector<std::uint32_t> shape_of_;  // of each model
  std::vector<ModelTruth> truths_;
};

}  // namespace groundray
