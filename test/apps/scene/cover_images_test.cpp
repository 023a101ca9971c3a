#include "apps/scene/cover_images.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <glm/geometric.hpp>
#include <string>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "core/image/png_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::cover_images_test {
namespace {

using groundray::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Flat ground of 32 m with samples at odd places.
class CoverImagesOnFlatGround : public ::testing::Test {
 protected:
  CoverImagesOnFlatGround() {
    std::ofstream dem(folder_ / "dem.asc");
    dem << "ncols 33\nnrows 29\nxllcorner 0.3\nyllcorner 7.6\ncellsize 1\n";
    for (int row = 0; row < 29; ++row) {
      for (int column = 0; column < 33; ++column) dem << "5 ";
      dem << '\n';
    }
  }

  // Reads a scene with these keys of the ground, and returns its terrain.
  TerrainSpec parse(const std::string& keys) const {
    return parse_scene(fmt::format("groundray: 1\nseed: 1\nduration_s: 1\nterrain:\n"
                                   "  dem: dem.asc\n{}platform:\n  drive:\n"
                                   "    waypoints_m: [[5, 15], [6, 15]]\n    speed_m_s: 1\n"
                                   "    height_m: 0\n    footprint_m: [1, 1]\n"
                                   "lidars:\n  - {{name: top, preset: velodyne_vlp16, mount: "
                                   "{{translation_m: [0, 0, 2]}}}}\n",
                                   keys),
                       folder_ / "scene.yaml", testing::data_folder() / "sensors")
        .terrain;
  }
  static Terrain load(const TerrainSpec& spec) {
    return {spec.dem, spec.options, spec.detail, {}, spec.relief};
  }
  GroundTexture texture(const std::string& keys) const {
    const TerrainSpec spec = parse(keys);
    const Terrain terrain = load(spec);
    return *CoverImages(spec, terrain).texture(spec.texture);
  }

  TemporaryFolder folder_;
};

// Cells are as wide as pixels, so that samples of the relief are single pixels.
TEST_F(CoverImagesOnFlatGround, AreInRegisterWithTheReliefOfTheSameImages) {
  const TerrainSpec spec = parse(
      "  relief: {cell_m: 0.015625, period_m: 1, image: {generate: gravel, pixels: 64, size_m: "
      "1}}\n"
      "  texture: {generate: gravel, pixels: 64, size_m: 1}\n");
  const Terrain terrain = load(spec);
  const GroundTexture texture = *CoverImages(spec, terrain).texture(spec.texture);
  const GroundImages images = make_ground_images({GroundImageKind::Gravel, 0, 64, 1});
  const Texture albedo(images.albedo, Encoding::Srgb, Wrap::Repeat);
  const GroundCover cover({{.texture = texture}}, nullptr, {});
  for (int row = 0; row < 64; row += 3) {
    for (int column = 0; column < 64; column += 3) {
      EXPECT_NEAR(terrain.relief()->displacement_m({column, row}),
                  images.height_m.at(column, row)[0], 1e-7);
      // 5 m to the east and 3 m to the south, whole copies.
      const glm::dvec2 p_D = terrain.frame().to_D({column + 5 * 64, row + 3 * 64});
      const Tint tint =
          cover.tint_at(0, GroundCover::on_facet({p_D, 5}, {0, 0, 1}), {}, Filtering::Fast);
      const glm::vec3 texel(albedo.texel(0, column, row));
      EXPECT_LT(glm::distance(tint.color * glm::vec3(albedo.mean()), texel), 1e-6f);
    }
  }
}

TEST_F(CoverImagesOnFlatGround, AreStochasticUnlessTheReliefHasThem) {
  const std::string plain = "  texture: {generate: moss, pixels: 64, size_m: 1}\n";
  const std::string relief =
      "  relief: {cell_m: 0.125, period_m: 8, image: {generate: moss, pixels: 64, size_m: 1}}\n";
  EXPECT_EQ(texture(plain).tiling, Tiling::Stochastic);
  EXPECT_EQ(texture(relief + plain).tiling, Tiling::Repeat);
  EXPECT_EQ(texture("  texture: {generate: moss, pixels: 64, tiling: repeat}\n").tiling,
            Tiling::Repeat);
}

TEST_F(CoverImagesOnFlatGround, RejectGroundThatCannotBeInRegister) {
  const auto attempt = [&](const char* size, const char* tiling) {
    return [=, this] {
      texture(
          fmt::format("  relief: {{cell_m: 0.125, period_m: 8, image: {{generate: moss, "
                      "pixels: 64, size_m: {0}}}}}\n"
                      "  texture: {{generate: moss, pixels: 64, size_m: {0}{1}}}\n",
                      size, tiling));
    };
  };
  EXPECT_THAT(attempt("1.05", ""),
              ThrowsMessage<Error>(HasSubstr("cannot be in register with the relief, whose period "
                                             "of 8 x 8 m has copies of 1 x 1 m instead of")));
  EXPECT_THAT(attempt("1", ", tiling: stochastic"),
              ThrowsMessage<Error>(HasSubstr("would move its colours off the relief")));
}

TEST_F(CoverImagesOnFlatGround, ChecksSeamsOfFilesOnRequest) {
  Image8 ramp(32, 32, 1);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) ramp.at(x, y)[0] = static_cast<std::uint8_t>(7 * x);
  }
  write_png(folder_ / "ramp.png", ramp);
  EXPECT_EQ(texture("  texture: {albedo: ramp.png, size_m: 1}\n").tiling, Tiling::Repeat);
  for (const char* word : {"seamless", "stochastic"}) {
    EXPECT_THAT(
        [&] {
          texture(fmt::format("  texture: {{albedo: ramp.png, size_m: 1, tiling: {}}}\n", word));
        },
        ThrowsMessage<Error>(HasSubstr("ramp.png: it does not tile: its left and right edges")));
  }
}

TEST_F(CoverImagesOnFlatGround, FaultsOfGeneratedImagesAreLocated) {
  const auto complaint = [&](const std::string& keys) {
    try {
      parse("  texture: {" + keys + "}\n");
    } catch (const Error& fault) {
      return std::string(fault.what());
    }
    return std::string();
  };
  EXPECT_THAT(complaint("generate: mos"), HasSubstr("moss"));
  EXPECT_THAT(complaint("generate: moss, pixels: 1000"),
              HasSubstr("key 'pixels': is 1000, but must be a power of two from 64 to 4096"));
  EXPECT_THAT(complaint("generate: moss, size_m: 100"), HasSubstr("must be from 0.5 to 8"));
  EXPECT_THAT(complaint("generate: moss, albedo: moss.png"), HasSubstr("albedo"));
}

}  // namespace
}  // namespace groundray::cover_images_test
