#include <QAction>
#include <QDialog>
#include <QLabel>
#include <QLineEdit>
#include <QMenu>
#include <QPushButton>
#include <QRegularExpression>
#include <QSpinBox>
#include <QTest>
#include <cmath>
#include <fstream>
#include <set>

#include "apps/view/rendering/offscreen_render.h"
#include "apps/view/window/panels/dialogs.h"
#include "apps/view/window/recent_files.h"
#include "apps/view/window/window.h"
#include "core/image/image_io.h"
#include "core/io/mesh_io.h"
#include "core/io/ply_io.h"
#include "test/support/terrain/geotiff.h"
#include "test/view/sample_dataset.h"
#include "test/view/window_fixture.h"

namespace groundray::window_files_test {
namespace {

using testing::SampleDataset;
using testing::TemporaryFolder;
using testing::wait_until;
using Paths = std::vector<std::filesystem::path>;

class WindowFilesTest : public testing::WindowTest {
 protected:
  // Writes a mesh with one triangle.
  static std::filesystem::path write_mesh(const std::filesystem::path& path) {
    const TriangleMesh mesh{
        .vertices_m = {{0, 0, 0}, {4, 0, 0}, {2, 3, 1}}, .triangles = {{0, 1, 2}}, .levels = {}};
    write_ply(path, mesh, {});
    return path;
  }

  // Writes a scene with so small a memory limit for the terrain that its DEM is certified first,
  // which takes seconds.
  static std::filesystem::path write_slow_scene(const TemporaryFolder& folder) {
    testing::GeoTiff dem{.size = {2500, 2500}};
    dem.values.resize(2500UL * 2500UL);
    for (std::size_t i = 0; i < dem.values.size(); ++i) {
      dem.values[i] = 100 + 9 * std::sin(static_cast<double>(i % 2500) * 0.05) +
                      5 * std::cos(static_cast<double>(i) * 3e-5);
    }
    dem.save(folder / "large.tif");
    std::ofstream(folder / "slow.yaml")
        << "groundray: 1\nseed: 1\nduration_s: 0.1\nterrain: {dem: large.tif, material: dry_soil, "
           "label: 1, memory_mib: 32}\nplatform: {trajectory: body.tum}\nlidars: [{name: top, "
           "preset: velodyne_vlp16, mount: {translation_m: [0, 0, 2]}}]\n";
    std::ofstream(folder / "body.tum")
        << "0 501000 5149000 120 0 0 0 1\n0.2 501001 5149000 120 0 0 0 1\n";
    return folder / "slow.yaml";
  }

  bool has(const std::string& layer) const { return window_->view().find(layer) != nullptr; }

  void remove_layer(const std::string& layer) {
    window_->layer_panel().select(layer);
    ASSERT_EQ(window_->layer_panel().selected(), layer);
    QTest::keyClick(window_.get(), Qt::Key_Delete);
    ASSERT_FALSE(has(layer));
  }

  void go_to(int ms) {
    window_->timeline_panel().go_to(std::chrono::milliseconds(ms));
    settle();
  }
};

TEST_F(WindowFilesTest, CancelStopsLoadingOfAllFiles) {
  const TemporaryFolder folder;
  const auto slow = write_slow_scene(folder);
  const auto mesh = write_mesh(folder / "mesh.ply");
  Window& window = shown();
  auto* cancel = window.findChild<QPushButton*>("cancel_opening");
  ASSERT_NE(cancel, nullptr);
  EXPECT_FALSE(cancel->isVisible());
  for (const bool by_key : {false, true}) {
    window.open(slow);
    window.open(mesh);
    QTest::qWait(50);
    ASSERT_TRUE(window.is_busy()) << dismiss_fault();
    EXPECT_TRUE(cancel->isVisible());
    if (by_key) {
      QTest::keyClick(&window, Qt::Key_Escape);
    } else {
      QTest::mouseClick(cancel, Qt::LeftButton);
    }
    EXPECT_FALSE(window.is_busy());
    EXPECT_FALSE(cancel->isVisible());
    QTest::qWait(300);
    EXPECT_EQ(dismiss_fault(), "");
    EXPECT_TRUE(window.view().layers().empty());
  }
  open(mesh);  // the window remains usable
  EXPECT_TRUE(has("mesh.ply"));
  EXPECT_FALSE(cancel->isVisible());
}

TEST_F(WindowFilesTest, ViewStatesWhatIsBeingOpened) {
  const TemporaryFolder folder;
  const auto slow = write_slow_scene(folder);
  const auto mesh = write_mesh(folder / "mesh.ply");
  Window& window = shown();
  auto* hint = window.canvas().findChild<QLabel*>();
  ASSERT_NE(hint, nullptr);
  EXPECT_TRUE(hint->isVisible());
  EXPECT_TRUE(hint->text().contains("Drop something here"));
  window.open(slow);
  EXPECT_FALSE(hint->text().contains("Drop"));
  EXPECT_TRUE(hint->text().contains("Opening slow.yaml"));
  EXPECT_TRUE(hint->isVisible());
  window.cancel_opening();
  EXPECT_TRUE(hint->text().contains("Drop something here"));
  open(mesh);
  EXPECT_FALSE(hint->isVisible());
  window.open(slow);  // the mesh stays visible
  EXPECT_FALSE(hint->isVisible());
  window.cancel_opening();
  window.close_all();
  EXPECT_TRUE(hint->isVisible());
}

TEST_F(WindowFilesTest, MayBeClosedWhileLoading) {
  const TemporaryFolder folder;
  const auto slow = write_slow_scene(folder);
  shown().open(slow);
  QTest::qWait(100);
  EXPECT_TRUE(window_->is_busy());
  QElapsedTimer clock;
  clock.start();
  window_.reset();
  const qint64 closed_ms = clock.restart();
  shown();
  clock.restart();
  open(slow);
  const qint64 opened_ms = clock.elapsed();
  EXPECT_EQ(dismiss_fault(), "");
  EXPECT_TRUE(has("slow.yaml/terrain"));
  // Closing waits for at most one block of the terrain, of which there are dozens.
  EXPECT_LT(closed_ms, 300 + opened_ms / 4);
}

TEST_F(WindowFilesTest, DeletedLayersReturnOnlyWhenOpenedAgain) {
  shown();
  open(SampleDataset::get().path());
  go_to(100);
  for (const char* layer : {"dataset/sensors/eye", "dataset/lidar/top", "dataset/trail"}) {
    remove_layer(layer);
  }
  go_to(300);
  for (const char* layer : {"dataset/sensors/eye", "dataset/lidar/top", "dataset/trail"}) {
    EXPECT_FALSE(has(layer)) << layer;
  }
  EXPECT_TRUE(has("dataset/sensors/top"));  // layers that were not deleted remain
  open(SampleDataset::get().scene());
  remove_layer("scene.yaml/objects/cart");
  go_to(400);
  EXPECT_FALSE(has("scene.yaml/objects/cart"));
  EXPECT_FALSE(has("dataset/lidar/top"));
  open(SampleDataset::get().path());
  go_to(200);
  for (const char* layer : {"dataset/sensors/eye", "dataset/lidar/top", "dataset/trail"}) {
    EXPECT_TRUE(has(layer)) << layer;
  }
  EXPECT_FALSE(has("scene.yaml/objects/cart"));
  open(SampleDataset::get().scene());
  EXPECT_TRUE(has("scene.yaml/objects/cart"));
}

// The scene's sensors are hidden while its dataset is played: they would remain at their initial
// poses.
TEST_F(WindowFilesTest, DatasetHidesTheSensorsOfItsScene) {
  Window& window = shown();
  open(SampleDataset::get().scene());
  const auto is_seen = [&](const char* layer) { return window.view().find(layer)->visible; };
  EXPECT_TRUE(is_seen("scene.yaml/sensors/top"));
  open(SampleDataset::get().path());
  EXPECT_FALSE(is_seen("scene.yaml/sensors/top"));
  EXPECT_TRUE(is_seen("dataset/sensors/top"));
  const auto of_dataset = [&] {
    std::string name;
    for (const Layer* layer : window.view().layers()) {
      if (layer->name.starts_with("dataset/")) name = layer->name;
    }
    return name;
  };
  for (std::string each = of_dataset(); !each.empty(); each = of_dataset()) remove_layer(each);
  EXPECT_TRUE(is_seen("scene.yaml/sensors/top"));
}

TEST_F(WindowFilesTest, RemembersRecentFiles) {
  const TemporaryFolder folder;
  const auto settings = folder / "kept" / "view.ini";
  const auto mesh = write_mesh(folder / "a, b & 100%.ply");
  {
    shown({.settings = settings});
    open(mesh);
    open(folder / "nowhere.ply");
    EXPECT_NE(dismiss_fault(), "");
  }
  Window& window = shown({.settings = settings});
  auto* recent = window.findChild<QMenu*>("recent");
  ASSERT_NE(recent, nullptr);
  Q_EMIT recent->aboutToShow();
  ASSERT_GE(recent->actions().size(), 1);
  EXPECT_TRUE(recent->actions().front()->text().contains("a, b && 100%.ply"));
  recent->actions().front()->trigger();
  settle();
  EXPECT_TRUE(has(mesh.filename().string()));
  EXPECT_EQ(RecentFiles(settings).paths(), Paths{mesh});  // failed files are not listed
  recent->actions().back()->trigger();
  EXPECT_TRUE(RecentFiles(settings).paths().empty());
}

TEST(RecentFilesTest, KeepTheLastTenWithoutDuplicates) {
  const TemporaryFolder folder;
  const auto file = folder / "view.ini";
  RecentFiles recent(file);
  for (int i = 0; i < 14; ++i) recent.add(folder / fmt::format("{}.ply", i));
  recent.add(folder / "9.ply");
  recent.add(folder / "dataset/");
  recent.add(folder / "sub" / ".." / "dataset");  // the same path
  Paths expected{folder / "dataset", folder / "9.ply"};
  for (const int i : {13, 12, 11, 10, 8, 7, 6, 5}) {
    expected.push_back(folder / fmt::format("{}.ply", i));
  }
  EXPECT_EQ(recent.paths(), expected);
  EXPECT_EQ(RecentFiles(file).paths(), expected);
  std::ofstream(file, std::ios::binary) << "\x01 neither this nor that";
  EXPECT_TRUE(RecentFiles(file).paths().empty());
  RecentFiles nowhere{std::filesystem::path()};
  nowhere.add(folder / "1.ply");
  EXPECT_EQ(nowhere.paths().size(), 1U);
}

TEST_F(WindowFilesTest, WritesATurntable) {
  Window& window = shown();
  const TemporaryFolder folder;
  open(write_mesh(folder / "mesh.ply"));
  QTest::keyClick(&window, Qt::Key_T, Qt::ControlModifier);
  auto* dialog = window.findChild<TurntableDialog*>("turntable");
  ASSERT_NE(dialog, nullptr);
  const auto turn = folder / "new" / "turn";
  constexpr glm::ivec2 size_px(160, 120);
  constexpr int pictures = 5;
  dialog->findChild<QSpinBox*>("turntable_pictures")->setValue(pictures);
  dialog->findChild<QSpinBox*>("turntable_width")->setValue(size_px.x);
  dialog->findChild<QSpinBox*>("turntable_height")->setValue(size_px.y);
  dialog->findChild<QLineEdit*>("turntable_folder")->setText(QString::fromStdString(turn.string()));
  const Look before = window.view().current_look();
  QTest::mouseClick(dialog->findChild<QPushButton*>("turntable_write"), Qt::LeftButton);
  EXPECT_TRUE(dialog->is_writing());
  EXPECT_TRUE(wait_until([&] { return !dialog->is_writing(); }));
  EXPECT_EQ(dismiss_fault(), "");
  EXPECT_EQ(window.view().current_look().from_w_m, before.from_w_m);
  // The oracle is the output of groundray-view --turntable.
  window.canvas().doneCurrent();
  write_turntable(window.view(), folder / "still", pictures, size_px);
  std::size_t unlike = 0, colours = 0;
  for (int i = 0; i < pictures; ++i) {
    const std::string name = fmt::format("{:04}.png", i);
    const Image8 ours = read_image8(turn / name), theirs = read_image8(folder / "still" / name);
    ASSERT_EQ(glm::ivec2(ours.width(), ours.height()), size_px);
    const auto a = ours.values(), b = theirs.values();
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) unlike += a[k] != b[k] ? 1U : 0U;
    colours += std::set(a.begin(), a.end()).size();
  }
  EXPECT_GT(colours, 30UL * pictures);
  // Eye positions differ in the last bit, and so do pixels on edges.
  EXPECT_LT(unlike, 3UL * pictures * 20);
  EXPECT_FALSE(std::filesystem::exists(turn / "0005.png"));
}

TEST_F(WindowFilesTest, TurntableCanBeStoppedAndReportsErrors) {
  Window& window = shown();
  const TemporaryFolder folder;
  open(write_mesh(folder / "mesh.ply"));
  QTest::keyClick(&window, Qt::Key_T, Qt::ControlModifier);
  auto* dialog = window.findChild<TurntableDialog*>("turntable");
  ASSERT_NE(dialog, nullptr);
  auto* to = dialog->findChild<QLineEdit*>("turntable_folder");
  auto* write = dialog->findChild<QPushButton*>("turntable_write");
  std::ofstream(folder / "file").flush();
  to->setText(QString::fromStdString((folder / "file" / "turn").string()));
  QTest::mouseClick(write, Qt::LeftButton);
  EXPECT_FALSE(dialog->is_writing());
  EXPECT_NE(dismiss_fault().find("the folder cannot be created"), std::string::npos);
  to->setText(QString::fromStdString((folder / "turn").string()));
  dialog->findChild<QSpinBox*>("turntable_pictures")->setValue(9999);
  QTest::mouseClick(write, Qt::LeftButton);
  QTest::qWait(30);
  EXPECT_TRUE(dialog->is_writing());
  dialog->reject();
  EXPECT_FALSE(dialog->is_writing());
  EXPECT_TRUE(dialog->isVisible());
  dialog->reject();
  EXPECT_FALSE(dialog->isVisible());
}

TEST_F(WindowFilesTest, HelpListsAllKeys) {
  const Window& window = shown();
  const QString help = help_text();
  const QString table = help.mid(help.indexOf("<h3>Keys</h3>"));
  std::set<std::string> reported;
  QRegularExpressionMatchIterator cells =
      QRegularExpression("<td>([^<]*)</td><td>[^<]*</td>").globalMatch(table);
  while (cells.hasNext()) {
    for (QString key : cells.next().captured(1).split(' ', Qt::SkipEmptyParts)) {
      if (key.size() > 1 && key.endsWith(',')) key.chop(1);
      reported.insert(key.toStdString());
    }
  }
  std::size_t keys = 0;
  for (const QAction* action : window.findChildren<QAction*>()) {
    for (const QKeySequence& sequence : action->shortcuts()) {
      std::string key = sequence.toString(QKeySequence::PortableText).toStdString();
      if (key == "Del") key = "Delete";
      if (key == "Esc") key = "Escape";
      ++keys;
      EXPECT_TRUE(reported.contains(key)) << key << ": " << action->text().toStdString();
    }
  }
  EXPECT_GT(keys, 20U);
}

}  // namespace
}  // namespace groundray::window_files_test
