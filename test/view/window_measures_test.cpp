#include <QAction>
#include <QCheckBox>
#include <QComboBox>
#include <QDialogButtonBox>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QPushButton>
#include <QSlider>
#include <QTest>
#include <QToolButton>
#include <glm/geometric.hpp>
#include <utility>

#include "apps/view/window/panels/picture_area.h"
#include "apps/view/window/window.h"
#include "core/image/png_io.h"
#include "core/io/mesh_io.h"
#include "core/io/ply_io.h"
#include "test/view/sample_dataset.h"
#include "test/view/window_fixture.h"

namespace groundray::window_measures_test {
namespace {

using testing::SampleDataset;
using testing::TemporaryFolder;
using testing::wait_until;

constexpr glm::dvec3 origin_w_m{500'000, 4'000'000, 700};

class WindowMeasuresTest : public testing::WindowTest {
 protected:
  // Opens a mesh with a corner at its origin and others 5 m, 12 m and 13 m away.
  void open_mesh(const glm::dvec3& at_w_m = origin_w_m) {
    const TriangleMesh mesh{.vertices_m = {{0, 0, 0}, {3, 4, 0}, {3, 4, 12}, {-6, 2, 0}},
                            .triangles = {{0, 1, 2}, {0, 2, 3}},
                            .levels = {}};
    write_ply(folder_ / "mesh.ply", mesh, {.origin_w_m = at_w_m});
    open(folder_ / "mesh.ply");
  }

  // Clicks where a vertex of the mesh is picked.
  void click_vertex(vtkIdType row) {
    Canvas& canvas = window_->canvas();
    for (int y = 0; y < canvas.height(); ++y) {
      for (int x = 0; x < canvas.width(); ++x) {
        const auto picked = window_->view().pick_vertex(x, y);
        if (!picked || picked->of != LayerColumn::Of::Points || picked->row != row) continue;
        QTest::mouseClick(&canvas, Qt::LeftButton, Qt::NoModifier, {x, y});
        return settle();
      }
    }
    FAIL() << "vertex " << row << " is not in the view";
  }

  std::string status_text() const {
    std::string all;
    for (const auto* label : window_->findChildren<QLabel*>())
      all += label->isVisible() ? label->text().toStdString() + '\n' : "";
    return all;
  }

  TemporaryFolder folder_;
};

// 3 m east, 4 m north and 12 m up are 5 m horizontally and 13 m in all.
TEST_F(WindowMeasuresTest, DistancesOfVerticesAreExact) {
  Window& window = shown();
  open_mesh();
  QTest::keyClick(&window, Qt::Key_M);
  EXPECT_NE(status_text().find("click the first point"), std::string::npos);
  click_vertex(0);
  EXPECT_EQ(window.picked().value("from"), "500000.0000, 4000000.0000, 700.0000 m");
  EXPECT_NE(status_text().find("click the second point"), std::string::npos);
  click_vertex(2);
  EXPECT_EQ(window.picked().value("to"), "500003.0000, 4000004.0000, 712.0000 m");
  EXPECT_EQ(window.picked().value("distance"), "13.0000 m");
  EXPECT_EQ(window.picked().value("horizontal"), "5.0000 m");
  EXPECT_EQ(window.picked().value("vertical"), "12.0000 m");
  EXPECT_EQ(window.picked().value("difference east"), "3.0000 m");
  EXPECT_EQ(window.picked().value("difference north"), "4.0000 m");
  EXPECT_NE(status_text().find("distance 13.0000 m, horizontal 5.0000 m, vertical +12.0000 m"),
            std::string::npos);
  EXPECT_GT(pixels_of("measured"), 100U);
  // A third click begins anew; Escape ends measuring, and clicks pick again.
  click_vertex(1);
  EXPECT_EQ(window.picked().value("from"), "500003.0000, 4000004.0000, 700.0000 m");
  EXPECT_EQ(window.picked().value("distance"), "");
  QTest::keyClick(&window, Qt::Key_Escape);
  EXPECT_EQ(window.view().find("measured"), nullptr);
  EXPECT_EQ(window.picked().value("from"), "");
  click_vertex(3);
  EXPECT_EQ(window.view().find("measured"), nullptr);
  EXPECT_NE(window.picked().value("east"), "");
}

TEST_F(WindowMeasuresTest, ClippingBoxCanBeSetExemptedAndReset) {
  Window& window = shown();
  open_mesh();
  QTest::keyClick(&window, Qt::Key_B);
  ClipPanel& panel = window.clip_panel();
  auto* on = panel.findChild<QCheckBox*>("clip");
  QTest::mouseClick(on, Qt::LeftButton, Qt::NoModifier, {8, on->height() / 2});
  ASSERT_TRUE(panel.is_on());
  ASSERT_TRUE(window.view().clip());
  const ClipBox all = *window.view().clip();  // everything, rounded outwards to millimetres
  EXPECT_LT(glm::distance(all.low_w_m, origin_w_m + glm::dvec3(-6, 0, 0)), 0.004);
  EXPECT_LT(glm::distance(all.high_w_m, origin_w_m + glm::dvec3(3, 4, 12)), 0.004);
  EXPECT_NE(window.view().find("clip box"), nullptr);
  // A busy X server shows changes late.
  std::size_t whole = 0;
  EXPECT_TRUE(wait_until([&] {
    const std::size_t before = std::exchange(whole, pixels_of("mesh.ply"));
    return whole > 0 && whole == before;
  }));
  panel.findChild<QDoubleSpinBox*>("clip_high_up")->setValue(origin_w_m.z + 3);
  EXPECT_EQ(window.view().clip()->high_w_m.z, origin_w_m.z + 3);
  EXPECT_TRUE(wait_until([&] {
    const std::size_t part = pixels_of("mesh.ply");
    return part > 0 && part < whole * 9 / 10;
  }));
  // Swapped limits leave the box as it is.
  panel.findChild<QDoubleSpinBox*>("clip_high_up")->setValue(origin_w_m.z - 30);
  EXPECT_EQ(window.view().clip()->high_w_m.z, origin_w_m.z + 3);
  EXPECT_EQ(dismiss_fault(), "");
  window.layer_panel().select("mesh.ply");
  window.layer_panel().findChild<QCheckBox*>("clipped")->setChecked(false);
  EXPECT_FALSE(window.view().find("mesh.ply")->is_clipped);
  EXPECT_TRUE(wait_until([&] { return pixels_of("mesh.ply") > whole * 9 / 10; }));
  QTest::mouseClick(panel.findChild<QPushButton*>("clip_reset"), Qt::LeftButton);
  EXPECT_EQ(window.view().clip()->high_w_m, all.high_w_m);
  on->setChecked(false);
  EXPECT_FALSE(window.view().clip());
  EXPECT_EQ(window.view().find("clip box"), nullptr);
}

TEST_F(WindowMeasuresTest, EyeDomeLightingIsSwitchedByKeyAndOption) {
  {
    Window& window = shown();
    open_mesh();
    const QImage plain = view_on_screen();
    QTest::keyClick(&window, Qt::Key_Y);
    EXPECT_TRUE(window.view().has_eye_dome());
    EXPECT_TRUE(wait_until([&] { return view_on_screen() != plain; }));
    QTest::keyClick(&window, Qt::Key_Y);
    EXPECT_FALSE(window.view().has_eye_dome());
    EXPECT_TRUE(wait_until([&] { return view_on_screen() == plain; }));
  }
  WindowStart start;
  start.view.has_eye_dome = true;
  EXPECT_TRUE(shown(start).view().has_eye_dome());
}

TEST_F(WindowMeasuresTest, MeshInLocalCoordinatesGetsTheOriginOfADataset) {
  Window& window = shown();
  open(SampleDataset::get().path());
  open_mesh(glm::dvec3(0));
  const auto ask = [&] {
    QTest::keyClick(&window, Qt::Key_G, Qt::ControlModifier);
    return window.findChild<QDialog*>("origin");
  };
  window.layer_panel().select("dataset/lidar/top");
  EXPECT_EQ(ask(), nullptr);
  EXPECT_NE(dismiss_fault().find("Select a mesh or a cloud first"), std::string::npos);
  window.layer_panel().select("mesh.ply");
  QDialog* dialog = ask();
  ASSERT_NE(dialog, nullptr);
  auto* known = dialog->findChild<QComboBox*>("known_origins");
  ASSERT_EQ(known->count(), 2);
  EXPECT_EQ(known->itemText(1), "dataset");
  dialog->findChild<QDoubleSpinBox*>("east")->setValue(origin_w_m.x);
  dialog->findChild<QDoubleSpinBox*>("north")->setValue(origin_w_m.y);
  dialog->findChild<QDoubleSpinBox*>("up")->setValue(origin_w_m.z);
  dialog->findChild<QDialogButtonBox*>()->button(QDialogButtonBox::Ok)->click();
  settle();
  const Layer& layer = *window.view().find("mesh.ply");
  EXPECT_EQ(layer.p_w_m(2), origin_w_m + glm::dvec3(3, 4, 12));
  EXPECT_EQ(layer.value(*layer.find("height"), 2), origin_w_m.z + 12);
  EXPECT_TRUE(wait_until([&] { return pixels_of("mesh.ply") > 100; }));
}

TEST_F(WindowMeasuresTest, OptionsSetOriginAndClippingBox) {
  WindowStart start;
  start.view.origins = {{"1,2,3", "", {1, 2, 3}}, {"other.ply=9,9,9", "other.ply", {9, 9, 9}}};
  start.view.clip = ClipBox{{-9, -9, -9}, {9, 9, 9}};
  Window& window = shown(start);
  open_mesh(glm::dvec3(0));
  EXPECT_EQ(window.view().find("mesh.ply")->p_w_m(1), glm::dvec3(4, 6, 3));
  EXPECT_TRUE(window.clip_panel().is_on());
  EXPECT_EQ(window.view().clip()->high_w_m, glm::dvec3(9));
  EXPECT_NE(dismiss_fault().find("--origin other.ply=9,9,9: no"), std::string::npos);
}

TEST_F(WindowMeasuresTest, EchoesAreShownOverImages) {
  Window& window = shown();
  open(SampleDataset::get().path());
  window.timeline_panel().go_to(std::chrono::milliseconds(300));
  settle();
  ImagePanel& panel = window.image_panel();
  auto* box = panel.findChild<QCheckBox*>("echoes");
  ASSERT_TRUE(box->isVisible());
  EXPECT_TRUE(panel.area().dots().empty());
  const QImage without = panel.area().grab().toImage();
  box->setChecked(true);
  settle();
  ASSERT_GT(panel.area().dots().size(), 100U);
  for (const PictureDot& dot : panel.area().dots()) {
    EXPECT_GE(dot.pixel.x, -0.5);
    EXPECT_LT(dot.pixel.x, 63.5);
    EXPECT_LT(dot.pixel.y, 47.5);
  }
  const QPoint at = panel.area().place_of(panel.area().dots().back().pixel).toPoint();
  EXPECT_EQ(panel.area().grab().toImage().pixelColor(at).rgb(),
            panel.area().dots().back().colour.rgb());
  // Another time has other dots.
  const auto before = panel.area().dots().front().pixel;
  window.timeline_panel().go_to(std::chrono::milliseconds(480));
  settle();
  ASSERT_FALSE(panel.area().dots().empty());
  EXPECT_NE(panel.area().dots().front().pixel, before);
  box->setChecked(false);
  settle();
  EXPECT_TRUE(panel.area().dots().empty());
}

// A grey of 55 in 255 is 0.038 of white in linear light: the exposure that makes it white is 4.7
// EV.
TEST_F(WindowMeasuresTest, ExposureBrightensPicturesInThePanelAndInTheView) {
  Window& window = shown();
  Image8 grey(32, 24, 3);
  for (auto& byte : grey.values()) byte = 55;
  write_png(folder_ / "grey.png", grey);
  open(folder_ / "grey.png");
  ImagePanel& panel = window.image_panel();
  const auto centre = [&] {
    settle();
    return panel.area().grab().toImage().pixelColor(panel.area().place_of({16, 12}).toPoint());
  };
  auto* slider = panel.findChild<QSlider*>("exposure");
  ASSERT_TRUE(slider->isVisible());
  EXPECT_EQ(centre().red(), 55);
  slider->setValue(10);  // 1 EV: twice 0.0382 is 0.0764, which sRGB encodes as 78
  EXPECT_NEAR(centre().red(), 78, 1);
  const QImage in_view = view_on_screen();  // looks straight at the picture
  EXPECT_NEAR(in_view.pixelColor(in_view.rect().center()).red(), 78, 1);
  panel.findChild<QToolButton*>("automatic_exposure")->click();
  EXPECT_NEAR(slider->value(), 47, 1);
  EXPECT_GT(centre().red(), 245);
}

}  // namespace
}  // namespace groundray::window_measures_test
