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
#include <set>
#include <string>

#include "apps/view/window/style.h"
#include "apps/view/window/window.h"
#include "test/support/temporary_folder.h"

namespace groundray::testing {

/// The one application of a test program. It is never taken down: Qt and the drivers do not agree
/// on who goes first.
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

/// Lets the application work until something holds. @return whether it does in time.
inline bool wait_until(const std::function<bool()>& holds, int most_ms = 60'000) {
  QElapsedTimer clock;
  clock.start();
  while (!holds()) {
    if (clock.elapsed() > most_ms) return false;
    QTest::qWait(5);
  }
  return true;
}

/// A window as someone has it who just started the program.
class WindowTest : public ::testing::Test {
 protected:
  WindowTest() { application(); }

  Window& shown(WindowStart start = {}) {
    window_ = std::make_unique<Window>(std::move(start));
    window_->resize(1100, 760);
    window_->show();
    EXPECT_TRUE(QTest::qWaitForWindowExposed(window_.get()));
    QApplication::setActiveWindow(window_.get());  // there is no window manager to do so
    return *window_;
  }

  /// Opens something and waits till all that follows from it is there.
  void open(const std::filesystem::path& path) {
    window_->open(path);
    settle();
  }

  void settle() {
    int quiet = 0;  // looked so often, and nothing went on
    EXPECT_TRUE(wait_until([&] {
      const bool goes_on = window_->is_busy() || window_->canvas().is_moving();
      quiet = goes_on && fault() == nullptr ? 0 : quiet + 1;
      return quiet > 3;
    }));
  }

  /// Returns the message box of a fault, null if there is none.
  QMessageBox* fault() const {
    for (auto* box : window_->findChildren<QMessageBox*>("fault")) {
      if (box->isVisible()) return box;
    }
    return nullptr;
  }

  /// Returns the message of the fault that is shown, and closes it; empty if there is none.
  std::string dismiss_fault() const {
    QMessageBox* box = fault();
    if (box == nullptr) return "";
    const std::string text = box->text().toStdString();
    QTest::keyClick(box, Qt::Key_Return);
    EXPECT_TRUE(wait_until([&] { return fault() == nullptr; }, 5000));
    return text;
  }

  /// Returns how many colours the view has on the screen, to 5 bits each.
  std::size_t colours_in_view() const {
    QTest::qWait(50);
    const QPoint corner = window_->canvas().mapToGlobal({0, 0});
    const QImage image = QGuiApplication::primaryScreen()
                             ->grabWindow(0, corner.x(), corner.y(), window_->canvas().width(),
                                          window_->canvas().height())
                             .toImage();
    std::set<QRgb> colours;
    for (int y = 0; y < image.height(); y += 2) {
      for (int x = 0; x < image.width(); x += 2) colours.insert(image.pixel(x, y) & 0xf8f8f8U);
    }
    return colours.size();
  }

  std::unique_ptr<Window> window_;
};

}  // namespace groundray::testing
