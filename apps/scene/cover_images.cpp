#include "apps/scene/cover_images.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vector_relational.hpp>
#include <utility>

#include "core/appearance/seams.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "terrain/relief/relief.h"
#include "terrain/textures/ground_images.h"

namespace groundray {
namespace {

// Places copies of generated images where the relief that is made of them has its copies: pixel
// (0, 0) is centred on sample (0, 0).
glm::dvec2 corner_on_relief(const GroundImageSpec& spec, const Terrain& terrain, Tiling tiling) {
  const GridFrame& frame = terrain.frame();
  if (tiling == Tiling::Stochastic) {
    throw Error(
        "texture: 'tiling: stochastic' would move its colours off the relief that is generated "
        "likewise; use 'repeat', or another variant");
  }
  const glm::dvec2 period_m = glm::dvec2(terrain.relief()->period()) * glm::abs(frame.step_m);
  const glm::dvec2 copy_m = period_m / glm::max(glm::round(period_m / spec.size_m), 1.0);
  constexpr double most_shift = 1e-9;  // relative
  const bool fits =
      glm::all(glm::lessThan(glm::abs(copy_m / spec.size_m - 1.0), glm::dvec2(most_shift)));
  if (!fits || frame.step_m.x < 0 || frame.step_m.y > 0) {
    throw Error(
        "texture: it cannot be in register with the relief, whose period of {:g} x {:g} m has "
        "copies of {:g} x {:g} m instead of size_m = {:g}; choose a size_m of which a whole number "
        "fits that period",
        period_m.x, period_m.y, copy_m.x, copy_m.y, spec.size_m);
  }
  const double half_px = 0.5 / spec.pixels;
  return frame.origin_m - spec.size_m * glm::dvec2(half_px, 1 - half_px);
}

}  // namespace

std::optional<GroundTexture> CoverImages::texture(const std::optional<GroundTextureSpec>& spec) {
  if (!spec) return std::nullopt;
  GroundTexture texture{.size_m = spec->size_m};
  if (!spec->generated) {
    texture.tiling = spec->tiling.value_or(Tiling::Repeat);
    texture.albedo = load(*spec, spec->albedo, Encoding::Srgb);
    texture.normal = load(*spec, spec->normal, Encoding::Linear);
    return texture;
  }
  const GroundImageSpec& generated = *spec->generated;
  const bool is_relief = spec_.relief_ground == generated;
  texture.tiling = spec->tiling.value_or(is_relief ? Tiling::Repeat : Tiling::Stochastic);
  double shown_m = 0;
  if (is_relief) {
    texture.corner_m = corner_on_relief(generated, terrain_, texture.tiling);
    const glm::dvec2 cell_m = glm::abs(terrain_.frame().step_m);
    shown_m = std::max(cell_m.x, cell_m.y);
  }
  GroundImages images = make_ground_images(generated, shown_m);
  texture.albedo =
      std::make_shared<const Texture>(std::move(images.albedo), Encoding::Srgb, Wrap::Repeat);
  texture.normal =
      std::make_shared<const Texture>(std::move(images.normal), Encoding::Linear, Wrap::Repeat);
  memory_bytes_ += texture.albedo->memory_bytes() + texture.normal->memory_bytes();
  print_.add_all(generated.kind, generated.variant, generated.pixels, generated.size_m, shown_m);
  return texture;
}

void CoverImages::add(const Drape& drape) {
  print_.add_all(drape.corner_m, drape.size_m);
  add(drape.image);
}

std::shared_ptr<const Texture> CoverImages::load(const GroundTextureSpec& spec,
                                                 const std::filesystem::path& file,
                                                 Encoding encoding) {
  if (file.empty()) return nullptr;
  Image8 image = read_image8(file);
  if (spec.seamless) require_seamless(image, file.string());
  auto texture = std::make_shared<const Texture>(std::move(image), encoding, Wrap::Repeat);
  add(*texture);
  return texture;
}

void CoverImages::add(const Texture& texture) {
  memory_bytes_ += texture.memory_bytes();
  const glm::ivec2 size = texture.size();
  print_.add_all(size);
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) print_.add_all(texture.texel(0, column, row));
  }
}

}  // namespace groundray
