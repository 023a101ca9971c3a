#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "apps/scene/fingerprint.h"
#include "apps/scene/scene_spec.h"
#include "core/appearance/materials.h"
#include "core/tracing/object_tracer.h"
#include "core/tracing/scene.h"

namespace groundray {

/// Numbered list of the distinct materials of a scene. A surface without a material gets the
/// built-in material of its name. In a scene without lasers and cameras, all numbers are 0.
class Palette {
 public:
  explicit Palette(const SceneSpec& spec);

  /// Returns the number of a surface's material.
  /// @throws Error if it has none, or its spectrum lacks a laser's wavelength or, for cameras, a
  ///         part of the visible range.
  std::uint16_t index_of(const ModelSpec& model, const ModelSurface& worn);
  /// Returns the number of a material of the ground; 0 if there is none.
  /// @throws Error as for a surface.
  std::uint16_t index_of(const std::optional<Material>& material);

  Materials take() { return Materials(std::move(all_)); }

 private:
  bool is_asked_for() const { return are_colours_seen_ || !wavelengths_nm_.empty(); }
  std::uint16_t add(const Material& material);

  std::vector<double> wavelengths_nm_;  // of the lasers
  bool are_colours_seen_ = false;       // true if there are cameras
  std::vector<Material> all_;
};

/// Models of a scene: each source is loaded once for all entries that use it; labels and materials
/// belong to the entries.
class ModelLibrary {
 public:
  ModelLibrary(RayDevice device, Tracing tracing);

  /// Adds a model with a label and materials; returns its index in `models` and `truths`.
  /// @throws Error if it cannot be loaded, or a surface that `spec` names is missing or has no
  ///         material.
  std::uint32_t add(const ModelSpec& spec, std::uint16_t label, Palette& palette);
  /// Adds all parts of an asset that walks, with consecutive indices; returns the first.
  /// @throws Error as add.
  std::uint32_t add_parts(const ModelSpec& spec, std::uint16_t label, Palette& palette);

  /// Returns a model by its index.
  const Model& model(std::uint32_t index) const { return shapes_[shape_of_[index]].model(); }
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
  using Source = ModelSpec::Source;
  std::uint32_t load(const Source& source);  // returns the index of the shape
  std::uint32_t add_all(const ModelSpec& spec, std::span<const Source> sources, std::uint16_t label,
                        Palette& palette);

  RayDevice device_;
  Tracing tracing_;
  std::vector<Source> sources_;  // by shape
  std::vector<ModelScene> shapes_;
  std::vector<std::uint32_t> shape_of_;  // by model
  std::vector<ModelTruth> truths_;
};

}  // namespace groundray
