#include <QCheckBox>
#include <QComboBox>
#include <QLabel>
#include <QPushButton>
#include <QSlider>
#include <cmath>
#include <glm/geometric.hpp>

#include "apps/view/window/panels/picture_area.h"
#include "apps/view/window/window.h"
#include "core/io/ply_io.h"
#include "test/view/sample_dataset.h"
#include "test/view/window_fixture.h"

namespace groundray::window_tools_test {
namespace {

using testing::SampleDataset;
using testing::TemporaryFolder;
using testing::wait_until;

// Height of the sample scene's ground, as write_hills() defines it. Between samples, which are 1 m
// apart, triangles deviate from the wave by up to its second derivative over 8: 0.004 m.
double hill_m(double x, double y) {
  constexpr double last_row_m = 160.5;  // from the corner: samples are at the centres of cells
  return 50 + 2 * std::sin((x - 0.5) * 0.08) + 1.5 * std::cos((last_row_m - y) * 0.11);
}

double metres(const std::string& text) { return std::stod(text); }

struct Rows {
  std::string text;
  std::size_t number() const { return std::stoul(text.substr(text.find_last_of(' '))); }
};

class WindowToolsTest : public testing::WindowTest {
 protected:
  QLabel* picked_title() {
    return const_cast<FactTable&>(window_->picked()).parentWidget()->findChild<QLabel*>();
  }

  // Clicks into the view until a point of the layer is picked.
  bool pick_in(const std::string& layer) {
    Canvas& canvas = window_->canvas();
    for (int y = 20; y < canvas.height() - 20; y += 9) {
      for (int x = 20; x < canvas.width() - 20; x += 9) {
        const auto picked = window_->view().pick(x, y);
        if (!picked || picked->layer != layer) continue;
        QTest::mouseClick(&canvas, Qt::LeftButton, Qt::NoModifier, {x, y});
        settle();
        return true;
      }
    }
    return false;
  }
};

TEST_F(WindowToolsTest, PickingAnEchoShowsItsColumnsBeamAndFootprint) {
  Window& window = shown();
  open(SampleDataset::get().path());
  ASSERT_TRUE(pick_in("dataset/lidar/top"));
  EXPECT_EQ(dismiss_fault(), "");
  const std::size_t row = Rows{picked_title()->text().toStdString()}.number();
  // The oracle is that row of the file, read without the window.
  const PointCloud scan = read_ply(SampleDataset::get().path() / "lidar/top/000000.ply").cloud;
  ASSERT_LT(row, scan.rows());
  for (const PointCloud::Column& column : scan.columns()) {
    EXPECT_NE(window.picked().value(column.name), "") << column.name;
  }
  EXPECT_EQ(std::stoi(window.picked().value("ring")), scan.column<std::uint16_t>("ring")[row]);
  const glm::dvec3 shown_m(metres(window.picked().value("east")),
                           metres(window.picked().value("north")),
                           metres(window.picked().value("up")));
  const glm::dvec3 true_m =
      window.timeline_panel().timeline()->georeference().origin_w_m +
      glm::dvec3(scan.column<double>("world_x")[row], scan.column<double>("world_y")[row],
                 scan.column<double>("world_z")[row]);
  constexpr double noise_m = 0.02;  // of the ranges, from the scene file
  EXPECT_LT(glm::distance(shown_m, true_m), 6 * noise_m);
  for (const char* layer : {"picked/beam", "picked/footprint", "picked/place"}) {
    EXPECT_NE(window.view().find(layer), nullptr) << layer;
  }
  // The beam ends at the echo.
  const Layer& beam = *window.view().find("picked/beam");
  EXPECT_LT(glm::distance(beam.p_w_m(1), shown_m), 0.002);
  QTest::keyClick(&window, Qt::Key_Escape);
  EXPECT_EQ(window.view().find("picked/beam"), nullptr);
  // The beam also disappears when its dataset is opened again.
  ASSERT_TRUE(pick_in("dataset/lidar/top"));
  ASSERT_NE(window.view().find("picked/beam"), nullptr);
  open(SampleDataset::get().path());
  EXPECT_EQ(window.view().find("picked/beam"), nullptr);
}

TEST_F(WindowToolsTest, ReportsOnlyTheLastPick) {
  Window& window = shown();
  open(SampleDataset::get().path());
  std::vector<std::string> reported;
  std::string failed;
  Picker picker(window.view(),
                {.facts = [&](const std::string& title, const auto&) { reported.push_back(title); },
                 .failed = [&](const std::string& message) { failed = message; }});
  ShownScan scan;  // in a missing file: an attempt to read it reports an error
  scan.frame.file = "/nowhere/000000.ply";
  const Picked picked{.layer = "dataset/lidar/top", .row = 1};
  picker.pick(picked, &scan);
  EXPECT_TRUE(picker.is_busy());
  picker.pick(picked, nullptr);
  EXPECT_FALSE(picker.is_busy());
  QTest::qWait(200);
  EXPECT_EQ(failed, "");
  EXPECT_EQ(reported, std::vector<std::string>{"dataset/lidar/top: point 1"});
}

TEST_F(WindowToolsTest, PickingASurfaceShowsItsValues) {
  Window& window = shown();
  open(SampleDataset::get().scene());
  ASSERT_TRUE(pick_in("scene.yaml/terrain"));
  const double x = metres(window.picked().value("east")),
               y = metres(window.picked().value("north"));
  EXPECT_NEAR(metres(window.picked().value("up")), hill_m(x, y), 0.05);
  EXPECT_NE(window.picked().value("slope"), "");
}

TEST_F(WindowToolsTest, TimelineShowsTheCurrentScans) {
  Window& window = shown();
  open(SampleDataset::get().path());
  TimelinePanel& panel = window.timeline_panel();
  const Timeline& timeline = *panel.timeline();
  auto* slider = panel.findChild<QSlider*>("time");
  const auto rows_shown = [&] { return window.view().find("dataset/lidar/top")->points(); };
  const auto rows_of = [&](std::chrono::nanoseconds time) {
    const std::size_t top = timeline.sensor_named("top");
    const RecordedFrame& frame = timeline.sensors()[top].frames[*timeline.current(top, time)];
    return read_ply(frame.file).cloud.rows();
  };
  for (const int place : {slider->maximum(), slider->maximum() / 2, 0}) {
    slider->setValue(place);
    settle();
    EXPECT_EQ(dismiss_fault(), "");
    EXPECT_EQ(rows_shown(), rows_of(panel.time())) << place;
  }
  // Steps go from stamp to stamp.
  QTest::keyClick(&window, Qt::Key_Period);
  settle();
  const auto second = panel.time();
  EXPECT_EQ(second, *timeline.next(timeline.begin()));
  QTest::keyClick(&window, Qt::Key_Comma);
  settle();
  EXPECT_EQ(panel.time(), timeline.begin());
  // Playback stops at the end.
  QTest::mouseClick(panel.findChild<QWidget*>("play"), Qt::LeftButton);
  EXPECT_TRUE(panel.is_playing());
  EXPECT_TRUE(wait_until([&] { return !panel.is_playing(); }, 10'000));
  settle();
  EXPECT_EQ(panel.time(), timeline.end());
  EXPECT_EQ(rows_shown(), rows_of(timeline.end()));
  EXPECT_GT(window.view().find("dataset/trail")->points(), 2U);
}

TEST_F(WindowToolsTest, MovingObjectsFollowTheTimeline) {
  Window& window = shown();
  open(SampleDataset::get().path());
  open(SampleDataset::get().scene());
  const auto middle_y_m = [&] {
    const Layer& cart = *window.view().find("scene.yaml/objects/cart");
    double least = 1e9, most = -1e9;
    for (vtkIdType i = 0; i < static_cast<vtkIdType>(cart.points()); ++i) {
      least = std::min(least, cart.p_w_m(i).y);
      most = std::max(most, cart.p_w_m(i).y);
    }
    return (least + most) / 2;
  };
  TimelinePanel& panel = window.timeline_panel();
  panel.go_to(std::chrono::milliseconds(50));
  settle();
  const double before_m = middle_y_m();
  panel.findChild<QCheckBox*>("rides")->setChecked(true);
  settle();
  const Look look = window.view().current_look();
  const Timeline& timeline = *panel.timeline();
  const glm::dvec3 platform_m = timeline.pose_at(0, panel.time()).translation_m;
  panel.go_to(std::chrono::milliseconds(450));
  settle();
  // The cart drives north at 8 m/s and leans with the slope of the ground: 0.2 rad at most.
  EXPECT_NEAR(middle_y_m() - before_m, 8 * 0.4, 0.25);
  const glm::dvec3 ridden_m = window.view().current_look().from_w_m - look.from_w_m;
  const glm::dvec3 driven_m = timeline.pose_at(0, panel.time()).translation_m - platform_m;
  EXPECT_LT(glm::distance(ridden_m, driven_m), 1e-6);
  EXPECT_GT(glm::length(driven_m), 1);
}

TEST_F(WindowToolsTest, ClickedPixelShowsItsRayAndTheSurface) {
  Window& window = shown();
  open(SampleDataset::get().path());
  window.timeline_panel().go_to(window.timeline_panel().timeline()->end());
  settle();
  ImagePanel& panel = window.image_panel();
  ASSERT_NE(panel.image(), nullptr);
  auto* channel = panel.findChild<QComboBox*>("channel");
  EXPECT_GT(channel->count(), 5);
  for (int i = 0; i < channel->count(); ++i) {
    channel->setCurrentIndex(i);
    EXPECT_TRUE(wait_until([&] { return !panel.is_busy(); }));
  }
  const auto label = panel.image()->find("label");
  ASSERT_TRUE(label);
  int of_ground = 0;
  for (const glm::ivec2 pixel : {glm::ivec2(31, 40), glm::ivec2(10, 44), glm::ivec2(55, 36)}) {
    constexpr double ground = 3;  // label of the terrain in the scene file
    if (panel.image()->numbers_at(*label, pixel).front() != ground) continue;
    ++of_ground;
    const QPoint place = panel.area().place_of(pixel).toPoint();
    QTest::mouseClick(&panel.area(), Qt::LeftButton, Qt::NoModifier, place);
    ASSERT_NE(window.view().find("picked/ray"), nullptr);
    const glm::dvec3 p = window.view().find("picked/ray")->p_w_m(1);
    EXPECT_NEAR(p.z, hill_m(p.x, p.y), 0.05) << pixel.x << ' ' << pixel.y;
    EXPECT_NE(window.picked().value("surface"), "");
  }
  EXPECT_GT(of_ground, 0);
}

TEST_F(WindowToolsTest, ScansFromTheClickedPlace) {
  Window& window = shown();
  open(SampleDataset::get().scene());
  ScanPanel& panel = window.scan_panel();
  panel.choose("velodyne_vlp16");
  QTest::mouseClick(panel.findChild<QPushButton*>("place"), Qt::LeftButton);
  ASSERT_TRUE(window.canvas().is_taking_place());
  const QPoint middle(window.canvas().width() / 2, window.canvas().height() / 2);
  const auto ground = window.view().pick(middle.x(), middle.y() + 60);
  ASSERT_TRUE(ground);
  QTest::mousePress(&window.canvas(), Qt::LeftButton, {}, middle + QPoint(0, 60));
  QTest::mouseRelease(&window.canvas(), Qt::LeftButton, {}, middle + QPoint(0, 20));
  ASSERT_TRUE(panel.has_place());
  const Layer& place = *window.view().find("scan here/place");
  EXPECT_NEAR(place.p_w_m(0).x, ground->p_w_m.x, 1e-3);
  EXPECT_NEAR(place.p_w_m(0).z, hill_m(ground->p_w_m.x, ground->p_w_m.y) + 1.8, 0.05);
  QTest::mouseClick(panel.findChild<QPushButton*>("scan"), Qt::LeftButton);
  EXPECT_TRUE(panel.is_scanning());
  settle();
  EXPECT_EQ(dismiss_fault(), "");
  const Layer* scan = window.view().find("scan here/1 velodyne_vlp16");
  ASSERT_NE(scan, nullptr);
  ASSERT_GT(scan->points(), 1000U);
  // Most of it is ground; the sensor's range noise is 0.03 m at most.
  std::size_t on_ground = 0;
  for (vtkIdType i = 0; i < static_cast<vtkIdType>(scan->points()); ++i) {
    const glm::dvec3 p = scan->p_w_m(i);
    on_ground += std::abs(p.z - hill_m(p.x, p.y)) < 0.15 ? 1U : 0U;
  }
  EXPECT_GT(static_cast<double>(on_ground), 0.9 * static_cast<double>(scan->points()));
  // Its echoes have beams, too.
  window.view().fit("scan here/1 velodyne_vlp16");
  ASSERT_TRUE(pick_in("scan here/1 velodyne_vlp16"));
  EXPECT_NE(window.view().find("picked/beam"), nullptr);
}

TEST_F(WindowToolsTest, ScansABareDem) {
  Window& window = shown();
  open(SampleDataset::get().scene().parent_path() / "hills.asc");
  ScanPanel& panel = window.scan_panel();
  panel.choose("velodyne_vlp16");
  QTest::mouseClick(panel.findChild<QPushButton*>("place"), Qt::LeftButton);
  EXPECT_TRUE(wait_until([&] { return window.canvas().is_taking_place(); }));
  window.canvas().take_place(false);
  panel.place_at({80, 80, 50}, {90, 80, 50});
  ASSERT_TRUE(panel.has_place());
  panel.scan();
  settle();
  EXPECT_EQ(dismiss_fault(), "");
  const Layer* scan = window.view().find("scan here/1 velodyne_vlp16");
  ASSERT_NE(scan, nullptr);
  ASSERT_GT(scan->points(), 1000U);
  // There is only ground; 6 sigma of the range noise are 0.18 m along the beam.
  for (vtkIdType i = 0; i < static_cast<vtkIdType>(scan->points()); ++i) {
    const glm::dvec3 p = scan->p_w_m(i);
    ASSERT_NEAR(p.z, hill_m(p.x, p.y), 0.2) << i;
  }
  open(SampleDataset::get().scene());  // contains objects in addition to the ground
  EXPECT_FALSE(panel.has_place());
  window.layer_panel().select("hills.asc");
  QTest::keyClick(&window, Qt::Key_Delete);
  panel.place_at({80, 80, 50}, {90, 80, 50});
  EXPECT_TRUE(panel.has_place());
}

TEST_F(WindowToolsTest, ScanCanBeCancelled) {
  Window& window = shown();
  open(SampleDataset::get().scene());
  ScanPanel& panel = window.scan_panel();
  panel.choose("ouster_os1_128");
  panel.place_at({80, 80, 50}, {90, 80, 50});
  const std::size_t layers = window.view().layers().size();
  QTest::mouseClick(panel.findChild<QPushButton*>("scan"), Qt::LeftButton);
  ASSERT_TRUE(panel.is_scanning());
  auto* cancel = panel.findChild<QPushButton*>("cancel");
  EXPECT_TRUE(cancel->isEnabled());
  QTest::mouseClick(cancel, Qt::LeftButton);
  EXPECT_TRUE(wait_until([&] { return !panel.is_scanning(); }));
  EXPECT_EQ(panel.findChild<QLabel*>("scan_status")->text(), "cancelled");
  EXPECT_EQ(window.view().layers().size(), layers);
  EXPECT_TRUE(panel.findChild<QPushButton*>("scan")->isEnabled());
}

TEST_F(WindowToolsTest, WindowRemainsResponsiveWhileLoading) {
  Window& window = shown();
  open(SampleDataset::get().scene());  // first opened to measure how long a picture of it takes
  ASSERT_NE(window.view().find("scene.yaml/terrain"), nullptr);
  QElapsedTimer of_picture;
  of_picture.start();
  window.canvas().makeCurrent();
  window.view().render();
  const qint64 picture_ms = of_picture.elapsed();
  window.close_all();
  settle();
  window.open(SampleDataset::get().scene());
  // The window's thread is never blocked for long: its clock keeps running.
  QElapsedTimer clock;
  clock.start();
  qint64 longest_ms = 0, last_ms = 0;
  while (window.is_busy() && clock.elapsed() < 60'000) {
    QCoreApplication::processEvents(QEventLoop::AllEvents, 5);
    longest_ms = std::max(longest_ms, clock.elapsed() - last_ms);
    last_ms = clock.elapsed();
  }
  // Work of the window's own thread between events: a few pictures, including the upload of the
  // data for the first.
  EXPECT_LT(longest_ms, 500 + 10 * picture_ms);
  settle();
  EXPECT_NE(window.view().find("scene.yaml/terrain"), nullptr);
}

TEST_F(WindowToolsTest, MayBeClosedDuringAJob) {
  shown().open(SampleDataset::get().scene());
  window_.reset();
  Window& window = shown();
  open(SampleDataset::get().scene());
  window.scan_panel().choose("ouster_os1_128");
  window.scan_panel().place_at({80, 80, 50}, {90, 80, 50});
  window.scan_panel().scan();
  EXPECT_TRUE(window.scan_panel().is_scanning());
  window_.reset();
  QTest::qWait(50);  // queued results have no receiver any more
}

TEST_F(WindowToolsTest, ComparesWithASceneAndADem) {
  Window& window = shown();
  const TemporaryFolder folder;
  testing::write_hills(folder / "hills.asc");
  constexpr double above_m = 0.5;
  PointCloud points(500);
  const auto x = points.add<double>("x"), y = points.add<double>("y"), z = points.add<double>("z");
  for (std::size_t i = 0; i < points.rows(); ++i) {
    const std::size_t line = i / 100;
    // The points are on DEM samples, whose centres are half a metre inside the border.
    x[i] = static_cast<double>(20 + i % 100) + 0.5;
    y[i] = static_cast<double>(20 + 10 * line) + 0.5;
    z[i] = hill_m(x[i], y[i]) + above_m;
  }
  write_ply(folder / "above.ply", points, {});
  open(folder / "above.ply");
  open(folder / "hills.asc");
  open(SampleDataset::get().scene());
  ComparePanel& panel = window.compare_panel();
  for (const char* truth : {"heights of hills.asc", "ground of scene.yaml"}) {
    panel.choose("above.ply", truth);
    panel.compare_chosen();
    settle();
    EXPECT_EQ(dismiss_fault(), "") << truth;
    EXPECT_EQ(panel.figures().value("points"), "500") << truth;
    // Heights are stored with four decimal places, points as floats in metres.
    EXPECT_NEAR(metres(panel.figures().value("mean")), above_m, 2e-4) << truth;
    EXPECT_LT(std::abs(metres(panel.figures().value("NMAD"))), 2e-4) << truth;
  }
}

TEST_F(WindowToolsTest, LevelsFollowAClickedPlace) {
  Window& window = shown();
  open(SampleDataset::get().scene());
  const QPoint middle(window.canvas().width() / 2, window.canvas().height() / 2 + 40);
  const auto ground = window.view().pick(middle.x(), middle.y());
  ASSERT_TRUE(ground);
  const glm::dvec3 eye_w_m = window.view().current_look().from_w_m;
  ASSERT_TRUE(window.tracker().viewpoint_w_m());
  EXPECT_LT(glm::distance(*window.tracker().viewpoint_w_m(), eye_w_m),
            0.05 * glm::distance(eye_w_m, window.view().current_look().at_w_m));
  QTest::mouseClick(&window.canvas(), Qt::LeftButton, Qt::ControlModifier, middle);
  settle();
  EXPECT_EQ(window.tracker().follows(), TerrainTracker::Follows::Place);
  EXPECT_NE(window.view().find("viewpoint"), nullptr);
  const glm::dvec3 eyes_m(0, 0, 2);  // eye level of a person who stands on the ground
  EXPECT_LT(glm::distance(*window.tracker().viewpoint_w_m(), ground->p_w_m + eyes_m), 1e-6);
  // The levels now stay as they are, wherever the eye moves.
  QTest::keyClick(&window, Qt::Key_1);
  settle();
  EXPECT_LT(glm::distance(*window.tracker().viewpoint_w_m(), ground->p_w_m + eyes_m), 1e-6);
}

}  // namespace
}  // namespace groundray::window_tools_test
