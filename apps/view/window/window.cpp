#include "apps/view/window/window.h"

#include <fmt/format.h>

#include <QComboBox>
#include <QDockWidget>
#include <QFormLayout>
#include <QLabel>
#include <QMessageBox>
#include <QProgressBar>
#include <QPushButton>
#include <QScreen>
#include <QScrollArea>
#include <QStatusBar>
#include <QVBoxLayout>

#include "apps/view/window/widgets.h"
#include "core/image/png_io.h"

namespace groundray {
namespace {

constexpr int status_ms = 500;
constexpr double mib = 1024.0 * 1024.0;
constexpr QSize size_at_first(1440, 900);
constexpr const char* hint =
    "<p style='font-size: 16px'><b>Drop something here</b></p><p>a scene, a dataset's folder, a "
    "mesh,<br>a cloud, a DEM or a picture</p><p>or press <b>Ctrl+O</b>; <b>F1</b> lists mouse "
    "actions and keys</p>";

// Makes a panel scrollable, so that the window may be small.
QScrollArea* scrolled(QWidget* content) {
  auto* area = new QScrollArea;
  area->setWidgetResizable(true);
  area->setFrameShape(QFrame::NoFrame);
  area->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  area->setWidget(content);
  return area;
}

}  // namespace

Window::Window(WindowStart start) : start_(std::move(start)), recent_(start_.settings) {
  setWindowTitle("groundray view");
  setAcceptDrops(true);
  setDockOptions(AllowNestedDocks | AllowTabbedDocks | AnimatedDocks);
  resize(size_at_first.boundedTo(0.95 * screen()->availableSize()));
  canvas_ = new Canvas;
  setCentralWidget(canvas_);
  build_hint();
  build_docks();
  build_workers();
  connect_canvas();
  view().set_legend_visible(start_.view.has_legend);
  images_->set_exposure(start_.view.exposure_ev);
  build_actions();
  build_status_bar();
  status_clock_.setInterval(status_ms);
  connect(&status_clock_, &QTimer::timeout, this, [this] { show_status(); });
  status_clock_.start();
  for (const std::string& request : start_.view.colour_by)
    unmatched_.insert("--colour-by " + request);
  for (const std::string& request : start_.view.hide) unmatched_.insert("--hide " + request);
  for (const FrameOrigin& origin : start_.view.origins)
    unmatched_.insert("--origin " + origin.text);
  for (const std::filesystem::path& input : start_.inputs) open(input);
}

Window::~Window() {
  status_clock_.stop();
  opening_.abandon();
  echoes_.abandon();
}

void Window::build_hint() {
  hint_ = new QLabel(this);
  show_hint({});
  hint_->setStyleSheet(
      "color: #e6eaf0; background: rgba(24, 28, 36, 170); border-radius: 10px; padding: 14px "
      "26px;");
  hint_->setAlignment(Qt::AlignCenter);
  hint_->setAttribute(Qt::WA_TransparentForMouseEvents);
  auto* over_canvas = new QVBoxLayout(canvas_);
  over_canvas->addWidget(hint_, 0, Qt::AlignCenter);
}

// States how to open something or, if a path is given, that it is being opened.
void Window::show_hint(const std::filesystem::path& opening) {
  const QString name = QString::fromStdString(opening.filename().string()).toHtmlEscaped();
  hint_->setText(opening.empty()
                     ? QString(hint)
                     : "<p style='font-size: 16px'><b>Opening " + name + " ...</b></p>");
  hint_->setVisible(documents_.empty());
}

void Window::build_status_bar() {
  message_ = new QLabel("F1: mouse and keys");
  message_->setContentsMargins(6, 0, 0, 0);
  message_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);  // paths may be long
  busy_ = new QProgressBar;
  busy_->setRange(0, 0);
  busy_->setMaximumWidth(140);
  cancel_ = named(new QPushButton("Cancel"), "cancel_opening", "Cancel loading (Escape)");
  cancel_->setFocusPolicy(Qt::NoFocus);
  connect(cancel_, &QPushButton::clicked, this, [this] { cancel_opening(); });
  statusBar()->addWidget(message_, 1);
  for (QWidget* each : {static_cast<QWidget*>(busy_), static_cast<QWidget*>(cancel_)}) {
    statusBar()->addPermanentWidget(each);
    each->hide();
  }
}

QDockWidget* Window::dock(const QString& title, QWidget* content, Side side) {
  auto* made = new QDockWidget(title, this);
  made->setObjectName(title);
  made->setWidget(content == scan_ || content == compare_ || content == clip_ ? scrolled(content)
                                                                              : content);
  const Qt::DockWidgetArea area = side == Side::Left     ? Qt::LeftDockWidgetArea
                                  : side == Side::Bottom ? Qt::BottomDockWidgetArea
                                                         : Qt::RightDockWidgetArea;
  addDockWidget(area, made);
  docks_[content] = made;
  return made;
}

void Window::build_docks() {
  const auto failed = [this](const std::string& message) { fault(message); };
  layers_ = new LayerPanel(view(), {.changed = [this] { canvas_->draw(); },
                                    .selected = [this](auto& name) { show_legend_of(name); },
                                    .failed = failed});
  timeline_ = new TimelinePanel(
      {.time_changed = [this](auto time) { go_to(time); },
       .options_changed = [this] { playback_->set_trail(timeline_->shows_trail()); }});
  build_clip_panel();
  images_ = new ImagePanel({.camera_chosen = [this](auto& name) { playback_->set_camera(name); },
                            .clicked = [this](glm::ivec2 pixel) { click_pixel(pixel); },
                            .echoes_wanted = [this] { update_echoes(); },
                            .exposed =
                                [this](double exposure_ev) {
                                  view().set_exposure(exposure_ev);
                                  canvas_->draw();
                                },
                            .failed = failed});
  scan_ = new ScanPanel({.take_place = [this] { canvas_->take_place(true); },
                         .show =
                             [this](Layer layer) {
                               view().add(std::move(layer));
                               changed();
                             },
                         .scanned = [this](FinishedScan made) { take_scan(std::move(made)); },
                         .failed = failed});
  compare_ = new ComparePanel(
      {.layer = [this](auto& name) { return view().find(name); },
       .compared = [this](const auto& all,
                          const auto& measured) { take_comparison(all, measured); },
       .failed = failed});
  setCorner(Qt::BottomLeftCorner, Qt::LeftDockWidgetArea);
  setCorner(Qt::BottomRightCorner, Qt::RightDockWidgetArea);
  dock("Layers", layers_, Side::Left);
  QDockWidget* status = dock("Status", build_status(), Side::Left);
  dock("Image", images_, Side::RightAbove)->hide();
  QDockWidget* picked = dock("Picked", build_picked(), Side::Right);
  QDockWidget* scan = dock("Scan here", scan_, Side::Right);
  QDockWidget* compare = dock("Compare", compare_, Side::Right);
  QDockWidget* clip = dock("Clip", clip_, Side::Right);
  dock("Time", timeline_, Side::Bottom)->hide();
  tabifyDockWidget(picked, scan);
  tabifyDockWidget(scan, compare);
  tabifyDockWidget(compare, clip);
  picked->raise();
  resizeDocks({docks_[layers_], picked}, {290, 330}, Qt::Horizontal);
  resizeDocks({docks_[layers_], status}, {height() - 270, 230}, Qt::Vertical);
}

QWidget* Window::build_status() {
  auto* content = new QWidget;
  follows_ =
      named(new QComboBox, "follows", "Viewpoint that the terrain's quadtree and clipmap follow");
  follows_->addItems({"the eye", "the platform", "a place (Ctrl + click)"});
  follows_->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  follows_->setMinimumContentsLength(10);
  connect(follows_, qOverload<int>(&QComboBox::activated), this, [this](int index) {
    tracker_->set_follows(static_cast<TerrainTracker::Follows>(index));
  });
  status_ = new FactTable;
  auto* form = new QFormLayout;
  form->addRow("Levels follow", follows_);
  auto* layout = new QVBoxLayout(content);
  layout->setContentsMargins(4, 4, 4, 4);
  layout->addLayout(form);
  layout->addWidget(status_);
  return content;
}

QWidget* Window::build_picked() {
  auto* content = new QWidget;
  picked_title_ = wrapped_label("Click an echo, a point or a triangle.");
  picked_ = new FactTable;
  auto* layout = new QVBoxLayout(content);
  layout->setContentsMargins(4, 4, 4, 4);
  add_widgets(*layout, {picked_title_, picked_});
  return content;
}

void Window::connect_canvas() {
  canvas_->set_hooks({.clicked = [this](auto at_px, auto keys) { click(at_px, keys); },
                      .placed = [this](auto at_px, auto to_px) { take_place(at_px, to_px); },
                      .rested =
                          [this] {
                            follow_eye();
                            show_status();
                          }});
}

void Window::build_workers() {
  const auto failed = [this](const std::string& message) { fault(message); };
  ruler_ = std::make_unique<Ruler>(view());
  const auto redraw = [this] {
    changed();
    update_echoes();
  };
  tracker_ = std::make_unique<TerrainTracker>(view(), TerrainTracker::Hooks{.changed =
                                                                                [this] {
                                                                                  show_status();
                                                                                  changed();
                                                                                },
                                                                            .failed = failed});
  playback_ = std::make_unique<Playback>(
      view(), Playback::Hooks{.changed = redraw,
                              .image = [this](auto& source) { images_->show_image(source); },
                              .no_image = [this](auto first) { report_no_image(first); },
                              .failed = failed});
  picker_ = std::make_unique<Picker>(
      view(),
      Picker::Hooks{.changed = redraw,
                    .facts =
                        [this](const std::string& title, const FactTable::Facts& facts) {
                          picked_title_->setText(QString::fromStdString(title));
                          picked_->show_facts(facts);
                        },
                    .beam = [this](auto& beam, auto& origin) { mark_in_image(beam, origin); },
                    .failed = failed});
}

// Updates the tree and redraws after a change of the view's layers.
void Window::changed() {
  std::vector<std::string> names;
  for (const Layer* layer : view().layers()) names.push_back(layer->name);
  if (layers_->names() != names) {
    layers_->refresh();
    offer_comparisons();
  }
  canvas_->draw();
}

void Window::show_status() {
  FactTable::Facts facts;
  if (const auto& built = tracker_->built()) {
    facts.emplace_back("terrain's triangles", fmt::format("{}", built->triangles));
    facts.emplace_back("quadtree's leaves", fmt::format("{}", built->leaves));
    facts.emplace_back("clipmap's levels", fmt::format("{}", built->levels));
    facts.emplace_back("terrain's memory",
                       fmt::format("{:.1f} MiB", static_cast<double>(built->memory_bytes) / mib));
    facts.emplace_back("rebuilt in", fmt::format("{:.0f} ms", built->rebuild_s * 1000));
    facts.emplace_back("deviation kept", fmt::format("{:.3g} mrad", built->angle_rad * 1000));
  }
  std::size_t points = 0, triangles = 0;
  for (const Layer* layer : view().layers()) {
    if (!layer->visible) continue;
    if (layer->kind == LayerKind::Cloud) points += layer->points();
    triangles += layer->triangles();
  }
  facts.emplace_back("points shown", fmt::format("{}", points));
  facts.emplace_back("triangles shown", fmt::format("{}", triangles));
  if (const double rate = canvas_->frames_per_s(); rate > 0) {
    facts.emplace_back("while moving", fmt::format("{:.0f} frames/s", rate));
  }
  const Look look = view().current_look();
  facts.emplace_back("eye", fmt::format("{:.1f}, {:.1f}, {:.1f} m", look.from_w_m.x,
                                        look.from_w_m.y, look.from_w_m.z));
  facts.emplace_back("looks at", fmt::format("{:.1f}, {:.1f}, {:.1f} m", look.at_w_m.x,
                                             look.at_w_m.y, look.at_w_m.z));
  status_->show_facts(facts);
}

void Window::fault(const std::string& message) {
  const QString text = QString::fromStdString(message);
  for (const QMessageBox* shown : findChildren<QMessageBox*>("fault")) {
    if (shown->text() == text && shown->isVisible()) return;
  }
  auto* box = new QMessageBox(QMessageBox::Warning, "groundray view", text, QMessageBox::Ok, this);
  box->setObjectName("fault");
  box->setAttribute(Qt::WA_DeleteOnClose);
  box->setTextFormat(Qt::PlainText);
  box->setTextInteractionFlags(Qt::TextSelectableByMouse);
  box->open();
}

bool Window::is_busy() const {
  return opening_.is_running() || !queue_.empty() || tracker_->is_busy() || playback_->is_busy() ||
         picker_->is_busy() || echoes_.is_running() || images_->is_busy() || scan_->is_scanning() ||
         compare_->is_comparing();
}

void Window::save_picture(const std::filesystem::path& path, glm::ivec2 size_px) {
  canvas_->doneCurrent();  // the picture needs another context, and a thread has one at a time
  write_png(path, view().picture(size_px));
  canvas_->draw();
}

}  // namespace groundray
