#include "apps/view/window/window.h"

#include <QComboBox>
#include <QDialog>
#include <QDoubleSpinBox>
#include <QDropEvent>
#include <QLabel>
#include <QMimeData>
#include <QSlider>
#include <QTreeWidget>
#include <QUrl>
#include <algorithm>
#include <fstream>
#include <glm/geometric.hpp>

#include "core/image/image_io.h"
#include "core/image/png_io.h"
#include "core/io/mesh_io.h"
#include "core/io/ply_io.h"
#include "test/view/sample_dataset.h"
#include "test/view/window_fixture.h"

namespace groundray::window_test {
namespace {

using testing::SampleDataset;
using testing::TemporaryFolder;
using testing::wait_until;
using testing::WindowTest;

std::vector<std::string> names_of(const Window& window) {
  std::vector<std::string> names;
  for (const Layer* layer : const_cast<Window&>(window).view().layers()) {
    names.push_back(layer->name);
  }
  return names;
}

bool has(const Window& window, const std::string& layer) {
  const std::vector<std::string> names = names_of(window);
  return std::ranges::find(names, layer) != names.end();
}

TriangleMesh pyramid() {
  return {.vertices_m = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {2, 2, 3}},
          .triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}},
          .levels = {}};
}

void write_cloud(const std::filesystem::path& path) {
  constexpr std::size_t rows = 400;
  PointCloud cloud(rows);
  const auto x = cloud.add<float>("x"), y = cloud.add<float>("y"), z = cloud.add<float>("z");
  const auto intensity = cloud.add<float>("intensity");
  for (std::size_t i = 0; i < rows; ++i) {
    x[i] = static_cast<float>(i % 20);
    const std::size_t line = i / 20;
    y[i] = static_cast<float>(line);
    z[i] = std::sin(x[i] * 0.5f);
    intensity[i] = static_cast<float>(i);
  }
  write_ply(path, cloud, {});
}

// Fewest screen pixels of a visible layer: 400 points of a few pixels each cover more.
constexpr std::size_t few_pixels = 400;

TEST_F(WindowTest, OpensEachKindOfFile) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_ply(folder / "pyramid.ply", pyramid(), {});
  write_cloud(folder / "cloud.ply");
  testing::write_hills(folder / "hills.asc");
  Image8 picture(32, 24, 3);
  for (std::size_t i = 0; i < picture.values().size(); ++i) {
    picture.values()[i] = static_cast<std::uint8_t>(i * 7 % 256);
  }
  write_png(folder / "picture.png", picture);
  for (const char* name : {"pyramid.ply", "cloud.ply", "hills.asc", "picture.png"}) {
    open(folder / name);
    EXPECT_EQ(dismiss_fault(), "");
    EXPECT_TRUE(has(window, name)) << name;
    EXPECT_GT(pixels_of(name), few_pixels) << name;
    EXPECT_TRUE(window.windowTitle().startsWith(name));
    window.close_all();
    EXPECT_TRUE(names_of(window).empty());
  }
}

TEST_F(WindowTest, OpensADatasetAndItsScene) {
  Window& window = shown();
  open(SampleDataset::get().path());
  EXPECT_EQ(dismiss_fault(), "");
  for (const char* name : {"dataset/lidar/top", "dataset/sensors/top", "dataset/sensors/eye"}) {
    EXPECT_TRUE(has(window, name)) << name;
  }
  EXPECT_NE(window.timeline_panel().timeline(), nullptr);
  window.timeline_panel().go_to(window.timeline_panel().timeline()->end());
  settle();
  EXPECT_NE(window.image_panel().image(), nullptr);
  EXPECT_GT(pixels_of("dataset/lidar/top"), few_pixels);
  open(SampleDataset::get().scene());
  EXPECT_EQ(dismiss_fault(), "");
  EXPECT_TRUE(has(window, "scene.yaml/terrain"));
  ASSERT_TRUE(window.tracker().built());
  EXPECT_GT(window.tracker().built()->triangles, 0U);
  EXPECT_EQ(window.status().value("terrain's triangles"),
            fmt::format("{}", window.tracker().built()->triangles));
  EXPECT_NE(window.status().value("rebuilt in"), "");
}

TEST_F(WindowTest, ReportsInvalidInputsAndRemainsUsable) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_ply(folder / "whole.ply", pyramid(), {});
  std::ifstream whole(folder / "whole.ply", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(whole)), {});
  std::ofstream(folder / "cut.ply", std::ios::binary) << bytes.substr(0, bytes.size() - 20);
  std::ofstream(folder / "noise.tif", std::ios::binary) << "II* this is no raster at all";
  std::ofstream(folder / "empty.obj").flush();
  std::ofstream(folder / "scene.yaml") << "groundray: 1\nterrain: {dem: nowhere.tif}\n";
  std::ofstream(folder / "words.txt") << "neither this nor that\n";
  std::filesystem::create_directory(folder / "no_dataset");
  for (const char* name : {"cut.ply", "noise.tif", "empty.obj", "scene.yaml", "words.txt",
                           "no_dataset", "missing.ply"}) {
    open(folder / name);
    const std::string message = dismiss_fault();
    EXPECT_NE(message.find(name), std::string::npos) << name << ": " << message;
    EXPECT_TRUE(names_of(window).empty()) << name;
  }
  open(folder / "whole.ply");  // the window remains usable
  EXPECT_EQ(dismiss_fault(), "");
  EXPECT_TRUE(has(window, "whole.ply"));
}

TEST_F(WindowTest, RejectsOversizedFiles) {
  WindowStart start;
  start.limits.file_bytes = 100;
  shown(start);
  const TemporaryFolder folder;
  write_cloud(folder / "huge.ply");
  open(folder / "huge.ply");
  const std::string message = dismiss_fault();
  EXPECT_NE(message.find("huge.ply"), std::string::npos) << message;
  EXPECT_TRUE(names_of(*window_).empty());
}

TEST_F(WindowTest, OpensDroppedFiles) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_ply(folder / "pyramid.ply", pyramid(), {});
  write_cloud(folder / "cloud.ply");
  QMimeData dropped;
  dropped.setUrls({QUrl::fromLocalFile(QString::fromStdString((folder / "pyramid.ply").string())),
                   QUrl::fromLocalFile(QString::fromStdString((folder / "cloud.ply").string()))});
  QDragEnterEvent enters({50, 50}, Qt::CopyAction, &dropped, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(&window, &enters);
  EXPECT_TRUE(enters.isAccepted());
  QDropEvent drop({50, 50}, Qt::CopyAction, &dropped, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(&window, &drop);
  settle();
  EXPECT_TRUE(has(window, "pyramid.ply"));
  EXPECT_TRUE(has(window, "cloud.ply"));
}

TEST_F(WindowTest, ReloadsAFileThatIsOpenedAgain) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_ply(folder / "mesh.ply", pyramid(), {});
  open(folder / "mesh.ply");
  TriangleMesh one_less = pyramid();
  one_less.triangles.pop_back();
  write_ply(folder / "mesh.ply", one_less, {});
  open(folder / "mesh.ply");
  EXPECT_EQ(names_of(window), std::vector<std::string>{"mesh.ply"});
  EXPECT_EQ(window.view().find("mesh.ply")->triangles(), 3U);
  // Another file of the same name is another document.
  std::filesystem::create_directory(folder / "other");
  write_ply(folder / "other" / "mesh.ply", pyramid(), {});
  open(folder / "other" / "mesh.ply");
  EXPECT_EQ(names_of(window), (std::vector<std::string>{"mesh.ply", "mesh.ply (2)"}));
}

TEST_F(WindowTest, KeysMatchTheHelp) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_ply(folder / "pyramid.ply", pyramid(), {});
  open(folder / "pyramid.ply");
  const auto press = [&](Qt::Key key) {
    QTest::keyClick(&window, key);
    QTest::qWait(10);
  };
  press(Qt::Key_T);
  EXPECT_TRUE(window.view().find("pyramid.ply")->wireframe);
  press(Qt::Key_T);
  EXPECT_FALSE(window.view().find("pyramid.ply")->wireframe);
  press(Qt::Key_1);
  const Look above = window.view().current_look();
  EXPECT_NEAR(above.from_w_m.x, above.at_w_m.x, 1e-6);
  EXPECT_NEAR(above.from_w_m.y, above.at_w_m.y, 1e-6);
  EXPECT_GT(above.from_w_m.z, above.at_w_m.z);
  press(Qt::Key_2);
  EXPECT_LT(window.view().current_look().from_w_m.y, above.at_w_m.y - 1);  // south of the target
  press(Qt::Key_F1);
  auto* help = window.findChild<QDialog*>("help");
  ASSERT_NE(help, nullptr);
  EXPECT_TRUE(help->isVisible());
  help->close();
  QTest::qWait(50);
  QApplication::setActiveWindow(&window);
  press(Qt::Key_Delete);
  EXPECT_TRUE(names_of(window).empty());
}

TEST_F(WindowTest, MouseTurnsMovesAndZooms) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_ply(folder / "pyramid.ply", pyramid(), {});
  open(folder / "pyramid.ply");
  Canvas& canvas = window.canvas();
  const auto drag = [&](Qt::MouseButton button, Qt::KeyboardModifiers keys, QPoint by) {
    const QPoint from(canvas.width() / 2, canvas.height() / 2);
    QTest::mousePress(&canvas, button, keys, from);
    // QTest::mouseMove reports no buttons.
    for (int i = 1; i <= 4; ++i) {
      QMouseEvent move(QEvent::MouseMove, from + i * by / 4, Qt::NoButton, button, keys);
      QApplication::sendEvent(&canvas, &move);
    }
    QTest::mouseRelease(&canvas, button, keys, from + by);
  };
  const auto distance_m = [&] {
    return glm::distance(window.view().current_look().from_w_m,
                         window.view().current_look().at_w_m);
  };
  const Look first = window.view().current_look();
  drag(Qt::LeftButton, Qt::NoModifier, {80, 0});
  const Look turned = window.view().current_look();
  EXPECT_LT(glm::distance(turned.at_w_m, first.at_w_m), 1e-6);
  EXPECT_NEAR(distance_m(), glm::distance(first.from_w_m, first.at_w_m), 1e-6);
  EXPECT_GT(glm::distance(turned.from_w_m, first.from_w_m), 0.5);
  EXPECT_NEAR(turned.from_w_m.z, first.from_w_m.z, 1e-6);  // up remains up

  // The dragged point stays under the mouse: its line of sight still intersects the target's plane
  // there.
  const int middle_x = canvas.width() / 2, middle_y = canvas.height() / 2;
  drag(Qt::MiddleButton, Qt::NoModifier, {60, 40});
  const auto [eye, direction] = window.view().line_of_sight(middle_x + 60, middle_y + 40);
  const glm::dvec3 to_target = turned.at_w_m - eye;
  const double aside_m = glm::length(glm::cross(to_target, direction));
  const double pixel_m = 2 * distance_m() * std::tan(0.26) / canvas.height();
  EXPECT_LT(aside_m, 2 * pixel_m);

  const double before_m = distance_m();
  drag(Qt::RightButton, Qt::NoModifier, {0, -60});
  EXPECT_LT(distance_m(), 0.8 * before_m);

  // Zooming with the wheel keeps the point under the mouse.
  const auto sight = window.view().line_of_sight(200, 150);
  QWheelEvent wheel({200, 150}, canvas.mapToGlobal(QPoint(200, 150)), {}, {0, 240}, Qt::NoButton,
                    Qt::NoModifier, Qt::NoScrollPhase, false);
  QApplication::sendEvent(&canvas, &wheel);
  const auto nearer = window.view().line_of_sight(200, 150);
  EXPECT_GT(glm::dot(sight.second, nearer.second), 1 - 1e-6);
  EXPECT_TRUE(wait_until([&] { return canvas.frames_per_s() > 0; }, 5000));
}

TEST_F(WindowTest, LayerPanelSetsTheStyleOfALayer) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_cloud(folder / "cloud.ply");
  open(folder / "cloud.ply");
  LayerPanel& panel = window.layer_panel();
  panel.select("cloud.ply");
  auto* tree = panel.findChild<QTreeWidget*>("layers");
  tree->topLevelItem(0)->setCheckState(0, Qt::Unchecked);
  EXPECT_FALSE(window.view().find("cloud.ply")->visible);
  tree->topLevelItem(0)->setCheckState(0, Qt::Checked);
  EXPECT_TRUE(window.view().find("cloud.ply")->visible);
  auto* column = panel.findChild<QComboBox*>("colour_by");
  column->setCurrentIndex(column->findData("intensity"));
  EXPECT_EQ(window.view().find("cloud.ply")->coloured_by, "intensity");
  panel.findChild<QSlider*>("opacity")->setValue(40);
  EXPECT_NEAR(window.view().find("cloud.ply")->opacity, 0.4, 1e-9);
}

TEST_F(WindowTest, RangesKeepTheDigitsOfTheirLimits) {
  Window& window = shown();
  const TemporaryFolder folder;
  PointCloud cloud(10);
  const auto x = cloud.add<float>("x"), y = cloud.add<float>("y"), z = cloud.add<float>("z");
  const auto amplitude = cloud.add<float>("amplitude");
  for (std::size_t i = 0; i < cloud.rows(); ++i) {
    x[i] = y[i] = z[i] = static_cast<float>(i);
    amplitude[i] = 1e-9f * static_cast<float>(i + 1);
  }
  write_ply(folder / "faint.ply", cloud, {});
  open(folder / "faint.ply");
  LayerPanel& panel = window.layer_panel();
  window.view().colour_by("faint.ply", "amplitude");
  panel.select("faint.ply");
  const auto range = [&] { return window.view().find("faint.ply")->find("amplitude")->range; };
  const glm::dvec2 before = range();
  auto* low = panel.findChild<QDoubleSpinBox*>("range_low");
  auto* high = panel.findChild<QDoubleSpinBox*>("range_high");
  EXPECT_NEAR(low->value(), before.x, 1e-12 * before.x);
  EXPECT_NEAR(high->text().toDouble(), before.y, 1e-8 * before.y);
  high->setValue(5e-9);
  EXPECT_EQ(range(), glm::dvec2(before.x, 5e-9));  // the other end is unchanged to the last bit
}

TEST_F(WindowTest, AppliesTheCommandLine) {
  const TemporaryFolder folder;
  write_ply(folder / "pyramid.ply", pyramid(), {});
  write_cloud(folder / "cloud.ply");
  Window& window = shown({.inputs = {folder / "cloud.ply", folder / "pyramid.ply"},
                          .view = {.at_w_m = glm::dvec3(3, 2, 1),
                                   .colour_by = {"cloud.ply=intensity"},
                                   .hide = {"pyramid.ply", "nobody"},
                                   .point_size_px = 7}});
  settle();
  const std::string message = dismiss_fault();
  EXPECT_NE(message.find("--hide nobody"), std::string::npos) << message;
  EXPECT_EQ(message.find("pyramid"), std::string::npos) << message;
  const Layer& cloud = *window.view().find("cloud.ply");
  EXPECT_EQ(cloud.coloured_by, "intensity");
  EXPECT_EQ(cloud.point_size_px, 7);
  EXPECT_TRUE(cloud.visible);
  EXPECT_FALSE(window.view().find("pyramid.ply")->visible);
  EXPECT_LT(glm::distance(window.view().current_look().at_w_m, glm::dvec3(3, 2, 1)), 1e-9);
}

TEST_F(WindowTest, SavesPicturesOfAnySize) {
  Window& window = shown();
  const TemporaryFolder folder;
  write_ply(folder / "pyramid.ply", pyramid(), {});
  open(folder / "pyramid.ply");
  for (const glm::ivec2 size_px : {glm::ivec2(320, 200), glm::ivec2(3000, 1000)}) {
    window.save_picture(folder / "shot.png", size_px);
    const Image8 picture = read_image8(folder / "shot.png");
    EXPECT_EQ(glm::ivec2(picture.width(), picture.height()), size_px);
  }
  QTest::qWait(100);
  EXPECT_GT(pixels_of("pyramid.ply"), few_pixels);  // the window still shows the layer
}

}  // namespace
}  // namespace groundray::window_test
