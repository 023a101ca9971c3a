// Draws view.png and view_compare.png, pictures of the viewer's window, for
// docs/pictures/draw_view.py:
//   xvfb-run -a -s '-screen 0 1600x1000x24' draw_window SCENE DATASET FOLDER
#include <fmt/format.h>

#include <QComboBox>
#include <QDockWidget>
#include <QMessageBox>
#include <QPixmap>
#include <QTest>
#include <chrono>
#include <exception>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>

#include "apps/view/window/window.h"
#include "core/error.h"
#include "core/io/print_error.h"
#include "test/view/window_fixture.h"

namespace groundray {
namespace {

constexpr glm::dvec3 sensor_m{429'399.8, 5'150'649.8, 381}, ahead_m{429'420, 5'150'664, 381};

// Window on the screen of an X server of its own.
class Stage {
 public:
  explicit Stage(QSize size_px) : size_px_(size_px) {
    window_.resize(size_px_);
    window_.show();
    QApplication::setActiveWindow(&window_);  // no window manager does it
    settle();
  }

  Window& window() noexcept { return window_; }

  void open(const std::filesystem::path& path) {
    window_.open(path);
    settle();
  }

  void settle() {
    int quiet = 0;  // consecutive checks without activity
    const bool is_quiet = testing::wait_until(
        [&] {
          const bool goes_on = window_.is_busy() || window_.canvas().is_moving();
          quiet = goes_on ? 0 : quiet + 1;
          return quiet > 10;
        },
        600'000);
    for (const auto* box : window_.findChildren<QMessageBox*>("fault"))
      throw Error("the window reports: {}", box->text().toStdString());
    if (!is_quiet) throw Error("the window is busy after ten minutes");
  }

  // Scans from the platform's first place, and shows the scan by a column.
  void scan(const std::string& preset, const std::string& column) {
    QTest::keyClick(&window_, Qt::Key_N);
    ScanPanel& panel = window_.scan_panel();
    panel.choose(preset);
    panel.place_at(sensor_m, ahead_m);
    settle();
    panel.scan();
    settle();
    const std::string layer = "scan here/1 " + preset;
    window_.view().colour_by(layer, column);
    window_.view().set_point_size(layer, 3);
    window_.layer_panel().select(layer);
  }

  void show_channel(const char* name) {
    auto* box = window_.image_panel().findChild<QComboBox*>("channel");
    box->setCurrentText(name);
    if (box->currentText() != name) throw Error("the image has no channel {}", name);
    settle();
  }

  void save(const std::filesystem::path& file) {
    // Controls that have been hidden since have widened the panels.
    window_.resize(size_px_);
    QTest::qWait(200);
    for (QDockWidget* dock : window_.findChildren<QDockWidget*>()) {
      if (window_.dockWidgetArea(dock) == Qt::RightDockWidgetArea && dock->isVisible())
        window_.resizeDocks({dock}, {size_px_.width() / 4}, Qt::Horizontal);
    }
    window_.canvas().draw();
    settle();
    QTest::qWait(1000);
    const QPoint corner = window_.mapToGlobal({0, 0});
    const QPixmap picture = QGuiApplication::primaryScreen()->grabWindow(
        0, corner.x(), corner.y(), window_.width(), window_.height());
    if (!picture.save(QString::fromStdString(file.string())))
      throw Error("{}: it cannot be written", file.string());
  }

 private:
  QSize size_px_;
  Window window_;
};

void draw_scan(const std::filesystem::path& scene, const std::filesystem::path& dataset,
               const std::filesystem::path& file) {
  Stage stage({1440, 900});
  stage.open(scene);
  stage.open(dataset);
  stage.window().timeline_panel().go_to(std::chrono::milliseconds(500));
  stage.settle();
  stage.show_channel("depth");
  stage.scan("velodyne_vlp16", "intensity");
  stage.window().canvas().look(
      {sensor_m + glm::dvec3(-13, -22, 17), sensor_m + glm::dvec3(3, 5, 0)});
  stage.settle();
  stage.save(file);
}

void draw_comparison(const std::filesystem::path& scene, const std::filesystem::path& dataset,
                     const std::filesystem::path& file) {
  Stage stage({1200, 760});
  stage.open(dataset);
  stage.open(scene);
  stage.window().timeline_panel().go_to(std::chrono::milliseconds(600));
  stage.settle();
  stage.show_channel("depth");
  stage.scan("ouster_os1_128", "range_true");
  QTest::keyClick(&stage.window(), Qt::Key_C);
  ComparePanel& panel = stage.window().compare_panel();
  panel.choose("scan here/1 ouster_os1_128", "ground of " + scene.filename().string());
  panel.compare_chosen();
  stage.settle();
  stage.window().canvas().look(
      {sensor_m + glm::dvec3(-14, -24, 19), sensor_m + glm::dvec3(1, 2, 0)});
  stage.settle();
  stage.save(file);
}

}  // namespace
}  // namespace groundray

int main(int argc, char** argv) {
  if (argc != 4) {
    groundray::print_error("usage: draw_window SCENE DATASET FOLDER\n");
    return 2;
  }
  try {
    groundray::testing::application();
    const std::filesystem::path folder = argv[3];
    groundray::draw_scan(argv[1], argv[2], folder / "view.png");
    groundray::draw_comparison(argv[1], argv[2], folder / "view_compare.png");
    return 0;
  } catch (const std::exception& fault) {
    groundray::print_error("draw_window: {}\n", fault.what());
    return 1;
  }
}
