#include <gtest/gtest.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <memory>
#include <string>
#include <tuple>
#include <utility>

#include "apps/scene/simulation.h"
#include "apps/view/layers/terrain_follower.h"
#include "core/image/png_io.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"
#include "test/view/sample_dataset.h"

namespace groundray::ground_texture_test {
namespace {

// The sample scene's hills with an orthophoto, whose red increases to the east and green to the
// north, or with a texture of stripes 10 cm wide.
std::shared_ptr<const Simulation> world_of(const std::filesystem::path& folder,
                                           const char* ground) {
  std::string text = testing::sample_scene();
  text.replace(text.find("material: dry_soil"), 18, ground);
  constexpr int size = 161;
  testing::GeoTiff photo{
      .size = {size, size}, .geotransform = {0, 1, 0, size, 0, -1}, .crs = "", .type = GDT_Byte};
  for (int band = 0; band < 3; ++band) {
    for (int row = 0; row < size; ++row) {
      for (int column = 0; column < size; ++column)
        photo.values.push_back(band == 0 ? 60 + column : band == 1 ? 220 - row : 100);
    }
  }
  photo.save(folder / "photo.tif");
  Image8 stripes(20, 20, 3);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 20; ++x)
      std::ranges::fill(stripes.at(x, y), std::uint8_t(x < 10 ? 40 : 200));
  }
  write_png(folder / "stripes.png", stripes);
  return std::make_shared<const Simulation>(
      load_simulation(testing::write_sample_scene(folder, text)));
}

glm::dvec3 texel(const Layer& layer, glm::ivec2 at) {
  vtkImageData& image = *layer.texture->GetInput();
  glm::dvec3 colour;
  for (int k = 0; k < 3; ++k) colour[k] = image.GetScalarComponentAsDouble(at.x, at.y, 0, k);
  return colour;
}

// Samples the texture at texture coordinates as it is drawn: bilinearly between texel centres.
glm::dvec3 texture_at(const Layer& layer, const glm::dvec2& place) {
  std::array<int, 3> size{};
  layer.texture->GetInput()->GetDimensions(size.data());
  const glm::dvec2 at = place * glm::dvec2(size[0], size[1]) - 0.5;
  const glm::dvec2 low = glm::floor(at), share = at - low;
  const auto get = [&](int dx, int dy) {
    return texel(layer, glm::clamp(glm::ivec2(low) + glm::ivec2(dx, dy), glm::ivec2(0),
                                   glm::ivec2(size[0], size[1]) - 1));
  };
  return glm::mix(glm::mix(get(0, 0), get(1, 0), share.x), glm::mix(get(0, 1), get(1, 1), share.x),
                  share.y);
}

glm::dvec2 place_of(vtkPolyData& data, vtkIdType point) {
  glm::dvec2 place;
  data.GetPointData()->GetTCoords()->GetTuple(point, &place.x);
  return place;
}

// At triangle corners, the colour column is the oracle for the texture.
TEST(GroundTexture, MatchesTheAppearanceOfTheGround) {
  testing::TemporaryFolder folder;
  const auto simulation = world_of(folder.path(), "material: dry_soil, orthophoto: photo.tif");
  TerrainFollower follower(simulation);
  const FollowedTerrain terrain = follower.follow({70, 90, 58});
  const Layer& layer = terrain.layer;
  ASSERT_NE(layer.texture, nullptr);
  for (vtkPolyData* const data : {layer.data.Get(), layer.coarse.Get()}) {
    ASSERT_NE(data->GetPointData()->GetTCoords(), nullptr);
    vtkDataArray& colour = *data->GetPointData()->GetArray("colour");
    double worst = 0;
    for (const vtkIdType i : corners(*data)) {
      glm::dvec3 expected;
      colour.GetTuple(i, &expected.x);
      const glm::dvec3 off = glm::abs(texture_at(layer, place_of(*data, i)) - expected);
      worst = std::max({worst, off.x, off.y, off.z});
    }
    // A colour value changes by about one per metre, and texels are 0.3 m at most; bytes are
    // rounded.
    EXPECT_LT(worst, 3);
  }
  const glm::dvec2 span(layer.find("colour")->range);
  EXPECT_LT(span.x, span.y);
}

// A vertex that takes its colours from several squares of the texture is repeated for each of them,
// with the same values; no triangle is lost.
TEST(GroundTexture, KeepsTheTerrainsGeometry) {
  testing::TemporaryFolder folder;
  const glm::dvec3 eye(70, 90, 58);
  TerrainFollower plain(world_of(folder.path(), "material: dry_soil"));
  TerrainFollower draped(world_of(folder.path(), "material: dry_soil, orthophoto: photo.tif"));
  const Layer before = plain.follow(eye).layer, after = draped.follow(eye).layer;
  EXPECT_EQ(before.texture, nullptr);
  EXPECT_GT(after.points(), before.points());
  ASSERT_EQ(after.triangles(), before.triangles());
  const auto from = corners(*before.data), to = corners(*after.data);
  for (std::size_t i = 0; i < from.size(); ++i) {
    ASSERT_EQ(after.p_w_m(to[i]), before.p_w_m(from[i]));
    ASSERT_EQ(after.value(*after.find("height"), to[i]),
              before.value(*before.find("height"), from[i]));
  }
}

// Triangles with sides of a metre show stripes that are ten times finer.
TEST(GroundTexture, IsSharpNearTheEye) {
  testing::TemporaryFolder folder;
  const auto simulation =
      world_of(folder.path(), "material: dry_soil, texture: {albedo: stripes.png, size_m: 0.2}");
  TerrainFollower follower(simulation);
  const glm::dvec3 eye(80.3, 80.4, 55);
  const Layer layer = follower.follow(eye).layer;
  ASSERT_NE(layer.texture, nullptr);
  // Samples the triangle nearest to the eye along its longest side.
  const auto corner = corners(*layer.data);
  std::size_t nearest = 0;
  double least_m = 1e9;
  for (std::size_t i = 0; i + 2 < corner.size(); i += 3) {
    const double off_m = glm::distance(layer.p_w_m(corner[i]), eye);
    if (off_m < least_m) std::tie(least_m, nearest) = std::pair(off_m, i);
  }
  const glm::dvec2 a = place_of(*layer.data, corner[nearest + 1]);
  const glm::dvec2 b = place_of(*layer.data, corner[nearest + 2]);
  int changes = 0, light = 0;
  double darkest = 255, lightest = 0;
  for (int i = 0; i <= 1000; ++i) {
    const double red = texture_at(layer, glm::mix(a, b, i / 1000.0)).x;
    darkest = std::min(darkest, red);
    lightest = std::max(lightest, red);
    const int is_light = red > 100 ? 1 : 0;
    changes += i > 0 && is_light != light ? 1 : 0;
    light = is_light;
  }
  EXPECT_GT(lightest, 1.5 * darkest);
  EXPECT_GE(changes, 8);  // of 10 in a metre along x
}

}  // namespace
}  // namespace groundray::ground_texture_test
