#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <glm/geometric.hpp>
#include <numbers>
#include <sstream>

#include "apps/scene/readers/scene_reader.h"
#include "core/appearance/bsdf.h"
#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::material_io_test {
namespace {

using groundray::testing::data_folder;
using groundray::testing::shared_data_folder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr const char* const all_names[] = {
    "aluminium",    "ash",       "asphalt",   "bark",     "broad_leaf", "char",
    "charred_wood", "dark_soil", "dry_grass", "dry_soil", "gravel",     "grey_gravel",
    "iron",         "leaf",      "litter",    "metal",    "puddle",     "retro_reflector",
    "rock",         "sand",      "water",     "wet_soil", "wood"};

Material built_in(const std::string& name) {
  return load_material(data_folder() / "materials" / (name + ".yaml"));
}

double reflectance(const std::string& name, double wavelength_nm) {
  return retro_brdf(built_in(name), wavelength_nm).diffuse_per_sr * std::numbers::pi;
}

TEST(MaterialIo, ReadsASpectrum) {
  const Material material = parse_material(R"(groundray_material: 1
name: brick
spectrum:
  wavelengths_nm: [500, 905]
  reflectances: [0.2, 0.4]
  deviations: [0.01, 0.02]
sources:
  spectra: mine
)",
                                           "brick.yaml");
  EXPECT_EQ(material.name, "brick");
  const auto& spectrum = std::get<Lambertian>(material.reflection).spectrum;
  ASSERT_EQ(spectrum.size(), 2u);
  EXPECT_EQ(spectrum[1].wavelength_nm, 905);
  EXPECT_EQ(spectrum[1].value, 0.4);
}

TEST(MaterialIo, KeysBesideASpectrumSelectItsModel) {
  const std::string spectrum =
      "groundray_material: 1\nname: it\nspectrum: {wavelengths_nm: [400, 900], reflectances: [0.2, "
      "0.4]";
  const auto read = [&](const std::string& more) {
    return parse_material(spectrum + more, "it.yaml").reflection;
  };
  EXPECT_EQ(std::get<RoughDiffuse>(read("}\ndiffuse_roughness: 0.7\n")).roughness, 0.7);
  const auto coated = std::get<Coated>(read("}\ncoat: {refractive_index: 1.33, alpha: 0.2}\n"));
  EXPECT_EQ(coated.refractive_index, 1.33);
  EXPECT_EQ(coated.alpha, 0.2);
  EXPECT_EQ(coated.spectrum.at(1).value, 0.4);
  const auto leaf = std::get<PlantLeaf>(read(", transmittances: [0.1, 0.5]}\n"));
  EXPECT_EQ(leaf.reflectance.at(1).value, 0.4);
  EXPECT_EQ(leaf.transmittance.at(1).value, 0.5);
}

TEST(MaterialIo, ReadsAConductor) {
  const Material material = parse_material(R"(groundray_material: 1
name: iron
conductor:
  wavelengths_nm: [500, 905]
  refractive_indices: [2.0, 2.8]
  extinction_coefficients: [3.1, 3.9]
  alpha: 0.3
)",
                                           "iron.yaml");
  const auto& metal = std::get<Conductor>(material.reflection);
  EXPECT_EQ(metal.refractive_index.at(1).value, 2.8);
  EXPECT_EQ(metal.extinction_coefficient.at(0).value, 3.1);
  EXPECT_EQ(metal.extinction_coefficient.at(0).wavelength_nm, 500);
  EXPECT_EQ(metal.alpha, 0.3);
}

TEST(MaterialIo, ErrorListsEveryFaultOfRoughSurfaces) {
  EXPECT_THAT(
      [] {
        parse_material(R"(groundray_material: 1
name: iron
conductor:
  wavelengths_nm: [500]
  refractive_indices: [-2]
  alpha: 3
  alfa: 3
coat: {refractive_index: 1}
)",
                       "iron.yaml");
      },
      ThrowsMessage<Error>(
          AllOf(HasSubstr("iron.yaml:5:24: key 'refractive_indices': is -2, but must be > 0"),
                HasSubstr("iron.yaml:6:10: key 'alpha': is 3, but must be from 0.01 to 1"),
                HasSubstr("iron.yaml:7:3: key 'alfa': unknown"),
                HasSubstr("key 'extinction_coefficients': missing"),
                HasSubstr("iron.yaml:8:7: key 'coat': applies to 'spectrum' only"))));
  EXPECT_THAT(
      [] {
        parse_material(R"(groundray_material: 1
name: leaf
spectrum:
  wavelengths_nm: [500, 600]
  reflectances: [0.5, 0.6]
  transmittances: [0.5, 0.5]
diffuse_roughness: 1.5
coat: {refractive_index: 1, alpha: 0.2}
)",
                       "leaf.yaml");
      },
      ThrowsMessage<Error>(AllOf(
          HasSubstr("at 600 nm reflectance 0.6 and transmittance 0.5 add up to more than 1"),
          HasSubstr("at most one of 'spectrum.transmittances', 'diffuse_roughness' and 'coat'"),
          HasSubstr("leaf.yaml:7:20: key 'diffuse_roughness': is 1.5, but must be from 0 to 1"),
          HasSubstr("key 'refractive_index': is 1, but must be > 1 and <= 4"))));
}

TEST(MaterialIo, ReadsARetroReflector) {
  const Material material =
      parse_material("groundray_material: 1\nname: sign\ncoefficient_cd_lx_m2: 70\n", "sign.yaml");
  EXPECT_EQ(std::get<RetroReflector>(material.reflection).coefficient_cd_lx_m2, 70);
}

TEST(MaterialIo, ErrorListsEveryFaultWithItsLine) {
  EXPECT_THAT(
      [] {
        parse_material(R"(groundray_material: 1
nam: brick
spectrum:
  wavelengths_nm: [900, 500, -3]
  reflectances: [20, 0.4, 0.4]
  deviations: [0.1]
)",
                       "brick.yaml");
      },
      ThrowsMessage<Error>(
          AllOf(HasSubstr("brick.yaml:2:1: key 'nam': unknown; did you mean 'name'?"),
                HasSubstr("brick.yaml:4:25: key 'wavelengths_nm': 500 follows 900: sort them"),
                HasSubstr("brick.yaml:4:30: key 'wavelengths_nm': is -3, but must be > 0"),
                HasSubstr("brick.yaml:5:18: key 'reflectances': is 20, but must be from 0 to 1"),
                HasSubstr("brick.yaml:6:15: key 'deviations': is a list of 1, but must be a list "
                          "of 3 numbers"))));
}

TEST(MaterialIo, MaterialHasExactlyOneKindOfReflection) {
  const auto rule =
      HasSubstr("must have exactly one of 'spectrum', 'conductor' and 'coefficient_cd_lx_m2'");
  EXPECT_THAT([] { parse_material("groundray_material: 1\nname: none\n", "none.yaml"); },
              ThrowsMessage<Error>(rule));
  EXPECT_THAT(
      [] {
        parse_material(R"(groundray_material: 1
name: both
coefficient_cd_lx_m2: 70
spectrum: {wavelengths_nm: [500], reflectances: [0.5]}
)",
                       "both.yaml");
      },
      ThrowsMessage<Error>(rule));
  EXPECT_THAT(
      [] {
        parse_material(
            "groundray_material: 1\nname: empty\nspectrum: {wavelengths_nm: [], reflectances: "
            "[]}\n",
            "empty.yaml");
      },
      ThrowsMessage<Error>(HasSubstr("has no samples, but needs at least one")));
}

TEST(MaterialIo, MissingFileIsAnError) {
  EXPECT_THAT([] { built_in("cheese"); }, ThrowsMessage<Error>(HasSubstr("there is no such file")));
}

TEST(MaterialIo, BuiltInMaterialsCoverTheWavelengthsOfLidars) {
  for (const std::string name : all_names) {
    const Material material = built_in(name);
    EXPECT_EQ(material.name, name);
    for (const double wavelength_nm : {532., 850., 905., 1064., 1550.}) {
      const bool is_wet = name == "wet_soil" || name == "puddle";
      if (wavelength_nm > 1100 && is_wet) continue;  // water absorbs there
      EXPECT_GT(retro_brdf_cos(retro_brdf(material, wavelength_nm), 1), 0) << name;
    }
  }
}

// Wet ground is darker than dry ground, aluminium lighter than iron, and a leaf is green.
TEST(MaterialIo, BuiltInColoursMatchTheirNames) {
  const auto colour = [](const std::string& name) {
    const Bsdf bsdf = bsdf_in_colour(built_in(name));
    const glm::dvec3 wo = glm::normalize(glm::dvec3(0.3, 0, 1));
    return bsdf.eval(wo, glm::normalize(glm::dvec3(0, 0.5, 1)));
  };
  EXPECT_LT(colour("wet_soil").y, colour("dry_soil").y);
  EXPECT_LT(colour("dark_soil").y, colour("dry_soil").y / 2);
  EXPECT_LT(colour("water").y, colour("puddle").y / 2);
  EXPECT_LT(colour("charred_wood").y, colour("ash").y / 2);
  EXPECT_GT(colour("aluminium").y, colour("iron").y);
  EXPECT_GT(colour("broad_leaf").y, 1.5 * colour("broad_leaf").x);
  EXPECT_GT(colour("broad_leaf").y, 1.5 * colour("broad_leaf").z);
  EXPECT_GT(colour("dry_soil").x, colour("dry_soil").z);
}

// The red edge of leaves, and soils and rocks whose reflectance rises towards the infrared: facts
// of remote sensing that a wrong column or unit would break.
TEST(MaterialIo, BuiltInSpectraHaveTheKnownShapesOfTheirClasses) {
  EXPECT_GT(reflectance("leaf", 850), 4 * reflectance("leaf", 660));
  EXPECT_LT(reflectance("leaf", 1450), reflectance("leaf", 1300) / 2);  // water
  EXPECT_GT(reflectance("broad_leaf", 850), 4 * reflectance("broad_leaf", 660));
  for (const char* name : {"dry_soil", "dark_soil", "sand", "rock", "grey_gravel", "dry_grass",
                           "bark", "asphalt", "litter", "wood", "char", "charred_wood", "ash"}) {
    EXPECT_LT(reflectance(name, 550), reflectance(name, 905)) << name;
  }
  EXPECT_LT(reflectance("asphalt", 905), 0.15);
}

TEST(MaterialIo, LeafIsTheMeanOfTheLibrarysSpectra) {
  const auto folder = shared_data_folder() / "spectra" / "ecostress_aster";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << "no " << folder;
  double sum = 0;
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (!entry.path().filename().string().starts_with("vegetation.")) continue;
    std::ifstream file(entry.path());
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      double wavelength_um = 0, percent = 0;
      if (words >> wavelength_um >> percent && wavelength_um == 0.905) {
        sum += percent / 100;
        ++count;
      }
    }
  }
  ASSERT_EQ(count, 14);
  EXPECT_NEAR(reflectance("leaf", 905), sum / count, 5.1e-5);  // four decimals
}

}  // namespace
}  // namespace groundray::material_io_test
