// Objects, scatter, relief and materials in scene files, and the error messages for wrong entries.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
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
    clusters: {size_m: 3}
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
  EXPECT_EQ(grass.scatter.clusters->size_m, 3);
  EXPECT_EQ(grass.scatter.clusters->contrast, 1);
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
           {"name: a, label: 1, asset: palm, at_m: [0, 0]", "there is no asset 'palm'"},
           {"name: a, label: 1, asset: oak, leaves: flat, at_m: [0, 0]", "key 'leaves'"},
           {"name: a, label: 1, asset: oak, health: 1.5, at_m: [0, 0]", "must be from 0 to 1"},
           {"name: a, label: 1, asset: rock, leaves: geometry, at_m: [0, 0]",
            "a rock has no leaves"},
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
           {"name: a, label: 1, asset: fence, line_m: [[0, 0], [9, 0]]", "no error"},
           {"name: a, label: 1, asset: fence, line_m: [[0, 0]]", "a fence needs at least two"},
           {"name: a, label: 1, asset: fence, line_m: [[0, 0], [9, 0]], at_m: [0, 0]",
            "key 'at_m': unknown"},
           {"name: a, label: 1, asset: fence, line_m: [[0, 0], [9, 0]], size_m: 9",
            "must not be given together with size_m"},
           {"name: a, label: 1, asset: fence, line_m: [[0, 0], [9, 0]], scale: 2",
            "must not be given together with scale"},
           {"name: a, label: 1, asset: fence, line_m: [[0, 0], [9, 0]], trajectory: a.tum",
            "together with 'trajectory' or 'drive'"},
           {"name: a, label: 1, asset: rock, line_m: [[0, 0], [9, 0]]", "is only for asset: fence"},
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
           {sound + ", clusters: {contrast: 1}", "key 'size_m': missing"},
           {sound + ", clusters: {size_m: 0}", "must be > 0"},
           {sound + ", clusters: {size_m: 2, contrast: 1.5}", "must be from 0 to 1"},
           {sound + ", rows: {spacing_m: [1, 1]}, clusters: {size_m: 2}",
            "key 'clusters': have no meaning in 'rows'"},
           {sound + ", clearings: [{half_width_m: 1}]", "'polygon_m'"},
           {sound + ", clearings: [{line_m: [[0, 0]]}]", "key 'half_width_m': missing"},
           {sound + ", clearings: [{line_m: [[0, 0]], half_width_m: -1}]", "must be >= 0"},
           {sound + ", clearings: [{line_m: [0, 0], half_width_m: 1}]", "key 'line_m'"},
       }) {
    EXPECT_THAT(about_layer(keys), HasSubstr(words)) << keys;
  }
}

// Complaints about a scene with a trail, whose keys follow its name and waypoints.
std::string about_trail(const std::string& keys, const std::string& entries = "") {
  return complaint(
      scene_with("  relief: {cell_m: 0.1}\n  trails: [{name: track, waypoints_m: [[0, 0], [9, 0]]" +
                     keys + "}]\n" + (entries.starts_with("  ") ? entries : ""),
                 entries.starts_with("  ") ? "" : entries));
}

TEST(WorldReader, ReadsTrails) {
  const SceneSpec scene = parse(
      scene_with("  relief: {cell_m: 0.1}\n  trails: [{name: track, waypoints_m: [[0, 0], [9, 0]], "
                 "bank_deg: 45, ruts: {depth_m: 0.1}, ditches: {width_m: 1, depth_m: 0.3, side: "
                 "left}, benches: {height_m: 5, width_m: 3, roughness_m: 0.5}}]\n  cover: "
                 "[{material: gravel, trail: {name: track, ruts_m: [0, 0.2], "
                 "blend_m: 0.1}}]\n",
                 "objects: [{name: car, label: 3, asset: vehicle, drive: {trail: track, from_m: 2, "
                 "speed_m_s: 1, height_m: 0}}]\n"));
  const TrailSpec& trail = scene.terrain.relief->trails.at(0);
  EXPECT_DOUBLE_EQ(trail.bank_slope, 1);
  EXPECT_EQ(trail.ruts->depth_m, 0.1);
  EXPECT_EQ(trail.ditches->side, TrailSpec::Ditches::Side::Left);
  EXPECT_EQ(trail.benches->height_m, 5);
  EXPECT_EQ(trail.benches->width_m, 3);
  EXPECT_EQ(trail.benches->roughness_m, 0.5);
  EXPECT_FALSE(trail.roots);
  const auto& beside = *scene.terrain.cover.at(0).site.trail;
  EXPECT_EQ(beside.name, "track");
  EXPECT_EQ(beside.from, SiteConditions::BesideTrail::From::Ruts);
  EXPECT_EQ(beside.limits_m.high, 0.2);
  const auto& drive = std::get<DrivenPath>(scene.objects.at(0).place);
  EXPECT_EQ(drive.trail, "track");
  EXPECT_EQ(drive.from_m, 2);
}

TEST(WorldReader, ReportsFaultsInTrails) {
  struct Case {
    std::string keys;
    const char* words;
  };
  for (const auto& [keys, words] : {
           Case{"", "no error"},
           {", width_m: 0", "key 'width_m'"},
           {", bank_deg: 90", "must be from 1 to 89"},
           {", most_grade_deg: 81", "must be > 0 and at most 80"},
           {", relief_share: 2", "must be from 0 to 1"},
           {", ruts: {track_m: 1.5}", "key 'depth_m': missing"},
           {", ditches: {width_m: 1, depth_m: 1, side: east}", "key 'side'"},
           {", washboards: {}", "did you mean 'washboard'?"},
           {", potholes: {per_100_m: 1, diameter_m: 1}", "key 'diameter_m'"},
           {", benches: {height_m: 2}", "key 'width_m': missing"},
           {", benches: {height_m: 0, width_m: 1}", "must be > 0"},
           {", benches: {height_m: 2, width_m: 1, roughness_m: -1}", "must be >= 0"},
           {", benches: {height_m: 2, width_m: 1, roughness: 1}", "did you mean 'roughness_m'?"},
           {", between_m: [[0, 0], [9, 9]]", "must not be given together with 'waypoints_m'"},
       }) {
    EXPECT_THAT(about_trail(keys), HasSubstr(words)) << keys;
  }
  const std::string trail = "{name: track, waypoints_m: [[0, 0], [9, 0]]}";
  EXPECT_THAT(
      complaint(scene_with("  trails: [" + trail + "]\n", "")),
      HasSubstr("key 'trails': need 'relief' with the size of its cells, such as {cell_m:"));
  EXPECT_THAT(complaint(scene_with(
                  "  relief: {cell_m: 1}\n  trails: [" + trail + ", " + trail + "]\n", "")),
              HasSubstr("'track' is taken by an earlier trail"));
  EXPECT_THAT(complaint(scene_with("  relief: {cell_m: 1}\n  trails: [{name: a, between_m: [[0, "
                                   "0], [1, 0], [2, 0]]}]\n",
                                   "")),
              HasSubstr("key 'between_m': has 3 points, but must have two"));
  EXPECT_THAT(complaint(scene_with("  relief: {cell_m: 1}\n  trails: [{name: a, waypoints_m: [[0, "
                                   "0]]}]\n",
                                   "")),
              HasSubstr("has 1 points, but a trail needs at least two"));
}

TEST(WorldReader, ReportsFaultsInReferencesToTrails) {
  const std::string drive =
      "objects: [{name: a, label: 1, asset: rock, drive: {speed_m_s: 1, "
      "height_m: 0, ";
  const std::string layer =
      "scatter: [{name: a, label: 1, models: [{asset: stone}], "
      "density_per_m2: 1, clearings: [{half_width_m: 1, ";
  const std::string cover = "  cover: [{material: gravel, trail: {";
  struct Case {
    std::string entries;
    const char* words;
  };
  for (const auto& [entries, words] : {
           Case{drive + "trail: track}}]", "no error"},
           {drive + "trail: trak}}]",
            "there is no trail 'trak' under terrain.trails; did you mean 'track'?"},
           {drive + "trail: track, waypoints_m: [[0, 0], [1, 1]]}}]",
            "must not be given together with 'waypoints_m'"},
           {drive + "trail: track, from_m: -1}}]", "key 'from_m'"},
           {layer + "trail: track}]}]", "no error"},
           {layer + "trail: path}]}]", "there is no trail 'path'"},
           {cover + "edge_m: [0, 1]}}]\n", "no error"},
           {cover + "name: road, edge_m: [0, 1]}}]\n", "there is no trail 'road'"},
           {cover + "ruts_m: [0, 1]}}]\n", "no trail that it applies to has 'ruts'"},
           {cover + "edge_m: [0, 1], ruts_m: [0, 1]}}]\n", "exactly one of 'edge_m' and 'ruts_m'"},
           {cover + "edge_m: [1, 0]}}]\n", "are its ends swapped?"},
       }) {
    EXPECT_THAT(about_trail("", entries), HasSubstr(words)) << entries;
  }
}

TEST(WorldReader, ReadsWindAndSway) {
  const SceneSpec scene =
      parse(scene_with("", R"(wind: {speed_m_s: 8, from_deg: 240, turbulence: 0.3}
objects:
  - {name: mast, label: 1, model: mast.obj, at_m: [0, 0], sway: {frequency_hz: 1.5, lean_deg: 30}}
  - {name: tree, label: 2, asset: spruce, at_m: [9, 0]}
)"));
  EXPECT_EQ(scene.wind.speed_m_s, 8);
  EXPECT_EQ(scene.wind.turbulence, 0.3);
  // From 240 degrees is from west-south-west; it blows to east-north-east.
  EXPECT_NEAR(scene.wind.towards.x, std::sqrt(0.75), 1e-15);
  EXPECT_NEAR(scene.wind.towards.y, 0.5, 1e-15);
  ASSERT_TRUE(scene.objects[0].model.sway);
  EXPECT_EQ(scene.objects[0].model.sway->frequency_hz, 1.5);
  EXPECT_NEAR(scene.objects[0].model.sway->lean_rad, std::numbers::pi / 6, 1e-15);
  EXPECT_FALSE(scene.objects[1].model.sway);
  const Wind west = parse(scene_with("", "wind: {speed_m_s: 1}\n")).wind;
  EXPECT_NEAR(west.towards.x, 1, 1e-15);
  EXPECT_NEAR(west.towards.y, 0, 1e-15);
  EXPECT_EQ(west.turbulence, 0.2);
  EXPECT_EQ(parse(scene_with("", "")).wind.speed_m_s, 0);
}

TEST(WorldReader, ReportsFaultsInWindAndSway) {
  const auto about_wind = [](const std::string& keys) {
    return complaint(scene_with("", "wind: {" + keys + "}\n"));
  };
  EXPECT_THAT(about_wind("from_deg: 3"), HasSubstr("key 'speed_m_s': missing"));
  EXPECT_THAT(
      about_wind("speed_m_s: -1"),
      HasSubstr("world.yaml:9:19: key 'speed_m_s': is -1, but must be 0, or from 0.1 to 30"));
  EXPECT_THAT(about_wind("speed_m_s: 31"), HasSubstr("must be 0, or from 0.1 to 30"));
  EXPECT_THAT(about_wind("speed_m_s: 0.05"), HasSubstr("must be 0, or from 0.1 to 30"));
  EXPECT_THAT(about_wind("speed_m_s: 3, turbulence: 0.6"),
              HasSubstr("key 'turbulence': is 0.6, but must be from 0 to 0.5"));
  EXPECT_THAT(about_wind("speed_m_s: 3, from: 30"), HasSubstr("did you mean 'from_deg'?"));
  const std::string mast = "name: a, label: 1, model: a.obj, ";
  EXPECT_THAT(about_object(mast + "at_m: [0, 0], sway: {lean_deg: 3}"),
              HasSubstr("key 'frequency_hz': missing"));
  EXPECT_THAT(about_object(mast + "at_m: [0, 0], sway: {frequency_hz: 0, lean_deg: 46}"),
              AllOf(HasSubstr("key 'frequency_hz': is 0, but must be from 0.01 to 100"),
                    HasSubstr("key 'lean_deg': is 46, but must be from 0 to 45")));
  EXPECT_THAT(
      about_object(mast + "trajectory: a.tum, sway: {frequency_hz: 1, lean_deg: 3}"),
      HasSubstr("key 'sway': 'a' moves along a path, and only objects that stand can sway"));
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

TEST(WorldReader, ReadsSitesOfCoversAndPlants) {
  const SceneSpec scene = parse(scene_with(
      "  relief: {cell_m: 0.1}\n  trails: [{name: track, waypoints_m: [[0, 0], [9, 0]]}]\n"
      "  water: {cell_m: 0.5}\n  canopy: {cell_m: 0.25, radius_m: 2}\n  cover: "
      "[{material: litter, canopy: [0.5, 1], canopy_blend: 0.2}]\n",
      "scatter: [{name: reed, label: 1, models: [{asset: reed}], density_per_m2: 1, "
      "trail: {edge_m: [1, 5]}, water: {wetness: [7, 30]}, canopy: [0, 0.5]}]\n"));
  EXPECT_EQ(scene.terrain.canopy.cell_m, 0.25);
  EXPECT_EQ(scene.terrain.canopy.radius_m, 2);
  const CoverLimits& litter = scene.terrain.cover.at(0).site.canopy.value();
  EXPECT_EQ(litter.low, 0.5);
  EXPECT_TRUE(std::isinf(litter.high));  // 1 is no limit
  EXPECT_EQ(litter.blend, 0.2);
  const SiteConditions& reed = scene.scatter.at(0).site;
  EXPECT_EQ(reed.trail->limits_m.high, 5);
  EXPECT_EQ(reed.water->quantity, SiteConditions::Water::Quantity::Wetness);
  EXPECT_TRUE(std::isinf(reed.canopy->low));
  EXPECT_EQ(reed.canopy->high, 0.5);
  EXPECT_FALSE(scene.scatter.at(0).species);
}

TEST(WorldReader, ReportsFaultsInSites) {
  const std::string layer = "name: a, label: 1, models: [{asset: stone}], density_per_m2: 1, ";
  EXPECT_THAT(about_layer(layer + "canopy: [0.5, 2]"), HasSubstr("must be from 0 to 1"));
  EXPECT_THAT(about_layer(layer + "canopy: [0.5, 0.2]"), HasSubstr("are its ends swapped?"));
  EXPECT_THAT(about_layer(layer + "canopy_blend: 0.2"),
              HasSubstr("applies to 'canopy', which is missing"));
  EXPECT_THAT(about_layer(layer + "water: {depth_m: [0, 1]}"),
              HasSubstr("key 'water': needs terrain.water with the size of its cells"));
  EXPECT_THAT(complaint(scene_with("  water: {cell_m: 1}\n  cover: [{material: gravel, water: "
                                   "{depth_m: [0, 1], distance_m: [0, 3]}}]\n",
                                   "")),
              HasSubstr("must have exactly one of 'depth_m', 'wetness' and 'distance_m'"));
  EXPECT_THAT(about_layer(layer + "trail: {edge_m: [0, 1]}"),
              HasSubstr("there are no trails under terrain.trails"));
  EXPECT_THAT(complaint(scene_with("  canopy: {cell_m: 0}\n", "")), HasSubstr("key 'cell_m'"));
}

std::string about_species(const std::string& keys) {
  return complaint(scene_with("", "ecosystem:\n  - {" + keys + "}\n"));
}

TEST(WorldReader, ReadsSpecies) {
  const SceneSpec scene = parse(scene_with("", R"(scatter:
  - {name: stones, label: 2, density_per_m2: 1, models: [{asset: stone}]}
ecosystem:
  - {name: spruce, label: 6, asset: spruce, variant: 5, density_per_m2: 0.1, sizes_m: [2, 22],
     weibull: {shape: 1, scale_m: 8}, tolerance: 0.4, zone: 0.8, min_distance_m: 1, variants: 2}
  - {name: fern, label: 3, model: fern.obj, density_per_m2: 1, sizes_m: [0.5, 0.9], canopy: [0.3, 1]}
)"));
  ASSERT_EQ(scene.scatter.size(), 3u);
  const ScatterLayer& spruce = scene.scatter[1];
  EXPECT_EQ(spruce.species->tolerance, 0.4);
  EXPECT_EQ(spruce.species->zone, 0.8);
  EXPECT_EQ(spruce.species->min_distance_m, 1);
  EXPECT_EQ(spruce.scatter.scale, (Interval{2, 22}));
  EXPECT_EQ(spruce.scatter.scales->scale, 8);
  ASSERT_EQ(spruce.models.size(), 2u);
  const auto& small = std::get<AssetSpec>(spruce.models[0].source);
  const auto& large = std::get<AssetSpec>(spruce.models[1].source);
  // Quartiles of the exponential distribution that is cut off at 20 m above 2 m.
  const double most = 1 - std::exp(-2.5);
  EXPECT_NEAR(small.size_m.value(), 2 - 8 * std::log(1 - most / 4), 1e-12);
  EXPECT_NEAR(large.size_m.value(), 2 - 8 * std::log(1 - most * 3 / 4), 1e-12);
  EXPECT_EQ(small.seed.value, 5u);
  EXPECT_EQ(large.seed.value, 6u);
  EXPECT_EQ(scene.scatter[2].models.size(), 1u);
  EXPECT_TRUE(scene.scatter[2].site.canopy);
  EXPECT_FALSE(scene.scatter[0].species);
}

TEST(WorldReader, ReportsFaultsInSpecies) {
  const std::string sound = "name: a, label: 1, density_per_m2: 1, sizes_m: [1, 2], asset: spruce";
  struct Case {
    std::string keys;
    const char* words;
  };
  for (const auto& [keys, words] : {
           Case{sound, "no error"},
           {"name: a, label: 1, density_per_m2: 1, sizes_m: [1, 2]",
            "there must be exactly one of 'asset' and 'model'"},
           {"name: a, label: 1, density_per_m2: 1, asset: spruce", "key 'sizes_m': missing"},
           {"name: a, label: 1, density_per_m2: 1, asset: spruce, sizes_m: [2, 1]",
            "are its ends swapped?"},
           {"name: a, label: 1, density_per_m2: 1, asset: spruce, sizes_m: [0, 1]", "must be > 0"},
           {"name: a, label: 1, asset: spruce, sizes_m: [1, 2]", "key 'density_per_m2': missing"},
           {sound + ", size_m: 3", "follows from 'sizes_m' in an ecosystem"},
           {sound + ", tolerance: 2", "must be from 0 to 1"},
           {sound + ", zone: -1", "must be >= 0"},
           {sound + ", weibull: {shape: 0}", "must be from 0.2 to 20"},
           {sound + ", weibull: {scale: 3}", "did you mean 'scale_m'?"},
           {sound + ", variants: 0", "must be from 1 to 16"},
           {sound + ", scale: [1, 2]", "key 'scale': unknown"},
           {"name: a, label: 1, density_per_m2: 1, sizes_m: [1, 2], model: a.obj, variants: 2",
            "applies to 'asset', which is missing"},
       }) {
    EXPECT_THAT(about_species(keys), HasSubstr(words)) << keys;
  }
  EXPECT_THAT(
      complaint(scene_with("",
                           "scatter: [{name: a, label: 1, density_per_m2: 1, models: [{asset: "
                           "stone}]}]\necosystem: [{" +
                               sound + "}]\n")),
      HasSubstr("'a' is taken by an earlier layer"));
}

TEST(WorldReader, ReadsErosion) {
  const ErosionSpec erosion =
      parse(scene_with("  erosion: {talus_deg: 45, streams: {years: 1000, erodibility: 1.0e-4, "
                       "area_exponent: 0.4, steps: 7}}\n",
                       ""))
          .terrain.erosion.value();
  EXPECT_DOUBLE_EQ(erosion.talus_rad.value(), std::atan(1.0));
  EXPECT_EQ(erosion.streams->years, 1000);
  EXPECT_EQ(erosion.streams->erodibility, 1e-4);
  EXPECT_EQ(erosion.streams->area_exponent, 0.4);
  EXPECT_EQ(erosion.streams->slope_exponent, 1);
  EXPECT_EQ(erosion.streams->steps, 7);
}

TEST(WorldReader, ReportsFaultsInErosion) {
  const auto about = [](const std::string& keys) {
    return complaint(scene_with("  erosion: {" + keys + "}\n", ""));
  };
  EXPECT_THAT(about(""), HasSubstr("must have 'talus_deg' or 'streams', or both"));
  EXPECT_THAT(about("talus_deg: 90"), HasSubstr("must be from 5 to 80"));
  EXPECT_THAT(about("streams: {years: 1}"), HasSubstr("key 'erodibility': missing"));
  EXPECT_THAT(about("streams: {erodibility: 1}"), HasSubstr("key 'years': missing"));
  EXPECT_THAT(about("streams: {years: 1, erodibility: 1, steps: 0}"),
              HasSubstr("is 0, but must be at least 1"));
  EXPECT_THAT(about("streams: {years: 1, erodibility: 1, slope_exponent: 0}"),
              HasSubstr("must be from 0.25 to 4"));
  EXPECT_THAT(about("talus: 30"), HasSubstr("did you mean 'talus_deg'?"));
}

}  // namespace
}  // namespace groundray::world_reader_test
