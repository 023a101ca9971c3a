#include "apps/view/layers/cut_out.h"

#include <algorithm>
#include <glm/common.hpp>

#include "apps/view/rendering/picture_file.h"
#include "core/image/image_io.h"

namespace groundray {
namespace {

constexpr int widest_mask_px = 1024, widest_atlas_px = 8192;

// Returns the image whose alpha or first channel cuts a surface out; null if none does.
const ModelImage* cutting_image(const ModelSurface& surface) {
  if (!(surface.least_alpha > 0)) return nullptr;
  if (surface.opacity.exists()) return &surface.opacity;
  return surface.albedo.exists() ? &surface.albedo : nullptr;
}

Image8 pixels_of(const ModelImage& image) {
  return image.file.empty() ? image.pixels : read_image8(image.file);
}

// Returns the alpha of each pixel of a mask no larger than `most_px`, 255 or 0; without pixels if
// the surface is not cut out.
Image8 mask_of(const ModelSurface& surface, int most_px) {
  const ModelImage* const image = cutting_image(surface);
  if (image == nullptr) return {};
  const Image8 pixels = pixels_of(*image);
  const bool has_alpha = pixels.channels() % 2 == 0;
  if (!has_alpha && image != &surface.opacity) return {};
  const auto channel = static_cast<std::size_t>(has_alpha ? pixels.channels() - 1 : 0);
  Image8 mask(std::min(pixels.width(), most_px), std::min(pixels.height(), most_px), 1);
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      const auto pixel = pixels.at((2 * x + 1) * pixels.width() / (2 * mask.width()),
                                   (2 * y + 1) * pixels.height() / (2 * mask.height()));
      const bool is_opaque = static_cast<float>(pixel[channel]) / 255.0f >= surface.least_alpha;
      mask.at(x, y)[0] = is_opaque ? 255 : 0;
    }
  }
  return mask;
}

}  // namespace

CutOuts::CutOuts(std::span<const Model* const> models) : models_(models.begin(), models.end()) {
  std::vector<std::pair<std::size_t, std::size_t>> cut;  // model and surface
  for (std::size_t i = 0; i < models.size(); ++i) {
    if (models[i]->uv.empty()) continue;
    for (std::size_t k = 0; k < models[i]->surfaces.size(); ++k) {
      if (cutting_image(models[i]->surfaces[k]) != nullptr) cut.emplace_back(i, k);
    }
  }
  if (cut.empty()) return;
  const int most_px =
      std::clamp(widest_atlas_px / static_cast<int>(cut.size()), 16, widest_mask_px);
  std::vector<Image8> masks;
  glm::ivec2 size_px(1, 1);  // the first column is opaque
  for (const auto& [model, surface] : cut) {
    masks.push_back(mask_of(models[model]->surfaces[surface], most_px));
    size_px = {size_px.x + masks.back().width(), std::max(size_px.y, masks.back().height())};
  }
  Image8 atlas(size_px.x, size_px.y, 4);
  std::ranges::fill(atlas.values(), std::uint8_t{255});
  int first_px = 1;
  for (std::size_t i = 0; i < cut.size(); ++i) {
    const Image8& mask = masks[i];
    if (mask.width() == 0) continue;
    for (int y = 0; y < mask.height(); ++y) {
      for (int x = 0; x < mask.width(); ++x) {
        // The mask's last row is the atlas' last row, at v = 0.
        atlas.at(first_px + x, size_px.y - mask.height() + y)[3] = mask.at(x, y)[0];
      }
    }
    places_[cut[i]] = {glm::dvec2(first_px, 0) / glm::dvec2(size_px),
                       glm::dvec2(mask.width(), mask.height()) / glm::dvec2(size_px)};
    first_px += mask.width();
  }
  if (places_.empty()) return;
  opaque_ = glm::vec2(0.5f / static_cast<float>(size_px.x), 0.5f);
  texture_ = make_mask(atlas);
}

std::optional<std::array<glm::vec2, 3>> CutOuts::corners(std::size_t model,
                                                         std::uint32_t triangle) const {
  const Model& of = *models_[model];
  const auto place = places_.find({model, of.surface_of[triangle]});
  if (place == places_.end()) return std::nullopt;
  constexpr double rounding = 1e-4;  // of coordinates that are stored as floats
  const glm::uvec3& corner = of.mesh.triangles[triangle];
  const std::array<glm::dvec2, 3> uv{of.uv[corner.x], of.uv[corner.y], of.uv[corner.z]};
  const glm::dvec2 low = glm::min(uv[0], glm::min(uv[1], uv[2]));
  const glm::dvec2 high = glm::max(uv[0], glm::max(uv[1], uv[2]));
  const glm::dvec2 repeat = glm::floor(low + rounding);
  if (high.x - repeat.x > 1 + rounding || high.y - repeat.y > 1 + rounding) return std::nullopt;
  std::array<glm::vec2, 3> places;
  for (std::size_t k = 0; k < 3; ++k)
    places[k] = place->second.first +
                glm::clamp(uv[k] - repeat, glm::dvec2(0), glm::dvec2(1)) * place->second.size;
  return places;
}

}  // namespace groundray
