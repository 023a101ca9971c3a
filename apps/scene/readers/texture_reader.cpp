#include <bit>
#include <cstdint>
#include <optional>

#include "apps/scene/readers/readers.h"

namespace groundray::yaml {
namespace {

constexpr Rule ground_size_rule{[](double value) { return value >= 0.5 && value <= 8; },
                                "must be from 0.5 to 8"};

// Words of `tiling`.
enum class TilingWord { Repeat, Seamless, Stochastic };

void read_tiling(Map& texture, GroundTextureSpec& spec) {
  TilingWord word{};
  const auto* const given =
      texture.read_choice("tiling", Need::Optional, word, {"repeat", "seamless", "stochastic"});
  if (given == nullptr) return;
  spec.tiling = word == TilingWord::Stochastic ? Tiling::Stochastic : Tiling::Repeat;
  spec.seamless = word != TilingWord::Repeat;
}

void read_texture_files(Map& texture, const fs::path& path, GroundTextureSpec& spec,
                        Faults& faults) {
  read_path(texture, "albedo", Need::Optional, path, spec.albedo);
  read_path(texture, "normal", Need::Optional, path, spec.normal);
  if (spec.albedo.empty() && spec.normal.empty() && texture.node().kind == Node::Kind::Map)
    faults.add(texture.node(), "texture", "must have 'albedo' or 'normal', or both, or 'generate'");
  texture.read_number("size_m", Need::Required, spec.size_m, positive);
}

}  // namespace

std::optional<GroundImageSpec> read_ground_image(Map& map, Faults& faults) {
  GroundImageSpec spec;
  const auto names = ground_image_names();
  bool is_valid = map.read_choice("generate", Need::Required, spec.kind,
                                  {names.begin(), names.end()}) != nullptr;
  map.read_whole("variant", Need::Optional, spec.variant);
  std::uint32_t pixels = static_cast<std::uint32_t>(spec.pixels);
  if (const Node* const at = map.read_whole("pixels", Need::Optional, pixels)) {
    if (pixels < 64 || pixels > 4096 || !std::has_single_bit(pixels)) {
      faults.add(*at, "pixels", "is {}, but must be a power of two from 64 to 4096", pixels);
      is_valid = false;
    }
    spec.pixels = static_cast<int>(pixels);
  }
  const bool has_size = map.find("size_m", Need::Optional) != nullptr;
  if (map.read_number("size_m", Need::Optional, spec.size_m, ground_size_rule) == nullptr)
    is_valid = is_valid && !has_size;
  return is_valid ? std::optional(spec) : std::nullopt;
}

std::optional<GroundTextureSpec> read_ground_texture(Map& map, const fs::path& path,
                                                     Faults& faults) {
  auto texture = map.map("texture", Need::Optional);
  if (!texture) return std::nullopt;
  GroundTextureSpec spec;
  if (texture->find("generate", Need::Optional) != nullptr) {
    spec.generated = read_ground_image(*texture, faults);
    if (spec.generated) spec.size_m = spec.generated->size_m;
  } else {
    read_texture_files(*texture, path, spec, faults);
  }
  read_tiling(*texture, spec);
  texture->close();
  return spec;
}

}  // namespace groundray::yaml
