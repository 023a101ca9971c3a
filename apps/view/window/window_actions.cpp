#include <QAction>
#include <QApplication>
#include <QDir>
#include <QDockWidget>
#include <QFileDialog>
#include <QMenuBar>
#include <QToolBar>
#include <glm/geometric.hpp>

#include "apps/view/window/panels/dialogs.h"
#include "apps/view/window/panels/origin_dialog.h"
#include "apps/view/window/window.h"
#include "core/error.h"

namespace groundray {
namespace {

const char* const open_filter =
    "All supported files (*.yaml *.ply *.pcd *.bin *.npy *.npz *.las *.laz *.mcap *.obj *.stl "
    "*.glb *.gltf *.tif *.tiff *.hgt *.asc *.vrt *.nc *.dem *.zip *.png *.jpg *.jpeg *.exr "
    "*.hdr);;Any file (*)";

}  // namespace

QAction* Window::action(QMenu& menu, QToolBar* bar, const QString& text, const QKeySequence& keys,
                        std::optional<Icon> icon, std::function<void()> done) {
  auto* made = new QAction(text, this);
  made->setShortcut(keys);
  made->setObjectName(text);
  if (icon) made->setIcon(icon_of(*icon));
  const QString named = QString(text).remove('&').remove("...");
  made->setToolTip(keys.isEmpty() ? named : named + "  (" + keys.toString() + ")");
  connect(made, &QAction::triggered, this, [this, done = std::move(done)] {
    try {
      if (done) done();
    } catch (const std::exception& error) {
      fault(error.what());
    }
  });
  menu.addAction(made);
  if (bar != nullptr) bar->addAction(made);
  return made;
}

void Window::build_actions() {
  QToolBar& bar = *addToolBar("Tools");
  bar.setObjectName("tools");
  bar.setIconSize({22, 22});
  bar.setMovable(false);
  build_file_actions(*menuBar()->addMenu("&File"), bar);
  bar.addSeparator();
  build_view_actions(*menuBar()->addMenu("&View"), bar);
  bar.addSeparator();
  build_tool_actions(*menuBar()->addMenu("&Tools"), bar);
  QMenu& panels = *menuBar()->addMenu("&Panels");
  for (QWidget* content :
       std::initializer_list<QWidget*>{layers_, status_->parentWidget(), picked_->parentWidget(),
                                       timeline_, images_, scan_, compare_, clip_}) {
    panels.addAction(docks_.at(content)->toggleViewAction());
  }
  QMenu& help = *menuBar()->addMenu("&Help");
  action(help, &bar, "Mouse and &keys", Qt::Key_F1, Icon::Help, [this] { show_help(this); });
}

void Window::build_file_actions(QMenu& menu, QToolBar& bar) {
  action(menu, &bar, "&Open...", QKeySequence::Open, Icon::Open, [this] { ask_to_open(); });
  action(menu, &bar, "Open a dataset's &folder...", QKeySequence("Ctrl+Shift+O"), Icon::OpenFolder,
         [this] { ask_to_open_folder(); });
  recent_menu_ = menu.addMenu("Open &recent");
  recent_menu_->setObjectName("recent");
  connect(recent_menu_, &QMenu::aboutToShow, this, [this] { fill_recent(); });
  menu.addSeparator();
  action(menu, &bar, "&Save a picture...", QKeySequence::Save, Icon::Save,
         [this] { ask_for_picture(); });
  action(menu, nullptr, "Save a &turntable...", QKeySequence("Ctrl+T"), {},
         [this] { ask_for_turntable(); });
  menu.addSeparator();
  action(menu, nullptr, "&Close the selected layer", Qt::Key_Delete, {},
         [this] { close_selected(); });
  action(menu, nullptr, "Close &all", QKeySequence("Ctrl+W"), {}, [this] { close_all(); });
  menu.addSeparator();
  action(menu, nullptr, "&Quit", QKeySequence("Ctrl+Q"), {}, [this] { close(); });
}

void Window::build_view_actions(QMenu& menu, QToolBar& bar) {
  const auto fit = [this] {
    view().fit();
    canvas_->look(view().current_look());
  };
  action(menu, &bar, "See &all", Qt::Key_F, Icon::Fit, fit)
      ->setShortcuts({Qt::Key_F, Qt::Key_Home});
  action(menu, nullptr, "See the selected &layer", Qt::Key_Z, {}, [this] {
    if (view().find(layers_->selected()) == nullptr) return;
    view().fit(layers_->selected());
    canvas_->look(view().current_look());
  });
  const auto view_along = [&](const char* text, Qt::Key key, Icon icon, glm::dvec3 direction,
                              glm::dvec3 up) {
    action(menu, &bar, text, key, icon, [this, direction, up] { look_along(direction, up); });
  };
  view_along("From a&bove", Qt::Key_1, Icon::Top, {0, 0, -1}, {0, 1, 0});
  view_along("From the &south", Qt::Key_2, Icon::South, {0, 1, -0.05}, {0, 0, 1});
  view_along("From the &east", Qt::Key_3, Icon::East, {-1, 0, -0.05}, {0, 0, 1});
  view_along("Obli&que", Qt::Key_4, Icon::Oblique, {0.6, 1, -0.8}, {0, 0, 1});
  menu.addSeparator();
  action(menu, &bar, "&Wireframe", Qt::Key_T, Icon::Wireframe, [this] { toggle_wireframe(); });
  QAction* legend = action(menu, &bar, "&Legend", Qt::Key_L, Icon::Legend, {});
  legend->setCheckable(true);
  legend->setChecked(true);
  connect(legend, &QAction::toggled, this, [this](bool on) {
    view().set_legend_visible(on);
    canvas_->draw();
  });
  QAction* dome = action(menu, &bar, "&Eye-dome lighting", Qt::Key_Y, Icon::EyeDome, {});
  dome->setCheckable(true);
  connect(dome, &QAction::toggled, this, [this](bool on) {
    view().set_eye_dome(on);
    canvas_->draw();
  });
  dome->setChecked(start_.view.has_eye_dome);
  action(menu, nullptr, "&Full screen", Qt::Key_F11, {},
         [this] { setWindowState(windowState() ^ Qt::WindowFullScreen); });
}

void Window::build_tool_actions(QMenu& menu, QToolBar& bar) {
  const auto show = [this](QWidget* panel) {
    docks_.at(panel)->show();
    docks_.at(panel)->raise();
  };
  action(menu, &bar, "Sca&n here", Qt::Key_N, Icon::Scan, [this, show] { show(scan_); });
  action(menu, &bar, "&Compare with the truth", Qt::Key_C, Icon::Compare,
         [this, show] { show(compare_); });
  measures_ = action(menu, &bar, "&Measure distances", Qt::Key_M, Icon::Measure, {});
  measures_->setCheckable(true);
  connect(measures_, &QAction::toggled, this, [this](bool on) { measure(on); });
  action(menu, &bar, "Clip by a &box", Qt::Key_B, Icon::Clip, [this, show] { show(clip_); });
  action(menu, nullptr, "Set the &origin of the selected layer...", QKeySequence("Ctrl+G"), {},
         [this] { ask_for_origin_of_selected(); });
  menu.addSeparator();
  QAction* play = action(menu, nullptr, "&Play", Qt::Key_Space, {},
                         [this] { timeline_->play(!timeline_->is_playing()); });
  // Only here: elsewhere, the space bar presses the widget with the focus.
  play->setShortcutContext(Qt::WidgetWithChildrenShortcut);
  canvas_->addAction(play);
  docks_.at(timeline_)->addAction(play);
  action(menu, nullptr, "&Next frame", Qt::Key_Period, {}, [this] { timeline_->step_forward(); });
  action(menu, nullptr, "Pre&vious frame", Qt::Key_Comma, {}, [this] { timeline_->step_back(); });
  menu.addSeparator();
  action(menu, nullptr, "Cancel and clear pic&ks", Qt::Key_Escape, {}, [this] { escape(); });
}

void Window::ask_to_open() {
  for (const QString& name : QFileDialog::getOpenFileNames(this, "Open", {}, open_filter)) {
    open(name.toStdString());
  }
}

void Window::ask_to_open_folder() {
  const QString name = QFileDialog::getExistingDirectory(this, "Open a dataset's folder");
  if (!name.isEmpty()) open(name.toStdString());
}

void Window::ask_for_picture() {
  const auto size_px = ask_for_size(this, canvas_->size());
  if (!size_px) return;
  const QString name =
      QFileDialog::getSaveFileName(this, "Save a picture", "groundray.png", "PNG (*.png)");
  if (!name.isEmpty()) save_picture(name.toStdString(), *size_px);
}

void Window::ask_for_turntable() {
  const auto write = [this](const Look& look, const std::filesystem::path& path,
                            glm::ivec2 size_px) {
    const Look before = view().current_look();
    view().look(look);
    try {
      save_picture(path, size_px);
    } catch (...) {
      canvas_->look(before);
      throw;
    }
    view().look(before);
  };
  auto* dialog = new TurntableDialog(
      view().current_look(), {canvas_->width(), canvas_->height()},
      {.write = write, .failed = [this](const std::string& message) { fault(message); }}, this);
  dialog->open();
}

// Lists recent files by their full paths, with the home folder abbreviated.
void Window::fill_recent() {
  recent_menu_->clear();
  for (const std::filesystem::path& path : recent_.paths()) {
    QString text = QString::fromStdString(path.string());
    const QString home = QDir::homePath() + '/';
    if (text.startsWith(home)) text.replace(0, home.size(), "~/");
    connect(recent_menu_->addAction(text.replace('&', "&&")), &QAction::triggered, this,
            [this, path] { open(path); });
  }
  if (recent_.paths().empty()) {
    recent_menu_->addAction("empty")->setEnabled(false);
    return;
  }
  recent_menu_->addSeparator();
  connect(recent_menu_->addAction("&Clear the list"), &QAction::triggered, this,
          [this] { recent_.clear(); });
}

// Offers the origins of scenes and datasets, in whose frames other programs' files may be.
void Window::ask_for_origin_of_selected() {
  const std::string name = layers_->selected();
  const auto document = std::ranges::find(documents_, document_of(name), &Document::name);
  const bool is_movable = document != documents_.end() &&
                          (document->kind == InputKind::Mesh || document->kind == InputKind::Cloud);
  if (!is_movable) return fault("Select a mesh or a cloud first: only these may lack an origin.");
  KnownOrigins known;
  for (const Document& each : documents_) {
    if (each.timeline != nullptr)
      known.emplace_back(each.name, each.timeline->georeference().origin_w_m);
  }
  ask_for_origin(this, name, view().find(name)->frame_w_m, known,
                 [this, name](const glm::dvec3& origin_w_m) {
                   const Layer* const layer = view().find(name);
                   if (layer == nullptr) return;
                   Layer moved = *layer;
                   move_frame(moved, origin_w_m);
                   view().add(std::move(moved));
                   picker_->clear();
                   view().fit(name);
                   canvas_->look(view().current_look());
                 });
}

// Shows everything from a direction.
void Window::look_along(const glm::dvec3& direction, const glm::dvec3& up) {
  view().fit();
  const Look fitted = view().current_look();
  const double distance_m = glm::distance(fitted.from_w_m, fitted.at_w_m);
  canvas_->look({fitted.at_w_m - distance_m * glm::normalize(direction), fitted.at_w_m, up});
}

void Window::toggle_wireframe() {
  bool all = true;
  std::vector<std::string> surfaces;
  for (const Layer* layer : view().layers()) {
    if (layer->triangles() == 0 || layer->kind == LayerKind::Picture) continue;
    surfaces.push_back(layer->name);
    all = all && layer->wireframe;
  }
  for (const std::string& name : surfaces) view().set_wireframe(name, !all);
  layers_->refresh();
  canvas_->draw();
}

void Window::close_selected() {
  const std::string layer = layers_->selected();
  if (view().find(layer) == nullptr) return;
  remove_layer(layer);
  playback_->exclude(layer);
  const std::string document = layer.substr(0, layer.find('/'));
  for (Document& each : documents_) {
    if (each.name == document && each.terrain == layer) each.follower = nullptr;
  }
  bool has_more = false;
  for (const Layer* each : view().layers()) {
    has_more = has_more || each->name.substr(0, each->name.find('/')) == document;
  }
  if (!has_more) forget(document);
  changed();
}

void Window::escape() {
  if (canvas_->is_taking_place()) return canvas_->take_place(false);
  if (scan_->is_scanning()) return scan_->cancel();
  if (compare_->is_comparing()) return compare_->cancel();
  if (opening_.is_running()) return cancel_opening();
  if (measures_->isChecked()) return measures_->setChecked(false);
  timeline_->play(false);
  view().remove("picked/ray");
  images_->mark(std::nullopt);
  picker_->clear();
}

}  // namespace groundray
