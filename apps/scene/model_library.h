#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "apps/scene/fingerprint.h"
#include "apps/scene/palette.h"
#include "apps/scene/world_spec.h"
#include "core/tracing/object_tracer.h"
#include "core/tracing/scene.h"

namespace groundray {

/// Models of a scene: each source is loaded once for all entries that use it; labels and materials
/// belong to the entries.
class ModelLibrary {
 public:
  ModelLibrary(RayDevice device, Tracing tracing);

  /// Adds a model with a label and materials; returns its index in `models` and `truths`.
  /// @throws Error if it cannot be loaded, or a surface that `spec` names is missing or has no
  ///         material.
  std::uint32_t add(const ModelSpec& spec, std::uint16_t label, Palette& palette);

  std::vector<ModelScene> models() const;  ///< models of the same source share its shape
  const std::vector<ModelTruth>& truths() const { return truths_; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(truths_.size()); }
  /// Loaded shapes, each once.
  const std::vector<ModelScene>& shapes() const { return shapes_; }
  /// Bytes of vertices, triangles, images and textures; RayDevice::memory_bytes() counts the rest.
  std::size_t memory_bytes() const;

  /// Adds everything that distinguishes these models from others.
  void add_to(Fingerprint& print) const;

 private:
  using Source = std::variant<AssetSpec, ModelSource>;
  std::uint32_t load(const Source& source);  // returns the index of the shape

  RayDevice device_;
  Tracing tracing_;
  std::vector<Source> sources_;  // by shape
  std::vector<ModelScene> shapes_;
  std::vector<std::uint32_t> shape_of_;  // by model
  std::vector<ModelTruth> truths_;
};

}  // namespace groundray
