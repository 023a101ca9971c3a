// Writes one square metre of each kind of generated ground for draw_ground_textures.py:
// OUT/<kind>.rgb, albedo (sRGB) and normal map, one after the other. See that file.
#include <fmt/format.h>

#include <cstddef>
#include <fstream>
#include <ios>
#include <string_view>

#include "terrain/textures/ground_images.h"

int main(int, char** arguments) {
  const auto names = groundray::ground_image_names();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto kind = static_cast<groundray::GroundImageKind>(i);
    const auto images = groundray::make_ground_images({.kind = kind, .pixels = 1024, .size_m = 1});
    std::ofstream file(fmt::format("{}/{}.rgb", arguments[1], names[i]), std::ios::binary);
    for (const groundray::Image8* const image : {&images.albedo, &images.normal}) {
      file.write(reinterpret_cast<const char*>(image->values().data()),
                 static_cast<std::streamsize>(image->values().size()));
    }
    fmt::print("{}\n", names[i]);
  }
}
