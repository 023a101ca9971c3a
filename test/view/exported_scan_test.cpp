// Scans as groundray-export --to npz writes them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "apps/groundray/generate.h"
#include "apps/view/load_input.h"
#include "core/io/ply_io.h"
#include "test/support/npz_file.h"
#include "test/support/temporary_folder.h"
#include "test/view/sample_dataset.h"

namespace groundray::exported_scan_test {
namespace {

using ::testing::HasSubstr;
using testing::npy_of;
using testing::TemporaryFolder;
using testing::write_npz;
using Arrays = std::vector<std::pair<std::string, std::string>>;

// S is at (5, 6, 7) in D and turned by a quarter to the left: its x axis is D's y axis.
const std::vector<double> quarter_turn = {0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1};

Arrays exported_points() {
  return {{"X_DS", npy_of(quarter_turn, "(4, 4)")},
          {"origin_w_m", npy_of({429'000, 5'150'000, 300}, "(3,)")},
          {"x_m", npy_of({1, 0, 0}, "(3,)")},
          {"y_m", npy_of({0, 2, 0}, "(3,)")},
          {"z_m", npy_of({0, 0, 3}, "(3,)")}};
}

// As many points as X_DS has rows or origin_w_m has numbers must not turn these into columns.
TEST(ExportedScan, IsPlacedByItsPoseAndOrigin) {
  const TemporaryFolder folder;
  write_npz(folder / "scan.npz", exported_points());
  const Opened opened = open_any(folder / "scan.npz");
  const Layer& layer = opened.layers.at(0);
  ASSERT_EQ(layer.points(), 3u);
  EXPECT_LT(glm::distance(layer.p_w_m(0), {429'005, 5'150'007, 307}), 1e-6);
  EXPECT_LT(glm::distance(layer.p_w_m(1), {429'003, 5'150'006, 307}), 1e-6);
  EXPECT_LT(glm::distance(layer.p_w_m(2), {429'005, 5'150'006, 310}), 1e-6);
  EXPECT_EQ(layer.value(*layer.find("height"), 2), 310);
  EXPECT_EQ(layer.find("origin_w_m"), nullptr);
  EXPECT_THAT(opened.notes, ::testing::IsEmpty());
  EXPECT_THAT(layer.facts, ::testing::Contains(HasSubstr("placed by X_DS")));
}

TEST(ExportedScan, WorldCoordinatesTakePrecedence) {
  const TemporaryFolder folder;
  Arrays arrays = exported_points();
  for (const char* const axis : {"x", "y", "z"})
    arrays.emplace_back(fmt::format("world_{}_m", axis), npy_of({10, 11, 12.5}, "(3,)"));
  write_npz(folder / "scan.npz", arrays);
  const Layer layer = open_any(folder / "scan.npz").layers.at(0);
  for (vtkIdType i = 0; i < 3; ++i) {
    const double at_m = i == 2 ? 12.5 : 10 + static_cast<double>(i);
    EXPECT_LT(glm::distance(layer.p_w_m(i), {429'000 + at_m, 5'150'000 + at_m, 300 + at_m}), 1e-6);
  }
  EXPECT_THAT(layer.facts, ::testing::Contains(HasSubstr("placed by world_x")));
}

TEST(ExportedScan, IsNotPlacedByAMatrixThatIsNoPose) {
  const TemporaryFolder folder;
  Arrays arrays = exported_points();
  std::vector<double> scaled = quarter_turn;
  for (double& number : scaled) number *= 2;
  arrays[0].second = npy_of(scaled, "(4, 4)");
  write_npz(folder / "scan.npz", arrays);
  const Opened opened = open_any(folder / "scan.npz");
  EXPECT_EQ(opened.layers.at(0).p_w_m(1), glm::dvec3(0, 2, 0));
  EXPECT_THAT(opened.notes, ::testing::Contains(HasSubstr("X_DS (of 4 rows)")));
}

// Without noise and light, the dataset's points are those of the surface to 0.1 mm, at all times of
// a sweep during which the sensor moves and turns.
TEST(ExportedScan, LiesWhereTheDatasetShowsIt) {
  const TemporaryFolder folder;
  std::string scene = testing::sample_scene();
  for (const std::string_view part :
       {"    range_noise_sigma_m: 0.02\n",
        "    beam: {divergence_mrad: [3, 1.5], aperture_mm: [12, 8]}\n"})
    scene.erase(scene.find(part), part.size());
  groundray::generate(testing::write_sample_scene(folder.path(), scene), folder / "dataset", {});
  const Layer expected = open_any(folder / "dataset").layers.at(0);
  const PointCloud scan = read_ply(folder / "dataset/lidar/top/000000.ply").cloud;
  Arrays arrays = exported_points();
  arrays.resize(2);
  const RecordedDataset dataset = read_dataset(folder / "dataset");
  const glm::dvec3 origin_m = dataset.georeference.origin_w_m;
  arrays[1].second = npy_of({origin_m.x, origin_m.y, origin_m.z}, "(3,)");
  for (const char* const name : {"x", "y", "z", "world_x", "world_y", "world_z"}) {
    const auto column = std::ranges::find(scan.columns(), name, &PointCloud::Column::name);
    ASSERT_NE(column, scan.columns().end());
    std::visit(
        [&](const auto& values) {
          arrays.emplace_back(
              fmt::format("{}_m", name),
              npy_of({values.begin(), values.end()}, fmt::format("({},)", values.size())));
        },
        column->values);
  }
  write_npz(folder / "scan.npz", arrays);
  const Layer shown = open_any(folder / "scan.npz").layers.at(0);
  ASSERT_EQ(shown.points(), expected.points());
  ASSERT_GT(shown.points(), 5000u);
  for (vtkIdType i = 0; i < static_cast<vtkIdType>(shown.points()); ++i)
    ASSERT_LT(glm::distance(shown.p_w_m(i), expected.p_w_m(i)), 1e-3) << i;
}

}  // namespace
}  // namespace groundray::exported_scan_test
