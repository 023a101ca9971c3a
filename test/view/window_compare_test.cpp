#include <QComboBox>
#include <QPushButton>
#include <QTest>
#include <string>

#include "apps/view/window/window.h"
#include "core/io/mesh_io.h"
#include "core/io/ply_io.h"
#include "test/view/sample_dataset.h"
#include "test/view/window_fixture.h"

namespace groundray::window_compare_test {
namespace {

using testing::SampleDataset;
using testing::TemporaryFolder;
using WindowCompareTest = testing::WindowTest;

double metres(const std::string& text) { return std::stod(text); }

TEST_F(WindowCompareTest, ComparesWithTheTruth) {
  Window& window = shown();
  const TemporaryFolder folder;
  constexpr double offset_m = 0.25;
  TriangleMesh truth, raised;
  constexpr unsigned side = 11;
  for (unsigned i = 0; i < side * side; ++i) {
    truth.vertices_m.emplace_back(i % side, i / side, 0);
    // Half of the vertices are raised, the rest lowered, so that the mean alone does not describe
    // the deviation.
    raised.vertices_m.emplace_back(i % side, i / side, i % 2 == 0 ? offset_m : -offset_m);
  }
  for (unsigned row = 0; row + 1 < side; ++row) {
    for (unsigned column = 0; column + 1 < side; ++column) {
      const unsigned a = row * side + column, b = a + 1, c = a + side, d = c + 1;
      for (TriangleMesh* mesh : {&truth, &raised}) {
        mesh->triangles.emplace_back(a, b, d);
        mesh->triangles.emplace_back(a, d, c);
      }
    }
  }
  write_ply(folder / "truth.ply", truth, {});
  write_ply(folder / "raised.ply", raised, {});
  open(folder / "truth.ply");
  open(folder / "raised.ply");
  ComparePanel& panel = window.compare_panel();
  panel.choose("raised.ply", "surface of truth.ply");
  QTest::keyClick(&window, Qt::Key_C);
  QTest::mouseClick(panel.findChild<QPushButton*>("compare"), Qt::LeftButton);
  settle();
  EXPECT_EQ(dismiss_fault(), "");
  // 61 of the 121 vertices are above, 60 below; offsets of 1/4 m are exact in single precision.
  EXPECT_EQ(panel.figures().value("points"), "121");
  EXPECT_NEAR(metres(panel.figures().value("mean")), offset_m / 121, 1e-5);
  EXPECT_NEAR(metres(panel.figures().value("RMS")), offset_m, 1e-5);
  EXPECT_NEAR(metres(panel.figures().value("largest")), offset_m, 1e-5);
  const Layer& layer = *window.view().find("raised.ply");
  EXPECT_EQ(layer.coloured_by, "deviation");
  const LayerColumn* column = layer.find("deviation");
  ASSERT_NE(column, nullptr);
  for (vtkIdType i = 0; i < 121; ++i) {
    const double height_m = layer.p_w_m(i).z;
    EXPECT_NEAR(layer.value(*column, i), height_m, 1e-6);
  }
}

// The terrain's levels, and thus its surface, have changed since it was offered as the truth: the
// data of the comparison are those that are shown. The DEM's own levels deviate from the samples.
TEST_F(WindowCompareTest, TerrainIsComparedAsItIsShown) {
  Window& window = shown();
  open(SampleDataset::get().scene());
  open(SampleDataset::get().scene().parent_path() / "hills.asc");
  const auto before = window.view().find("hills.asc")->data;
  window.canvas().look({{300, 300, 400}, {80, 80, 50}});
  QTest::keyClick(&window, Qt::Key_1);
  settle();
  ASSERT_NE(window.view().find("hills.asc")->data, before);
  ComparePanel& panel = window.compare_panel();
  panel.choose("hills.asc", "ground of scene.yaml");
  panel.compare_chosen();
  settle();
  EXPECT_EQ(dismiss_fault(), "");
  EXPECT_EQ(panel.figures().value("points"),
            std::to_string(window.view().find("hills.asc")->points()));
  ASSERT_NE(panel.figures().value("largest"), "");
  EXPECT_LT(metres(panel.figures().value("largest")), 1e-3);  // vertices are samples of the DEM
  EXPECT_EQ(window.view().find("hills.asc")->coloured_by, "deviation");
}

QStringList texts(const ComparePanel& panel, const char* name) {
  QStringList all;
  const auto* box = panel.findChild<QComboBox*>(name);
  for (int i = 0; i < box->count(); ++i) all << box->itemText(i);
  return all;
}

TEST_F(WindowCompareTest, OffersScansAgainstTheGroundFirstAndNothingAgainstItself) {
  Window& window = shown();
  const ComparePanel& panel = window.compare_panel();
  open(SampleDataset::get().scene());
  // Neither a scene's terrain nor its post is a measurement.
  EXPECT_EQ(texts(panel, "measured"), QStringList());
  EXPECT_FALSE(panel.findChild<QPushButton*>("compare")->isEnabled());
  const TemporaryFolder folder;
  const TriangleMesh mesh{
      .vertices_m = {{0, 0, 0}, {4, 0, 0}, {2, 3, 1}}, .triangles = {{0, 1, 2}}, .levels = {}};
  write_ply(folder / "mesh.ply", mesh, {});
  open(folder / "mesh.ply");
  EXPECT_EQ(texts(panel, "measured"), QStringList("mesh.ply"));
  EXPECT_EQ(
      texts(panel, "truth"),
      (QStringList{"ground of scene.yaml", "surface of scene.yaml/terrain",
                   "surface of scene.yaml/objects/post", "surface of scene.yaml/objects/cart"}));
  open(SampleDataset::get().path());
  EXPECT_EQ(texts(panel, "measured"), (QStringList{"dataset/lidar/top", "mesh.ply"}));
  EXPECT_EQ(panel.findChild<QComboBox*>("measured")->currentText(), "dataset/lidar/top");
  EXPECT_EQ(panel.findChild<QComboBox*>("truth")->currentText(), "ground of scene.yaml");
  EXPECT_EQ(texts(panel, "truth")[1], "surface of mesh.ply");
  // The user's choice stays when more is opened.
  window.compare_panel().choose("mesh.ply", "surface of scene.yaml/terrain");
  EXPECT_FALSE(texts(panel, "truth").contains("surface of mesh.ply"));
  open(SampleDataset::get().scene().parent_path() / "hills.asc");
  EXPECT_EQ(panel.findChild<QComboBox*>("measured")->currentText(), "mesh.ply");
  EXPECT_EQ(panel.findChild<QComboBox*>("truth")->currentText(), "surface of scene.yaml/terrain");
  window.compare_panel().choose("hills.asc", "ground of scene.yaml");
  EXPECT_FALSE(texts(panel, "truth").contains("heights of hills.asc"));
  EXPECT_FALSE(texts(panel, "truth").contains("surface of hills.asc"));
}

}  // namespace
}  // namespace groundray::window_compare_test
