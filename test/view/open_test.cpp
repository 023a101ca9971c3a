#include "apps/view/open.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vtkPolyData.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <string>

#include "apps/view/cloud_layer.h"
#include "apps/view/dem_layer.h"
#include "core/error.h"
#include "core/exr_io.h"
#include "core/mesh_io.h"
#include "core/product_io.h"
#include "terrain/layers_io.h"
#include "test/support/geotiff.h"
#include "test/support/temporary_folder.h"
#include "test/view/sample_dataset.h"

namespace groundray {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::SampleDataset;
using testing::TemporaryFolder;
using ::testing::ThrowsMessage;

TriangleMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
          {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}},
          {}};
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::string read_text(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

// Elevations 10 + column / 2 with a void of 2 x 2 samples, and a second band of twice the row.
void write_two_bands(const std::filesystem::path& path) {
  constexpr int columns = 12, rows = 9;
  std::vector<float> height, other;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const bool is_void = (row == 4 || row == 5) && (column == 6 || column == 7);
      height.push_back(is_void ? std::numeric_limits<float>::quiet_NaN()
                               : 10 + 0.5f * static_cast<float>(column));
      other.push_back(2 * static_cast<float>(row));
    }
  }
  const GridFrame frame{{columns, rows}, {0, 0}, {2, -2}, {0.5, -0.5}};
  const std::vector<RasterLayer> layers = {{"elevation", "m", height}, {"confidence", "", other}};
  write_layers(path, frame, {.origin_w_m = {500'000, 4'000'000, 0}}, layers);
}

// A file or folder of each kind; made once.
class Samples {
 public:
  static const Samples& get() {
    static const Samples samples;
    return samples;
  }
  std::filesystem::path operator[](const char* name) const { return folder_ / name; }

 private:
  Samples() {
    for (const char* const name : {"mesh.ply", "mesh.obj", "mesh.stl", "mesh.glb"})
      write_mesh(folder_ / name, tetrahedron(), {.origin_w_m = {500'000, 4'000'000, 7}});
    write_text(folder_ / "cloud.pcd",
               "VERSION .7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
               "WIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n1 2 3 0.5\n4 5 6 0.25\nnan nan nan 0\n");
    write_text(folder_ / "cloud.ply",
               "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\n"
               "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
               "property ushort label\nend_header\n"
               "500000.125 4000000.25 7 255 0 0 3\n500001 4000001 8 0 255 0 9\n");
    write_two_bands(folder_ / "fused.tif");
    testing::write_hills(folder_ / "hills.asc");
    Image8 picture(40, 30, 3);
    for (std::size_t i = 0; i < picture.values().size(); ++i)
      picture.values()[i] = static_cast<std::uint8_t>(i * 7);
    write_png(folder_ / "picture.png", picture);
    ImageF light(16, 8, 3), depth(16, 8, 1);
    for (std::size_t i = 0; i < depth.values().size(); ++i)
      depth.values()[i] = static_cast<float>(i);
    write_exr(folder_ / "light.exr", {{{"R", "G", "B"}, &light}, {{"Z"}, &depth}});
    write_exr(folder_ / "depth.exr", {{{"Z"}, &depth}});
    testing::GeoTiff photo{.size = {20, 10}, .type = GDT_Byte};
    photo.values.assign(600, 77);
    photo.save(folder_ / "photo.tif");
  }
  TemporaryFolder folder_;
};

TEST(Open, TellsKindsApart) {
  const Samples& samples = Samples::get();
  const std::vector<std::pair<const char*, InputKind>> kinds = {
      {"mesh.ply", InputKind::Mesh},       {"mesh.obj", InputKind::Mesh},
      {"mesh.stl", InputKind::Mesh},       {"mesh.glb", InputKind::Mesh},
      {"cloud.pcd", InputKind::Cloud},     {"cloud.ply", InputKind::Cloud},
      {"fused.tif", InputKind::Dem},       {"hills.asc", InputKind::Dem},
      {"picture.png", InputKind::Picture}, {"light.exr", InputKind::Picture},
      {"depth.exr", InputKind::Picture},   {"photo.tif", InputKind::Picture}};
  for (const auto& [name, kind] : kinds) {
    EXPECT_EQ(kind_of(samples[name]), kind) << name;
    const Opened opened = open_any(samples[name]);
    EXPECT_EQ(opened.kind, kind) << name;
    ASSERT_EQ(opened.layers.size(), 1u) << name;
    EXPECT_GT(opened.layers[0].points(), 0u) << name;
    EXPECT_EQ(opened.picture != nullptr, kind == InputKind::Picture) << name;
  }
}

TEST(Open, MeshesStandWhereTheirFilesSay) {
  for (const char* const name : {"mesh.ply", "mesh.obj", "mesh.stl", "mesh.glb"}) {
    const Layer layer = open_any(Samples::get()[name]).layers.at(0);
    EXPECT_EQ(layer.triangles(), 4u);
    std::array<double, 6> bounds{};
    layer.data->GetBounds(bounds.data());
    EXPECT_NEAR(bounds[0] + layer.origin_w_m.x, 500'000, 1e-6) << name;
    EXPECT_NEAR(bounds[5] + layer.origin_w_m.z, 8, 1e-6) << name;
  }
}

TEST(Open, CloudsKeepTheirColumnsAndPlaces) {
  const Opened opened = open_any(Samples::get()["cloud.ply"]);
  const Layer& layer = opened.layers.at(0);
  EXPECT_NEAR(glm::distance(layer.p_w_m(0), glm::dvec3(500'000.125, 4'000'000.25, 7)), 0, 1e-6);
  const LayerColumn* const label = layer.find("label");
  ASSERT_NE(label, nullptr);
  EXPECT_EQ(layer.value(*label, 1), 9);
  EXPECT_EQ(label->categories.size(), 2u);
  EXPECT_EQ(layer.coloured_by, "colour");
}

TEST(Open, RowsWithoutAPlaceAreLeftOut) {
  const Layer layer = open_any(Samples::get()["cloud.pcd"]).layers.at(0);
  EXPECT_EQ(layer.points(), 2u);
  EXPECT_THAT(layer.facts, ::testing::Contains("1 rows without a position"));
  EXPECT_EQ(layer.value(*layer.find("intensity"), 1), 0.25);
  EXPECT_EQ(layer.value(*layer.find("row"), 1), 1);
}

// A column of that name of the file's own stays what it is.
TEST(Open, PointsKnowTheirRows) {
  TemporaryFolder folder;
  write_text(folder / "rows.pcd",
             "VERSION .7\nFIELDS x y z row\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
             "WIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA ascii\n1 2 3 70\nnan nan nan 80\n4 5 6 90\n");
  const Layer layer = open_any(folder / "rows.pcd").layers.at(0);
  EXPECT_EQ(layer.value(*layer.find("row"), 1), 90);
  EXPECT_EQ(table_row(layer, 0), 0u);
  EXPECT_EQ(table_row(layer, 1), 2u);
  EXPECT_EQ(table_row(open_any(Samples::get()["cloud.ply"]).layers.at(0), 1), 1u);
}

TEST(Open, RefusesPlacesBeyondAnyPicture) {
  TemporaryFolder folder;
  const auto cloud = [&](const std::string& x, const std::string& amplitude) {
    write_text(folder / "far.pcd",
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
  EXPECT_THAT(layer.facts, ::testing::Contains(HasSubstr("1 numbers of 'amplitude' are beyond")));
  testing::GeoTiff dem{.size = {8, 8}};
  dem.values.assign(64, 1e38);
  dem.save(folder / "far.tif");
  EXPECT_THAT([&] { open_any(folder / "far.tif"); }, ThrowsMessage<Error>(HasSubstr("far.tif")));
}

// A cone of heights in degrees, with a second band: its first is shown in the UTM zone, and can be
// measured against.
TEST(Open, DemsInDegreesAreWarped) {
  TemporaryFolder folder;
  testing::GeoTiff dem{
      .size = {30, 20}, .geotransform = {9, 1e-3, 0, 47, 0, -1e-3}, .crs = "EPSG:4326"};
  dem.values.assign(1200, 250);
  dem.save(folder / "degrees.tif");
  write_text(folder / "degrees.vrt",
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
  // 9 degrees east is the central meridian of zone 32, 47 degrees north 5205 km from the equator.
  for (vtkIdType i = 0; i < layer.data->GetNumberOfPoints(); ++i) {
    const glm::dvec3 p = layer.p_w_m(i);
    EXPECT_NEAR(p.x, 501'000, 2'000);
    EXPECT_NEAR(p.y, 5'204'000, 3'000);
    EXPECT_NEAR(p.z, 250, 1e-3);
  }
  EXPECT_EQ(options_for(folder / "degrees.vrt").reproject_to, "utm");
  EXPECT_EQ(options_for(Samples::get()["fused.tif"]).reproject_to, "");
}

TEST(Open, RastersOfManyBandsShowTheFirst) {
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
  write_text(folder / "bands.vrt", vrt + "</VRTDataset>");
  const Opened opened = open_any(folder / "bands.vrt");
  EXPECT_THAT(opened.notes, ::testing::Contains(HasSubstr("the first 32 of 40 bands")));
  EXPECT_NE(opened.layers.at(0).find("of 32"), nullptr);
  EXPECT_EQ(opened.layers.at(0).find("of 33"), nullptr);
}

// A dataset has a name wherever it is opened from.
TEST(Open, DatasetsAreNamedFromWithin) {
  const std::filesystem::path before = std::filesystem::current_path();
  const std::filesystem::path folder = std::filesystem::absolute(SampleDataset::get().path());
  std::filesystem::current_path(folder);
  for (const char* const path : {".", "dataset.yaml", "./dataset.yaml", "./"})
    EXPECT_EQ(open_any(path).path.filename(), (folder / "").parent_path().filename()) << path;
  std::filesystem::current_path(before);
}

// Equal numbers are no missing ones: viridis has no grey.
TEST(Open, ConstantPicturesHaveAColour) {
  TemporaryFolder folder;
  ImageF depth(4, 3, 1);
  std::ranges::fill(depth.values(), 7.0f);
  write_exr(folder / "flat.exr", {{{"Z"}, &depth}});
  const Opened opened = open_any(folder / "flat.exr");
  const auto pixel = opened.picture->at(1, 1);
  EXPECT_NE(pixel[0], pixel[1]);
}

TEST(Open, DemsHaveTheirBandsAndNoVoids) {
  const Layer layer = open_any(Samples::get()["fused.tif"]).layers.at(0);
  // 11 x 8 cells; of the 9 round and in the void two keep a triangle.
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

TEST(Open, ScenesShowGroundThingsAndSensors) {
  TemporaryFolder folder;
  const Opened opened =
      open_any(testing::write_sample_scene(folder.path(), testing::sample_scene()));
  std::vector<std::string> names;
  for (const Layer& layer : opened.layers) names.push_back(layer.name);
  EXPECT_THAT(names, ::testing::ElementsAre("terrain", "objects/post", "objects/cart",
                                            "sensors/top", "path/top", "sensors/eye", "path/eye"));
  EXPECT_TRUE(opened.world);
  EXPECT_TRUE(opened.follower);
  ASSERT_TRUE(opened.look);
  // The lidar is 1.6 m above the body, which begins at (80, 80, 54).
  EXPECT_LT(glm::distance(opened.look->at_w_m, glm::dvec3(80.2, 80, 55.6)), 0.2);
  EXPECT_NE(opened.layers[0].find("colour"), nullptr);
}

// Scans tell the true place of each echo, but for noise of 2 cm.
TEST(Open, ScansOfDatasetsLieOnTheTruth) {
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

TEST(Open, ThinsWhatIsTooMuch) {
  const Samples& samples = Samples::get();
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

TEST(Open, NamesWhatCannotBeShown) {
  TemporaryFolder folder;
  EXPECT_THAT([&] { open_any(folder / "absent.ply"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("absent.ply"), HasSubstr("no such file"))));
  EXPECT_THAT([&] { open_any(folder.path()); }, ThrowsMessage<Error>(HasSubstr("no dataset.yaml")));
  write_text(folder / "letter.txt", "Dear reader,\n");
  EXPECT_THAT([&] { open_any(folder / "letter.txt"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("letter.txt"), HasSubstr("nothing that can"))));
  write_text(folder / "empty.ply",
             "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
             "property float z\nend_header\n");
  EXPECT_THAT([&] { open_any(folder / "empty.ply"); },
              ThrowsMessage<Error>(HasSubstr("empty.ply")));
}

// 10^10 samples and 3.6 * 10^9 pixels, announced by small files.
TEST(Open, RefusesWhatIsFarTooLarge) {
  TemporaryFolder folder;
  write_text(folder / "world.vrt",
             "<VRTDataset rasterXSize=\"100000\" rasterYSize=\"100000\"><GeoTransform>0,1,0,0,0,-1"
             "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\"/></VRTDataset>");
  EXPECT_THAT([&] { open_any(folder / "world.vrt"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("world.vrt"), HasSubstr("terrain certify"))));
  std::string picture = read_text(Samples::get()["picture.png"]);
  picture.replace(16, 8, std::string("\0\0\xea\x60\0\0\xea\x60", 8));
  write_text(folder / "huge.png", picture);
  EXPECT_THAT([&] { open_any(folder / "huge.png"); }, ThrowsMessage<Error>(HasSubstr("huge.png")));
}

// Whatever is done to a file, it opens or is refused with a message that names it.
TEST(Open, BrokenFilesAreRefused) {
  TemporaryFolder folder;
  int refused = 0;
  for (const char* const name :
       {"mesh.ply", "mesh.obj", "mesh.stl", "mesh.glb", "cloud.pcd", "cloud.ply", "fused.tif",
        "hills.asc", "picture.png", "light.exr", "photo.tif"}) {
    const std::string whole = read_text(Samples::get()[name]);
    std::vector<std::string> broken;
    for (const double share : {0.0, 0.1, 0.35, 0.7, 0.98})
      broken.push_back(whole.substr(0, static_cast<std::size_t>(share * double(whole.size()))));
    for (std::size_t i = 0; i < 20; ++i) {
      broken.push_back(whole);
      broken.back()[(i * 2654435761U) % std::min<std::size_t>(whole.size(), 400)] ^=
          static_cast<char>(1U << (i % 8));
    }
    for (const std::string& bytes : broken) {
      write_text(folder / name, bytes);
      try {
        open_any(folder / name);
      } catch (const Error& fault) {
        EXPECT_THAT(fault.what(), HasSubstr(name));
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 60);
}

}  // namespace
}  // namespace groundray
