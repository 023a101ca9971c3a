#include "apps/scene/model_library.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>

#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/simulation.h"
#include "core/appearance/material.h"
#include "core/appearance/materials.h"
#include "core/appearance/spectrum.h"

namespace groundray::model_library_test {
namespace {

Spectrum spectrum_of(std::string_view material) {
  const Material read =
      load_material(data_folder() / "materials" / (std::string(material) + ".yaml"));
  return std::get<Lambertian>(read.reflection).spectrum;
}

// Material of a surface of an asset, in a scene with a camera.
Material material_of(std::string_view name, const glm::vec3& color) {
  SceneSpec scene;
  scene.cameras.emplace_back();
  Palette palette(scene);
  ModelSurface surface;
  surface.name = name;
  surface.color = color;
  const std::uint16_t number = palette.index_of({.source = AssetSpec{}}, surface);
  return palette.take().all()[number];
}

// A laser at 905 nm sees the stand-in itself, a camera the surface's colour: within 0.06, because
// three bands do not determine a spectrum.
TEST(StandIn, HasTheColourOfTheSurfaceAndTheInfraredOfItsMaterial) {
  const glm::vec3 straw(0.36f, 0.29f, 0.155f);
  const Material hay = material_of("hay", straw);
  const Spectrum& spectrum = std::get<Lambertian>(hay.reflection).spectrum;
  for (const double nm : {720.0, 905.0, 1550.0})
    EXPECT_EQ(value_at(spectrum, nm), value_at(spectrum_of("dry_grass"), nm));
  const glm::dvec3 seen = linear_srgb(spectrum);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(seen[k], straw[k], 0.06);
}

// Saunderson (1942): light that passes the coat, is scattered by the base and passes it again, with
// a part thrown back each time. The base under the coat gives what the bare stand-in would.
TEST(StandIn, ReflectsAsMuchUnderACoatAsWithoutIt) {
  const Material rim = material_of("rim", {0.35f, 0.36f, 0.37f});
  const auto& coated = std::get<Coated>(rim.reflection);
  EXPECT_EQ(coated.refractive_index, 1.5);
  EXPECT_EQ(coated.alpha, 0.2);
  for (const double nm : {720.0, 905.0, 1064.0, 1550.0}) {
    const double base = *value_at(coated.spectrum, nm);
    double reflected = 0, inside = (1 - 0.092) * base;  // summed bounce by bounce
    for (int bounce = 0; bounce < 200; ++bounce) {
      reflected += inside * (1 - 0.596);
      inside *= 0.596 * base;
    }
    EXPECT_NEAR(reflected, *value_at(spectrum_of("metal"), nm), 1e-12);
  }
}

}  // namespace
}  // namespace groundray::model_library_test
