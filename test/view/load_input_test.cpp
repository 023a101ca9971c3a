#include "apps/view/load_input.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkPolyData.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "apps/view/layers/cloud_layer.h"
#include "apps/view/layers/dem_layer.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "test/support/temporary_folder.h"
#include "test/support/terrain/geotiff.h"
#include "test/view/opened_samples.h"
#include "test/view/sample_dataset.h"

namespace groundray::load_input_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::OpenedSamples;
using testing::SampleDataset;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;
using testing::write_bytes;

TEST(Open, DistinguishesKindsOfInput) {
  const OpenedSamples& samples = OpenedSamples::get();
  const std::vector<std::pair<const char*, InputKind>> kinds = {
      {"mesh.ply", InputKind::Mesh},       {"mesh.obj", InputKind::Mesh},
      {"mesh.stl", InputKind::Mesh},       {"mesh.glb", InputKind::Mesh},
      {"cloud.pcd", InputKind::Cloud},     {"cloud.ply", InputKind::Cloud},
      {"cloud.npy", InputKind::Cloud},     {"cloud.npz", InputKind::Cloud},
      {"cloud.bin", InputKind::Cloud},     {"light.hdr", InputKind::Picture},
      {"picture.jpg", InputKind::Picture}, {"fused.tif", InputKind::Dem},
      {"hills.asc", InputKind::Dem},       {"picture.png", InputKind::Picture},
      {"light.exr", InputKind::Picture},   {"depth.exr", InputKind::Picture},
      {"photo.tif", InputKind::Picture}};
  for (const auto& [name, kind] : kinds) {
    EXPECT_EQ(kind_of(samples[name]), kind) << name;
    const Opened opened = open_any(samples[name]);
    EXPECT_EQ(opened.kind, kind) << name;
    ASSERT_EQ(opened.layers.size(), 1u) << name;
    EXPECT_GT(opened.layers[0].points(), 0u) << name;
    EXPECT_EQ(opened.picture != nullptr, kind == InputKind::Picture) << name;
  }
}

TEST(Open, PlacesMeshesInWorldCoordinates) {
  for (const char* const name : {"mesh.ply", "mesh.obj", "mesh.stl", "mesh.glb"}) {
    const Layer layer = open_any(OpenedSamples::get()[name]).layers.at(0);
    EXPECT_EQ(layer.triangles(), 4u);
    std::array<double, 6> bounds{};
    layer.data->GetBounds(bounds.data());
    EXPECT_NEAR(bounds[0] + layer.origin_w_m.x, 500'000, 1e-6) << name;
    EXPECT_NEAR(bounds[5] + layer.origin_w_m.z, 8, 1e-6) << name;
  }
}

TEST(Open, CloudsKeepTheirColumnsAndPositions) {
  const Opened opened = open_any(OpenedSamples::get()["cloud.ply"]);
  const Layer& layer = opened.layers.at(0);
  EXPECT_NEAR(glm::distance(layer.p_w_m(0), glm::dvec3(500'000.125, 4'000'000.25, 7)), 0, 1e-6);
  const LayerColumn* const label = layer.find("label");
  ASSERT_NE(label, nullptr);
  EXPECT_EQ(layer.value(*label, 1), 9);
  EXPECT_EQ(label->categories.size(), 2u);
  EXPECT_EQ(layer.coloured_by, "colour");
}

// Expected values: those written into the files by hand, and for the archive by NumPy.
TEST(Open, ReadsArraysAsClouds) {
  const OpenedSamples& samples = OpenedSamples::get();
  for (const char* const name : {"cloud.npy", "cloud.bin"}) {
    const Layer layer = open_any(samples[name]).layers.at(0);
    ASSERT_EQ(layer.points(), 2u) << name;
    EXPECT_EQ(layer.p_w_m(0), glm::dvec3(1, 2, 3)) << name;
    EXPECT_EQ(layer.p_w_m(1), glm::dvec3(-4, 5, 6)) << name;
    ASSERT_NE(layer.find("intensity"), nullptr) << name;
    EXPECT_EQ(layer.value(*layer.find("intensity"), 1), 0.25) << name;
  }
  const Opened archive = open_any(samples["cloud.npz"]);
  const Layer& layer = archive.layers.at(0);
  ASSERT_EQ(layer.points(), 4u);
  EXPECT_EQ(layer.p_w_m(2), glm::dvec3(2, 0, -1.25));
  EXPECT_NE(layer.find("ring"), nullptr);
  EXPECT_THAT(archive.notes, ::testing::Contains(HasSubstr("names")));  // holds no numbers
}

// Names and units as groundray-export and the Python package write them.
TEST(Open, ReadsCloudsWithUnitsInTheirColumnNames) {
  TemporaryFolder folder;
  const std::vector<float> rows = {1, 2, 3, 40, -4, 5, 6, 50};
  const std::vector<NpyField> fields = {
      {"x_m", "<f4"}, {"y_m", "<f4"}, {"z_m", "<f4"}, {"range_true_m", "<f4"}};
  write_npy(folder / "own.npy", fields, 2, std::as_bytes(std::span(rows)));
  const Layer layer = open_any(folder / "own.npy").layers.at(0);
  ASSERT_EQ(layer.points(), 2u);
  EXPECT_EQ(layer.p_w_m(1), glm::dvec3(-4, 5, 6));
  EXPECT_EQ(layer.find("x_m"), nullptr);
  ASSERT_NE(layer.find("range_true_m"), nullptr);
  EXPECT_EQ(layer.find("range_true_m")->unit, "m");
}

TEST(Open, IgnoresColoursThatAreAllBlack) {
  TemporaryFolder folder;
  for (const bool is_black : {true, false}) {
    write_bytes(folder / "mesh.ply",
                std::string("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty "
                            "float y\nproperty float z\nproperty uchar red\nproperty uchar "
                            "green\nproperty uchar blue\nelement face 1\nproperty list uchar int "
                            "vertex_indices\nend_header\n0 0 0 0 0 0\n1 0 0 0 0 0\n0 1 0 0 0 ") +
                    (is_black ? "0" : "1") + "\n3 0 1 2\n");
    const Layer layer = open_any(folder / "mesh.ply").layers.at(0);
    EXPECT_EQ(layer.coloured_by, is_black ? "" : "colour");
    EXPECT_EQ(layer.find("colour") == nullptr, is_black);
    const auto reports = ::testing::Contains(HasSubstr("all black"));
    if (is_black) {
      EXPECT_THAT(layer.facts, reports);
    } else {
      EXPECT_THAT(layer.facts, ::testing::Not(reports));
    }
  }
}

TEST(Open, PlacesLocalCoordinatesAtAnOrigin) {
  const OpenedSamples& samples = OpenedSamples::get();
  Opened cloud = open_any(samples["cloud.npy"]);
  EXPECT_FALSE(place_input(cloud, {.text = "", .input = "other.npy", .origin_w_m = {1, 1, 1}}));
  EXPECT_TRUE(place_input(cloud, {.text = "", .input = "", .origin_w_m = {5e5, 4e6, 100}}));
  const Layer& layer = cloud.layers.at(0);
  EXPECT_EQ(layer.p_w_m(0), glm::dvec3(500'001, 4'000'002, 103));
  EXPECT_EQ(layer.value(*layer.find("height"), 0), 103);
  EXPECT_EQ(layer.find("height")->range, glm::dvec2(103, 106));
  // A file that states its origin is moved only if it is named.
  Opened mesh = open_any(samples["mesh.ply"]);
  EXPECT_EQ(mesh.layers.at(0).frame_w_m, glm::dvec3(500'000, 4'000'000, 7));
  EXPECT_FALSE(place_input(mesh, {.text = "", .input = "", .origin_w_m = {1, 2, 3}}));
  EXPECT_TRUE(place_input(mesh, {.text = "", .input = "mesh.ply", .origin_w_m = {1, 2, 3}}));
  EXPECT_EQ(mesh.layers.at(0).p_w_m(1), glm::dvec3(2, 2, 3));
  Opened dem = open_any(samples["hills.asc"]);
  EXPECT_FALSE(place_input(dem, {.text = "", .input = "hills.asc", .origin_w_m = {1, 2, 3}}));
}

// Radiances of 1 and 2 get the same exposure factor; the second pixel is at the maximum brightness.
TEST(Open, ExposesRadiance) {
  const Opened opened = open_any(OpenedSamples::get()["light.hdr"]);
  const Image8& shown = *opened.picture;
  ASSERT_EQ(shown.width(), 2);
  EXPECT_EQ(shown.at(0, 0)[1], 0);
  EXPECT_GT(shown.at(0, 0)[0], shown.at(0, 0)[2]);
  EXPECT_GT(shown.at(1, 0)[0], shown.at(0, 0)[0]);
  EXPECT_EQ(shown.at(1, 0)[2], shown.at(0, 0)[0]);  // both are 1
}

TEST(Open, OmitsRowsWithoutAPosition) {
  const Layer layer = open_any(OpenedSamples::get()["cloud.pcd"]).layers.at(0);
  EXPECT_EQ(layer.points(), 2u);
  EXPECT_THAT(layer.facts, ::testing::Contains("1 rows without a position"));
  EXPECT_EQ(layer.value(*layer.find("intensity"), 1), 0.25);
  EXPECT_EQ(layer.value(*layer.find("row"), 1), 1);
}

// If the file has a column of that name, it remains unchanged.
TEST(Open, PointsKeepTheirRowNumbers) {
  TemporaryFolder folder;
  write_bytes(folder / "rows.pcd",
              "VERSION .7\nFIELDS x y z row\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
              "WIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n1 2 3 70\nnan nan nan 80\n4 5 6 90\n");
  const Layer layer = open_any(folder / "rows.pcd").layers.at(0);
  EXPECT_EQ(layer.value(*layer.find("row"), 1), 90);
  EXPECT_EQ(table_row(layer, 0), 0u);
  EXPECT_EQ(table_row(layer, 1), 2u);
  EXPECT_EQ(table_row(open_any(OpenedSamples::get()["cloud.ply"]).layers.at(0), 1), 1u);
}

TEST(Open, RejectsImplausibleCoordinates) {
  TemporaryFolder folder;
  const auto cloud = [&](const std::string& x, const std::string& amplitude) {
    write_bytes(folder / "far.pcd",
                "VERSION .7\nFIELDS x y z amplitude\nSIZE 8 8 8 8\nTYPE F F F F\nCOUNT 1 1 1 1\n"
                "WIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n1 2 3 4\n" +
                    x + " 2 3 " + amplitude + "\n");
    return folder / "far.pcd";
  };
  for (const char* const x : {"1e300", "-2e15", "1e38"}) {
    EXPECT_THAT([&] { open_any(cloud(x, "5")); },
                ThrowsMessage<Error>(AllOf(HasSubstr("far.pcd"), HasSubstr("1e+15 m"))));
  }
  const Layer layer = open_any(cloud("1e14", "1e300")).layers.at(0);
  EXPECT_THAT(layer.facts, ::testing::Contains(HasSubstr("1 values of 'amplitude' are beyond")));
  testing::GeoTiff dem{.size = {8, 8}};
  dem.values.assign(64, 1e38);
  dem.save(folder / "far.tif");
  EXPECT_THAT([&] { open_any(folder / "far.tif"); }, ThrowsMessage<Error>(HasSubstr("far.tif")));
}

// A cone of heights in geographic coordinates, with a second band: the first band is shown in its
// UTM zone and can be compared with.
TEST(Open, ReprojectsDemsInDegrees) {
  TemporaryFolder folder;
  testing::GeoTiff dem{
      .size = {30, 20}, .geotransform = {9, 1e-3, 0, 47, 0, -1e-3}, .crs = "EPSG:4326"};
  dem.values.assign(1200, 250);
  dem.save(folder / "degrees.tif");
  write_bytes(folder / "degrees.vrt",
              "<VRTDataset rasterXSize=\"30\" rasterYSize=\"20\"><SRS>EPSG:4326</SRS><GeoTransform>"
              "9,0.001,0,47,0,-0.001</GeoTransform>"
              "<VRTRasterBand dataType=\"Float32\" band=\"1\"><Description>elevation</Description>"
              "<SimpleSource><SourceFilename relativeToVRT=\"1\">degrees.tif</SourceFilename>"
              "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand>"
              "<VRTRasterBand dataType=\"Float32\" band=\"2\"><SimpleSource><SourceFilename "
              "relativeToVRT=\"1\">degrees.tif</SourceFilename><SourceBand>2</SourceBand>"
              "</SimpleSource></VRTRasterBand></VRTDataset>");
  const Opened opened = open_any(folder / "degrees.vrt");
  const Layer& layer = opened.layers.at(0);
  EXPECT_THAT(opened.notes, ::testing::Contains(HasSubstr("UTM zone")));
  EXPECT_THAT(opened.notes, ::testing::Contains(HasSubstr("of its 2 bands the first")));
  // 9 degrees east is the central meridian of zone 32; 47 degrees north is 5205 km from the
  // equator.
  for (vtkIdType i = 0; i < layer.data->GetNumberOfPoints(); ++i) {
    const glm::dvec3 p = layer.p_w_m(i);
    EXPECT_NEAR(p.x, 501'000, 2'000);
    EXPECT_NEAR(p.y, 5'204'000, 3'000);
    EXPECT_NEAR(p.z, 250, 1e-3);
  }
  EXPECT_EQ(options_for(folder / "degrees.vrt").reproject_to, "utm");
  EXPECT_EQ(options_for(OpenedSamples::get()["fused.tif"]).reproject_to, "");
}

TEST(Open, ShowsTheFirstOfManyBands) {
  TemporaryFolder folder;
  testing::GeoTiff many{.size = {6, 5}};
  for (int i = 0; i < 30 * 40; ++i) many.values.push_back(i);
  many.save(folder / "bands.tif");
  std::string vrt =
      "<VRTDataset rasterXSize=\"6\" rasterYSize=\"5\"><SRS>EPSG:32631</SRS><GeoTransform>"
      "500000,2,0,5150000,0,-2</GeoTransform>";
  for (int band = 1; band <= 40; ++band)
    vrt += fmt::format(
        "<VRTRasterBand dataType=\"Float32\" band=\"{0}\"><Description>{1}</Description>"
        "<SimpleSource><SourceFilename relativeToVRT=\"1\">bands.tif</SourceFilename><SourceBand>"
        "{0}</SourceBand></SimpleSource></VRTRasterBand>",
        band, band == 1 ? "elevation" : fmt::format("of {}", band));
  write_bytes(folder / "bands.vrt", vrt + "</VRTDataset>");
  const Opened opened = open_any(folder / "bands.vrt");
  EXPECT_THAT(opened.notes, ::testing::Contains(HasSubstr("the first 32 of 40 bands")));
  EXPECT_NE(opened.layers.at(0).find("of 32"), nullptr);
  EXPECT_EQ(opened.layers.at(0).find("of 33"), nullptr);
}

// A dataset gets its name whatever path it is opened by.
TEST(Open, DatasetNamesDoNotDependOnThePath) {
  const std::filesystem::path before = std::filesystem::current_path();
  const std::filesystem::path folder = std::filesystem::absolute(SampleDataset::get().path());
  std::filesystem::current_path(folder);
  for (const char* const path : {".", "dataset.yaml", "./dataset.yaml", "./"})
    EXPECT_EQ(open_any(path).path.filename(), (folder / "").parent_path().filename()) << path;
  std::filesystem::current_path(before);
}

// Constant values are drawn as valid ones: viridis has no grey.
TEST(Open, ConstantPicturesHaveAColour) {
  TemporaryFolder folder;
  ImageF depth(4, 3, 1);
  std::ranges::fill(depth.values(), 7.0f);
  write_exr(folder / "flat.exr", {{{"Z"}, &depth}});
  const Opened opened = open_any(folder / "flat.exr");
  const auto pixel = opened.picture->at(1, 1);
  EXPECT_NE(pixel[0], pixel[1]);
}

TEST(Open, DemsHaveTheirBandsAndOmitHoles) {
  const Layer layer = open_any(OpenedSamples::get()["fused.tif"]).layers.at(0);
  // 11 x 8 cells; of the 9 in and round the void, two keep one triangle each.
  EXPECT_EQ(layer.triangles(), 2u * (88 - 9) + 2);
  const LayerColumn* const confidence = layer.find("confidence");
  ASSERT_NE(confidence, nullptr);
  ASSERT_NE(layer.find("height"), nullptr);
  for (vtkIdType i = 0; i < layer.data->GetNumberOfPoints(); ++i) {
    const glm::dvec3 p = layer.p_w_m(i) - glm::dvec3(500'000, 4'000'000, 0);
    EXPECT_NEAR(p.z, 10 + 0.25 * p.x, 1e-5);
    EXPECT_NEAR(layer.value(*confidence, i), -p.y, 1e-5);
  }
  for (vtkIdType i = 0; i < layer.data->GetNumberOfPolys(); ++i)
    ASSERT_NEAR(layer.value(*layer.find("slope"), i), glm::degrees(std::atan(0.25)), 1e-3);
}

TEST(Open, ScenesShowGroundObjectsAndSensors) {
  TemporaryFolder folder;
  const Opened opened =
      open_any(testing::write_sample_scene(folder.path(), testing::sample_scene()));
  std::vector<std::string> names;
  for (const Layer& layer : opened.layers) names.push_back(layer.name);
  EXPECT_THAT(names, ::testing::ElementsAre("terrain", "objects/post", "objects/cart",
                                            "sensors/top", "path/top", "sensors/eye", "path/eye"));
  EXPECT_TRUE(opened.simulation);
  EXPECT_TRUE(opened.follower);
  ASSERT_TRUE(opened.look);
  // The lidar is 1.6 m above the body, which starts at (80, 80, 54).
  EXPECT_LT(glm::distance(opened.look->at_w_m, glm::dvec3(80.2, 80, 55.6)), 0.2);
  EXPECT_NE(opened.layers[0].find("colour"), nullptr);
}

TEST(Open, ScenesOfAircraftShowTheGroundBelow) {
  TemporaryFolder folder;
  std::string scene = testing::sample_scene();
  scene.replace(scene.find("[0.2, 0, 1.6]"), 13, "[0.2, 0, 300]");
  const Opened opened = open_any(testing::write_sample_scene(folder.path(), scene));
  const glm::dvec3 at_D = opened.look->at_w_m - opened.simulation->terrain.header().origin_w_m;
  const auto ground_m = opened.simulation->terrain.ground().height_m_at(glm::dvec2(at_D));
  ASSERT_TRUE(ground_m);
  EXPECT_NEAR(at_D.z, *ground_m, 1e-6);
  EXPECT_GT(opened.look->from_w_m.z - opened.look->at_w_m.z, 90);
}

// Scans hold the true position of each echo; the points differ from it by range noise of 2 cm.
TEST(Open, ScansOfDatasetsMatchTheTruth) {
  const Opened opened = open_any(SampleDataset::get().path());
  const auto lidar = std::ranges::find_if(
      opened.layers, [](const Layer& layer) { return layer.name == "lidar/top"; });
  ASSERT_NE(lidar, opened.layers.end());
  ASSERT_GT(lidar->points(), 1000u);
  const std::array<const LayerColumn*, 3> truth = {lidar->find("world_x"), lidar->find("world_y"),
                                                   lidar->find("world_z")};
  double sum = 0;
  for (vtkIdType i = 0; i < lidar->data->GetNumberOfPoints(); ++i) {
    glm::dvec3 p;
    for (std::size_t k = 0; k < 3; ++k)
      p[static_cast<glm::length_t>(k)] = lidar->value(*truth[k], i);
    const double off_m =
        glm::distance(lidar->p_w_m(i), p + opened.dataset->georeference.origin_w_m);
    ASSERT_LT(off_m, 0.5);
    sum += off_m * off_m;
  }
  EXPECT_LT(std::sqrt(sum / static_cast<double>(lidar->points())), 0.05);
  const LayerColumn* const label = lidar->find("label");
  ASSERT_NE(label, nullptr);
  EXPECT_EQ(label->categories.at(3), opened.run->names.labels.at(3));
  ASSERT_NE(lidar->find("range"), nullptr);
}

TEST(Open, ThinsLargeInputs) {
  const OpenedSamples& samples = OpenedSamples::get();
  const Opened cloud = open_any(samples["cloud.ply"], {.points = 1});
  EXPECT_EQ(cloud.layers.at(0).points(), 1u);
  ASSERT_EQ(cloud.notes.size(), 1u);
  EXPECT_THAT(cloud.notes[0], HasSubstr("thinned from 2 points"));
  const Opened dem = open_any(samples["fused.tif"], {.triangles = 60});
  EXPECT_LE(dem.layers.at(0).points(), 30u);
  EXPECT_THAT(dem.notes.at(0), HasSubstr("every 2. sample"));
  for (const char* const name : {"cloud.ply", "mesh.ply"}) {
    EXPECT_THAT([&] { open_any(samples[name], {.file_bytes = 20}); },
                ThrowsMessage<Error>(AllOf(HasSubstr(name), HasSubstr("thin it out"))));
  }
}

}  // namespace
}  // namespace groundray::load_input_test
