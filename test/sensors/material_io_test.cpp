#include "sensors/material_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>
#include <sstream>

#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray {
namespace {

using groundray::testing::data_folder;
using groundray::testing::shared_data_folder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr const char* const all_names[] = {"asphalt", "bark", "dry_grass", "dry_soil",
                                           "gravel",  "leaf", "metal",     "retro_reflector",
                                           "rock",    "sand"};

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
  EXPECT_EQ(spectrum[1].reflectance, 0.4);
}

TEST(MaterialIo, ReadsARetroReflector) {
  const Material material =
      parse_material("groundray_material: 1\nname: sign\ncoefficient_cd_lx_m2: 70\n", "sign.yaml");
  EXPECT_EQ(std::get<RetroReflector>(material.reflection).coefficient_cd_lx_m2, 70);
}

TEST(MaterialIo, ErrorListsEveryFaultWithItsPlace) {
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

TEST(MaterialIo, MaterialIsEitherASpectrumOrARetroReflector) {
  const auto rule = HasSubstr("must have exactly one of 'spectrum' and 'coefficient_cd_lx_m2'");
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

TEST(MaterialIo, BuiltInMaterialsServeTheWavelengthsOfLidars) {
  for (const std::string name : all_names) {
    const Material material = built_in(name);
    EXPECT_EQ(material.name, name);
    for (const double wavelength_nm : {532., 850., 905., 1064., 1550.}) {
      EXPECT_GT(retro_brdf_cos(retro_brdf(material, wavelength_nm), 1), 0) << name;
    }
  }
}

// The red edge of leaves, and soils and rocks that grow lighter toward the infrared: facts of
// remote sensing that a wrong column or unit would break.
TEST(MaterialIo, BuiltInSpectraHaveTheShapesThatTheirClassesAreKnownFor) {
  EXPECT_GT(reflectance("leaf", 850), 4 * reflectance("leaf", 660));
  EXPECT_LT(reflectance("leaf", 1450), reflectance("leaf", 1300) / 2);  // water
  for (const char* name : {"dry_soil", "sand", "rock", "dry_grass", "bark", "asphalt"}) {
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
}  // namespace groundray
