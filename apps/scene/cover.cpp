#include "apps/scene/cover.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "apps/scene/fingerprint.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "terrain/dem/drape_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

constexpr int points_across = 256;  // side of the lattice for an orthophoto's means

// Loads images, and sums up their memory and fingerprint.
class Images {
 public:
  std::optional<GroundTexture> texture(const std::optional<GroundTextureSpec>& spec) {
    if (!spec) return std::nullopt;
    return GroundTexture{repeating(spec->albedo, Encoding::Srgb),
                         repeating(spec->normal, Encoding::Linear), spec->size_m};
  }
  std::shared_ptr<const Drape> keep(Drape drape) {
    print_.add_all(drape.corner_m, drape.size_m);
    add(drape.image);
    return std::make_shared<const Drape>(std::move(drape));
  }
  std::uint64_t fingerprint() const { return print_.value(); }
  std::size_t memory_bytes() const { return memory_bytes_; }

 private:
  std::shared_ptr<const Texture> repeating(const fs::path& file, Encoding encoding) {
    if (file.empty()) return nullptr;
    auto texture = std::make_shared<const Texture>(read_image8(file), encoding, Wrap::Repeat);
    add(*texture);
    return texture;
  }
  void add(const Texture& texture) {
    memory_bytes_ += texture.memory_bytes();
    const glm::ivec2 size = texture.size();
    print_.add_all(size);
    for (int row = 0; row < size.y; ++row) {
      for (int column = 0; column < size.x; ++column) print_.add_all(texture.texel(0, column, row));
    }
  }

  Fingerprint print_;
  std::size_t memory_bytes_ = 0;
};

CoverLayer load_layer(const CoverSpec& spec, const TerrainSpec& ground, const DemHeader& dem,
                      Palette& palette, Images& images) {
  CoverLayer layer{.material = palette.index_of(spec.material),
                   .label = spec.label.value_or(ground.label),
                   .slope_rad = spec.slope_rad,
                   .height_m = spec.height_m,
                   .mask = nullptr,
                   .texture = images.texture(spec.texture)};
  layer.height_m.low -= dem.origin_w_m.z;
  layer.height_m.high -= dem.origin_w_m.z;
  if (!spec.mask.empty()) {
    layer.mask = images.keep(
        load_mask(spec.mask, {spec.mask_full, spec.mask_nodata, dem.crs_wkt, dem.origin_w_m}));
  }
  return layer;
}

// Returns a lattice of points on the ground under an orthophoto.
std::vector<GroundCover::Point> points_under(const Drape& orthophoto, const Terrain& terrain) {
  const GridFrame& frame = terrain.frame();
  const glm::dvec2 a = frame.origin_m, b = frame.to_D(frame.samples - 1);
  const glm::dvec2 low = glm::max(orthophoto.corner_m, glm::min(a, b));
  const glm::dvec2 high = glm::min(orthophoto.corner_m + orthophoto.size_m, glm::max(a, b));
  if (!(low.x < high.x && low.y < high.y)) {
    throw Error(
        "it does not overlap the DEM: it covers ({:.1f}, {:.1f}) to ({:.1f}, {:.1f}) m from the "
        "DEM's origin; is its CRS correct?",
        orthophoto.corner_m.x, orthophoto.corner_m.y, orthophoto.corner_m.x + orthophoto.size_m.x,
        orthophoto.corner_m.y + orthophoto.size_m.y);
  }
  std::vector<GroundCover::Point> points;
  for (int row = 0; row < points_across; ++row) {
    for (int column = 0; column < points_across; ++column) {
      const glm::dvec2 p_D =
          glm::mix(low, high, (glm::dvec2(column, row) + 0.5) / static_cast<double>(points_across));
      const auto height_m = terrain.ground().height_m_at(p_D);
      const auto facet = terrain.ground().facet_at(p_D);
      if (height_m && facet) points.push_back({{p_D, *height_m}, frame.normal(*facet)});
    }
  }
  return points;
}

}  // namespace

LoadedCover load_cover(const TerrainSpec& spec, const Terrain& terrain, Palette& palette) {
  if (!spec.texture && spec.cover.empty() && spec.orthophoto.empty()) return {};
  const DemHeader& dem = terrain.header();
  Images images;
  std::vector<CoverLayer> layers{{.material = palette.index_of(spec.material),
                                  .label = spec.label,
                                  .mask = nullptr,
                                  .texture = images.texture(spec.texture)}};
  for (std::size_t i = 0; i < spec.cover.size(); ++i) {
    try {
      layers.push_back(load_layer(spec.cover[i], spec, dem, palette, images));
    } catch (const Error& fault) {
      throw Error("cover, layer {}: {}", i + 1, fault.what());
    }
  }
  std::shared_ptr<const Drape> orthophoto;
  std::vector<GroundCover::Point> points;
  if (!spec.orthophoto.empty()) {
    orthophoto = images.keep(load_orthophoto(spec.orthophoto, {dem.crs_wkt, dem.origin_w_m}));
    try {
      points = points_under(*orthophoto, terrain);
    } catch (const Error& fault) {
      throw Error("{}: {}", spec.orthophoto.string(), fault.what());
    }
  }
  return {GroundCover(std::move(layers), std::move(orthophoto), points), images.fingerprint(),
          images.memory_bytes()};
}

}  // namespace groundray
