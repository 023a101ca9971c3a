#pragma once

#include <QVTKOpenGLNativeWidget.h>
#include <gtest/gtest.h>

#include <QApplication>
#include <QElapsedTimer>
#include <QMessageBox>
#include <QScreen>
#include <QSurfaceFormat>
#include <QTest>
#include <filesystem>
#include <functional>
#include <string>

#include "apps/view/window/style.h"
#include "apps/view/window/window.h"
#include "test/support/temporary_folder.h"

namespace groundray::testing {

/// Returns the only application of a test program. It is never destroyed: Qt and the drivers
/// conflict in the order of their destruction.
inline QApplication& application() {
  static QApplication* const made = [] {
    qputenv("GROUNDRAY_DATA", QByteArray::fromStdString(data_folder().string()));
    QSurfaceFormat::setDefaultFormat(QVTKOpenGLNativeWidget::defaultFormat());
    static int argc = 1;
    static char name[] = "window_test";
    static char* argv[] = {name, nullptr};
    auto* application = new QApplication(argc, argv);
    set_style(*application);
    return application;
  }();
  return *made;
}

/// Processes events until a condition holds. @return true if it holds within the time limit.
inline bool wait_until(const std::function<bool()>& holds, int most_ms = 60'000) {
  QElapsedTimer clock;
  clock.start();
  while (!holds()) {
    if (clock.elapsed() > most_ms) return false;
    QTest::qWait(5);
  }
  return true;
}

/// Fixture with a window in the state in which the program starts.
class WindowTest : public ::testing::Test {
 protected:
  WindowTest() { application(); }

  Window& shown(WindowStart start = {}) {
    window_ = std::make_unique<Window>(std::move(start));
    window_->resize(1100, 760);
    window_->show();
    EXPECT_TRUE(QTest::qWaitForWindowExposed(window_.get()));
    QApplication::setActiveWindow(window_.get());  // no window manager does it
    return *window_;
  }

  /// Opens a file and waits until everything that follows from it is finished.
  void open(const std::filesystem::path& path) {
    window_->open(path);
    settle();
  }

  void settle() {
    int quiet = 0;  // consecutive checks without activity
    EXPECT_TRUE(wait_until([&] {
      const bool goes_on = window_->is_busy() || window_->canvas().is_moving();
      quiet = goes_on && fault() == nullptr ? 0 : quiet + 1;
      return quiet > 3;
    }));
  }

  /// Returns the message box of an error, or null if there is none.
  QMessageBox* fault() const {
    for (auto* box : window_->findChildren<QMessageBox*>("fault")) {
      if (box->isVisible()) return box;
    }
    return nullptr;
  }

  /// Returns the message of the displayed error and closes it; empty if there is none.
  std::string dismiss_fault() const {
    QMessageBox* box = fault();
    if (box == nullptr) return "";
    const std::string text = box->text().toStdString();
    QTest::keyClick(box, Qt::Key_Return);
    EXPECT_TRUE(wait_until([&] { return fault() == nullptr; }, 5000));
    return text;
  }

  /// Returns the number of screen pixels that show a layer: those that change when it is hidden.
  std::size_t pixels_of(const std::string& layer) const {
    View& view = window_->view();
    view.set_legend_visible(false);
    const QImage with = view_on_screen();
    view.set_visible(layer, false);
    const QImage without = view_on_screen();
    view.set_visible(layer, true);
    view.set_legend_visible(true);
    view_on_screen();
    std::size_t changed = 0;
    for (int y = 0; y < with.height(); ++y) {
      for (int x = 0; x < with.width(); ++x) {
        changed += with.pixel(x, y) != without.pixel(x, y) ? 1U : 0U;
      }
    }
    return changed;
  }

  QImage view_on_screen() const {
    window_->canvas().draw();
    QTest::qWait(100);
    const QPoint corner = window_->canvas().mapToGlobal({0, 0});
    return QGuiApplication::primaryScreen()
        ->grabWindow(0, corner.x(), corner.y(), window_->canvas().width(),
                     window_->canvas().height())
        .toImage();
  }

  std::unique_ptr<Window> window_;
};

}  // namespace groundray::testing
