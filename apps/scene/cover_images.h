#pragma once

// Private to the library: images of the ground's cover.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "apps/scene/fingerprint.h"
#include "apps/scene/ground_spec.h"
#include "core/appearance/ground_cover.h"
#include "terrain/terrain.h"

namespace groundray {

/// Loads or generates images of the ground, and sums up their memory and fingerprint.
class CoverImages {
 public:
  CoverImages(const TerrainSpec& spec, const Terrain& terrain) : spec_(spec), terrain_(terrain) {}

  /// @throws Error as read_image8 and require_seamless, or if the images cannot be in register with
  ///         the relief that is made of them.
  std::optional<GroundTexture> texture(const std::optional<GroundTextureSpec>& spec);
  void add(const Drape& drape);

  std::uint64_t fingerprint() const { return print_.value(); }
  std::size_t memory_bytes() const { return memory_bytes_; }

 private:
  std::shared_ptr<const Texture> load(const GroundTextureSpec& spec,
                                      const std::filesystem::path& file, Encoding encoding);
  void add(const Texture& texture);

  const TerrainSpec& spec_;
  const Terrain& terrain_;
  Fingerprint print_;
  std::size_t memory_bytes_ = 0;
};

}  // namespace groundray
