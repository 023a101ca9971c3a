#include "apps/view/window/run_window.h"

#include <QVTKOpenGLNativeWidget.h>

#include <QApplication>
#include <QStandardPaths>
#include <QSurfaceFormat>
#include <clocale>
#include <cstdlib>

#include "apps/view/window/style.h"
#include "apps/view/window/window.h"
#include "core/error.h"

namespace groundray {
namespace {

bool has_display() {
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"}) {
    const char* value = std::getenv(name);
    if (value != nullptr && *value != '\0') return true;
  }
  return false;
}

std::filesystem::path settings_file() {
  const QString folder = QStandardPaths::writableLocation(QStandardPaths::GenericConfigLocation);
  if (folder.isEmpty()) return {};
  return std::filesystem::path(folder.toStdString()) / "groundray" / "view.ini";
}

}  // namespace

int run_window(int& argc, char** argv, const WindowStart& start) {
#ifdef __linux__
  if (!has_display()) {
    throw Error(
        "there is no display for a window: $DISPLAY is empty. Use --screenshot FILE to write a "
        "picture without one");
  }
#endif
  QSurfaceFormat::setDefaultFormat(QVTKOpenGLNativeWidget::defaultFormat());
  QApplication::setAttribute(Qt::AA_EnableHighDpiScaling);
  const QApplication application(argc, argv);
  std::setlocale(LC_NUMERIC, "C");  // Qt takes the user's, with which VTK writes commas
  set_style(*qApp);
  WindowStart begun = start;
  if (begun.settings.empty()) begun.settings = settings_file();
  Window window(std::move(begun));
  window.show();
  return QApplication::exec();
}

}  // namespace groundray
