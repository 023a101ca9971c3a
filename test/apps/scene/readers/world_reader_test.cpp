// Objects, scatter, relief and materials in scene files, and the error messages for wrong entries.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <variant>

#include "apps/scene/readers/scene_reader.h"
#include "core/error.h"
#include "test/support/temporary_folder.h"

namespace groundray::world_reader_test {
namespace {

using groundray::testing::data_folder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// `relief` and the entries begin on their own lines.
std::string scene_with(const std::string& relief, const std::string& entries) {
  return "groundray: 1\nseed: 3\nduration_s: 1\nterrain:\n  dem: a.tif\n" + relief +
         "platform: {drive: {waypoints_m: [[0, 0], [9, 0]], speed_m_s: 1, height_m: 1}}\n"
         "lidars:\n  - {name: top, preset: velodyne_vlp16, mount: {}}\n" +
         entries;
}

SceneSpec parse(const std::string& text) {
  return parse_scene(text, "scenes/world.yaml", data_folder() / "sensors");
}

std::string complaint(const std::string& text) {
  try {
    parse(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

std::string about_object(const std::string& keys) {
  return complaint(scene_with("", "objects:\n  - {" + keys + "}\n"));
}

std::string about_layer(const std::string& keys) {
  return complaint(scene_with("", "scatter:\n  - {" + keys + "}\n"));
}

std::string about_relief(const std::string& keys) {
  return complaint(scene_with("  relief: {" + keys + "}\n", ""));
}

TEST(WorldReader, ReadsStaticAndMovingObjects) {
  const auto objects = parse(scene_with("", R"(objects:
  - {name: rock, label: 4, asset: rock, variant: 3, size_m: 2, scale: 1.5, at_m: [10, 20],
     height_m: 7, yaw_deg: 30, stance: on_slope, materials: {rock: gravel}, material: bark}
  - {name: car, label: 10, model: car.obj, up: y, metres_per_unit: 0.01, broken: drop,
     drive: {waypoints_m: [[0, 0], [9, 1]], speed_m_s: 4, height_m: 0}}
  - {name: other, label: 10, asset: vehicle, trajectory: other.tum}
)"))
                           .objects;
  ASSERT_EQ(objects.size(), 3u);
  const auto& rock = std::get<AssetSpec>(objects[0].model.source);
  EXPECT_EQ(rock.kind, AssetKind::Rock);
  EXPECT_EQ(rock.seed.value, 3u);
  EXPECT_EQ(rock.size_m, 2);
  EXPECT_EQ(objects[0].label, 4);
  EXPECT_EQ(objects[0].scale, 1.5);
  EXPECT_EQ(objects[0].model.material->name, "bark");
  EXPECT_EQ(objects[0].model.materials.at("rock").name, "gravel");
  const auto& place = std::get<StandingObject>(objects[0].place);
  EXPECT_EQ(place.at_m, glm::dvec2(10, 20));
  EXPECT_EQ(place.height_m, 7);
  EXPECT_EQ(place.yaw_deg, 30);
  EXPECT_EQ(place.stance, Stance::OnSlope);
  const auto& car = std::get<ModelSource>(objects[1].model.source);
  EXPECT_EQ(car.file, "scenes/car.obj");
  EXPECT_EQ(car.options.up, UpAxis::Y);
  EXPECT_EQ(car.options.metres_per_unit, 0.01);
  EXPECT_EQ(car.options.broken, BrokenParts::Drop);
  EXPECT_EQ(std::get<DrivenPath>(objects[1].place).speed_m_s, 4);
  EXPECT_EQ(std::get<RecordedPath>(objects[2].place).tum, "scenes/other.tum");
}

TEST(WorldReader, ReadsAScatterLayer) {
  const auto layers = parse(scene_with("", R"(scatter:
  - name: grass
    label: 2
    density_per_m2: 0.5
    density_map: grass.tif
    nodata: 255
    min_distance_m: 0.3
    slope_deg: [0, 30]
    height_m: [100, 200]
    scale: [0.5, 2]
    yaw_deg: [0, 90]
    stance: on_slope
    sink_m: 0.1
    clearings:
      - {line_m: [[0, 0], [5, 5]], half_width_m: 2}
      - {polygon_m: [[0, 0], [5, 5], [5, 0]]}
    models:
      - {asset: grass_tuft, weight: 3}
      - {model: tuft.ply}
)"))
                          .scatter;
  ASSERT_EQ(layers.size(), 1u);
  const ScatterLayer& grass = layers[0];
  EXPECT_EQ(grass.density_map, "scenes/grass.tif");
  EXPECT_EQ(grass.nodata, 255);
  EXPECT_EQ(grass.models.size(), 2u);
  EXPECT_THAT(grass.scatter.weights, ElementsAre(3, 1));
  EXPECT_EQ(grass.scatter.min_distance_m, 0.3);
  EXPECT_EQ(grass.scatter.slope_deg, (Interval{0, 30}));
  EXPECT_EQ(grass.scatter.height_m, (Interval{100, 200}));
  EXPECT_EQ(grass.scatter.scale, (Interval{0.5, 2}));
  EXPECT_EQ(grass.scatter.yaw_deg, (Interval{0, 90}));
  EXPECT_EQ(grass.scatter.stance, Stance::OnSlope);
  EXPECT_EQ(grass.scatter.sink_m, 0.1);
  ASSERT_EQ(grass.scatter.clearings.size(), 2u);
  EXPECT_EQ(grass.scatter.clearings[0].shape, Clearing::Shape::Line);
  EXPECT_EQ(grass.scatter.clearings[1].shape, Clearing::Shape::Polygon);
}

std::string layer_named(const std::string& name) {
  return "  - {name: " + name + ", label: 2, density_per_m2: 1, models: [{asset: stone}]}\n";
}

// A layer's number is FNV-1a of its name, checked by the test vectors of draft-eastlake-fnv:
// another layer before it does not move a layer's plants.
TEST(WorldReader, LayerNumberIsAHashOfItsName) {
  const auto alone = parse(scene_with("", "scatter:\n" + layer_named("foobar"))).scatter;
  const auto second =
      parse(scene_with("", "scatter:\n" + layer_named("a") + layer_named("foobar"))).scatter;
  EXPECT_EQ(alone.at(0).scatter.layer, 0xbf9cf968u);
  EXPECT_EQ(second.at(0).scatter.layer, 0xe40c292cu);
  EXPECT_EQ(second.at(1).scatter.layer, 0xbf9cf968u);
}

TEST(WorldReader, RejectsLayersWithEqualHashes) {
  EXPECT_THAT(
      complaint(scene_with("", "scatter:\n" + layer_named("liquid") + layer_named("costarring"))),
      AllOf(HasSubstr("world.yaml:11:5: key 'name': 'costarring' has the same hash as 'liquid'"),
            HasSubstr("rename one")));
}

TEST(WorldReader, ReportsFaultsInObjects) {
  struct Case {
    const char* keys;
    const char* words;
  };
  for (const auto& [keys, words] : {
           Case{"name: a, label: 1, asset: rock, at_m: [0, 0]", "no error"},
           {"label: 1, asset: rock, at_m: [0, 0]", "key 'name': missing"},
           {"name: a, asset: rock, at_m: [0, 0]", "key 'label': missing"},
           {"name: a, label: 1, asset: rock", "key 'at_m': missing"},
           {"name: a, label: -1, asset: rock, at_m: [0, 0]", "key 'label'"},
           {"name: a, label: 70000, asset: rock, at_m: [0, 0]", "key 'label'"},
           {"name: a, label: 1, asset: rock, at_m: [0, 0], scal: 2", "did you mean 'scale'?"},
           {"name: a, label: 1, asset: rock, at_m: [0, 0], scale: 0", "must be > 0"},
           {"name: a, label: 1, asset: rock, at_m: [0, 0, 0]", "must be a list of 2"},
           {"name: a, label: 1, asset: rock, at_m: here", "key 'at_m'"},
           {"name: a, label: 1, asset: rock, at_m: [0, 0], yaw_deg: north", "key 'yaw_deg'"},
           {"name: a, label: 1, asset: rock, at_m: [0, 0], stance: leaning", "key 'stance'"},
           {"name: a, label: 1, at_m: [0, 0]", "exactly one of 'asset' and 'model'"},
           {"name: a, label: 1, asset: rock, model: a.obj, at_m: [0, 0]",
            "exactly one of 'asset' and 'model'"},
           {"name: a, label: 1, asset: pine, at_m: [0, 0]", "there is no asset 'pine'"},
           {"name: a, label: 1, asset: [rock], at_m: [0, 0]", "key 'asset'"},
           {"name: a, label: 1, asset: rock, size_m: -1, at_m: [0, 0]", "key 'size_m'"},
           {"name: a, label: 1, asset: rock, sag_m: 1, at_m: [0, 0]", "a rock has no sag_m"},
           {"name: a, label: 1, asset: vehicle, variant: 4, at_m: [0, 0]",
            "a vehicle has no variants"},
           {"name: a, label: 1, asset: vehicle, detail: 4, at_m: [0, 0]",
            "a vehicle always has the same triangles"},
           {"name: a, label: 1, asset: rock, variant: -4, at_m: [0, 0]", "key 'variant'"},
           {"name: a, label: 1, asset: rock, up: z, at_m: [0, 0]", "key 'up': unknown"},
           {"name: a, label: 1, model: a.obj, variant: 1, at_m: [0, 0]", "key 'variant': unknown"},
           {"name: a, label: 1, model: a.obj, up: w, at_m: [0, 0]", "key 'up'"},
           {"name: a, label: 1, model: a.obj, metres_per_unit: 0, at_m: [0, 0]", "must be > 0"},
           {"name: a, label: 1, asset: rock, material: gravle, at_m: [0, 0]",
            "did you mean 'gravel'?"},
           {"name: a, label: 1, asset: rock, material: none.yaml, at_m: [0, 0]",
            "the material cannot be read:\nscenes/none.yaml"},
           {"name: a, label: 1, asset: rock, materials: {rock: gravle}, at_m: [0, 0]",
            "key 'rock': 'gravle' is not in"},
           {"name: a, label: 1, asset: rock, materials: gravel, at_m: [0, 0]", "key 'materials'"},
           {"name: a, label: 1, asset: rock, trajectory: a.tum, drive: {waypoints_m: [[0, 0], [1, "
            "1]], speed_m_s: 1, height_m: 0}",
            "must not be given together with 'drive'"},
           {"name: a, label: 1, asset: rock, trajectory: a.tum, at_m: [0, 0]",
            "key 'at_m': unknown"},
           {"name: a, label: 1, asset: rock, drive: {waypoints_m: [[0, 0]], speed_m_s: 1, "
            "height_m: "
            "0}",
            "has 1 points, but a drive needs at least two"},
           {"name: a, label: 1, asset: rock, drive: {waypoints_m: [[0, 0], [1]], speed_m_s: 1, "
            "height_m: 0}",
            "must be a list of 2"},
           {"name: a, label: 1, asset: rock, drive: {waypoints_m: [[0, 0], [1, 1]], speed_m_s: 0, "
            "height_m: 0}",
            "must be > 0"},
       }) {
    EXPECT_THAT(about_object(keys), HasSubstr(words)) << keys;
  }
}

TEST(WorldReader, ReportsFaultsInLayers) {
  const std::string sound = "name: a, label: 1, models: [{asset: stone}], density_per_m2: 1";
  struct Case {
    std::string keys;
    const char* words;
  };
  for (const auto& [keys, words] : {
           Case{sound, "no error"},
           {"name: a, label: 1, models: [{asset: stone}]", "key 'density_per_m2': missing"},
           {"name: a, label: 1, density_per_m2: 1", "key 'models': missing"},
           {"name: a, label: 1, models: [], density_per_m2: 1", "a layer needs at least one"},
           {"name: a, label: 1, models: {asset: stone}, density_per_m2: 1", "key 'models'"},
           {"name: a, label: 1, models: [{weight: 1}], density_per_m2: 1",
            "exactly one of 'asset' and 'model'"},
           {"name: a, label: 1, models: [{asset: stone, weight: 0}], density_per_m2: 1",
            "must be > 0"},
           {"name: a, label: 1, models: [{asset: stone, scale: 2}], density_per_m2: 1",
            "key 'scale': unknown"},
           {"name: a, label: 1, models: [{asset: stone}], density_per_m2: -1", "must be >= 0"},
           {sound + ", min_distance_m: -0.1", "key 'min_distance_m': is -0.1, but must be >= 0"},
           {sound + ", min_distance: 1", "did you mean 'min_distance_m'?"},
           {sound + ", slope_deg: [0, 91]", "must be from 0 to 90"},
           {sound + ", slope_deg: [30, 10]", "is empty: are its ends swapped?"},
           {sound + ", height_m: 3", "key 'height_m'"},
           {sound + ", scale: [0, 1]", "must be > 0"},
           {sound + ", stance: leaning", "key 'stance'"},
           {sound + ", sink_m: deep", "key 'sink_m'"},
           {sound + ", clearings: [{half_width_m: 1}]", "'polygon_m'"},
           {sound + ", clearings: [{line_m: [[0, 0]]}]", "key 'half_width_m': missing"},
           {sound + ", clearings: [{line_m: [[0, 0]], half_width_m: -1}]", "must be >= 0"},
           {sound + ", clearings: [{line_m: [0, 0], half_width_m: 1}]", "key 'line_m'"},
       }) {
    EXPECT_THAT(about_layer(keys), HasSubstr(words)) << keys;
  }
}

TEST(WorldReader, RejectsRepeatedNames) {
  const std::string rock = "  - {name: a, label: 1, asset: rock, at_m: [0, 0]}\n";
  EXPECT_THAT(complaint(scene_with("", "objects:\n" + rock + rock)),
              HasSubstr("world.yaml:11:5: key 'name': 'a' is taken by an earlier object"));
  EXPECT_THAT(complaint(scene_with("", "scatter:\n" + layer_named("a") + layer_named("a"))),
              HasSubstr("world.yaml:11:5: key 'name': 'a' is taken by an earlier layer"));
}

TEST(WorldReader, ReportsFaultsInRelief) {
  const std::string fractal = "fractal: {rms_m: 0.1, shortest_m: 0.5, longest_m: 9";
  struct Case {
    std::string keys;
    const char* words;
  };
  for (const auto& [keys, words] : {
           Case{"cell_m: 0.2, " + fractal + ", variant: 4}", "no error"},
           {fractal + "}", "key 'cell_m': missing"},
           {"cell_m: 0, " + fractal + "}", "must be > 0"},
           {"cell_m: 0.2", "must have 'image' or 'fractal', or both"},
           {"cell_m: 0.2, period: 9, " + fractal + "}", "did you mean 'period_m'?"},
           {"cell_m: 0.2, period_m: fifty, " + fractal + "}", "key 'period_m'"},
           {"cell_m: 0.2, " + fractal + ", hurst: 1.1}", "must be from 0 to 1"},
           {"cell_m: 0.2, " + fractal + ", seed: 4}", "key 'seed': unknown"},
           {"cell_m: 0.2, " + fractal + ", variant: -4}", "key 'variant'"},
           {"cell_m: 0.2, fractal: {rms_m: 0.1, longest_m: 9}", "key 'shortest_m': missing"},
           {"cell_m: 0.2, fractal: 3", "key 'fractal'"},
           {"cell_m: 0.2, image: {amplitude_m: 1, size_m: 1}", "key 'file': missing"},
           {"cell_m: 0.2, image: {file: none.png, amplitude_m: 1, size_m: 1}",
            "the image cannot be read:\nscenes/none.png"},
           {"cell_m: 0.2, image: {file: none.png, amplitude_m: 1, size_m: -1}", "must be > 0"},
       }) {
    EXPECT_THAT(about_relief(keys), HasSubstr(words)) << keys;
  }
}

TEST(WorldReader, ErrorListsTheFaultsOfAllEntriesWithLines) {
  EXPECT_THAT(
      complaint(scene_with("  relief: {cell_m: 0}\n", R"(objects:
  - {name: a, label: 1, asset: rook, at_m: [0, 0]}
  - rock
scatter: {name: b}
)")),
      AllOf(HasSubstr("world.yaml:6:11: key 'relief': must have 'image'"),
            HasSubstr("world.yaml:6:20: key 'cell_m': is 0, but must be > 0"),
            HasSubstr("world.yaml:11:32: key 'asset'"), HasSubstr("world.yaml:12:5: key 'objects'"),
            HasSubstr("world.yaml:13:10: key 'scatter'")));
}

}  // namespace
}  // namespace groundray::world_reader_test
