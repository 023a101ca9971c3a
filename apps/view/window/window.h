#pragma once

#include <QMainWindow>
#include <QTimer>
#include <chrono>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "apps/view/load_input.h"
#include "apps/view/recorded/timeline.h"
#include "apps/view/window/canvas.h"
#include "apps/view/window/document.h"
#include "apps/view/window/job.h"
#include "apps/view/window/panels/clip_panel.h"
#include "apps/view/window/panels/compare_panel.h"
#include "apps/view/window/panels/fact_table.h"
#include "apps/view/window/panels/image_panel.h"
#include "apps/view/window/panels/layer_panel.h"
#include "apps/view/window/panels/scan_panel.h"
#include "apps/view/window/panels/timeline_panel.h"
#include "apps/view/window/picker.h"
#include "apps/view/window/playback.h"
#include "apps/view/window/recent_files.h"
#include "apps/view/window/ruler.h"
#include "apps/view/window/run_window.h"
#include "apps/view/window/style.h"
#include "apps/view/window/terrain_tracker.h"

class QAction;
class QComboBox;
class QLabel;
class QMenu;
class QProgressBar;
class QPushButton;
class QToolBar;

namespace groundray {

/// Main window of the viewer. Long tasks run in other threads.
class Window : public QMainWindow {
 public:
  explicit Window(WindowStart start = {});
  ~Window() override;

  /// Opens an input after those requested before; errors are shown in a message box.
  void open(const std::filesystem::path& path);
  /// Cancels opening: stops the input in progress and discards those that wait.
  void cancel_opening();
  /// Closes all documents and layers.
  void close_all();
  /// Writes a picture of the view. @throws Error if it cannot be written.
  void save_picture(const std::filesystem::path& path, glm::ivec2 size_px);
  /// Shows an error message, unless the same one is on display.
  void fault(const std::string& message);
  /// Returns true if any task is running or waiting.
  bool is_busy() const;

  Canvas& canvas() noexcept { return *canvas_; }
  View& view() noexcept { return canvas_->view(); }
  LayerPanel& layer_panel() noexcept { return *layers_; }
  TimelinePanel& timeline_panel() noexcept { return *timeline_; }
  ImagePanel& image_panel() noexcept { return *images_; }
  ScanPanel& scan_panel() noexcept { return *scan_; }
  ComparePanel& compare_panel() noexcept { return *compare_; }
  ClipPanel& clip_panel() noexcept { return *clip_; }
  const FactTable& status() const noexcept { return *status_; }
  const FactTable& picked() const noexcept { return *picked_; }
  TerrainTracker& tracker() noexcept { return *tracker_; }

 protected:
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;

 private:
  struct Loaded {
    Opened opened;
    std::shared_ptr<const Timeline> timeline;
  };
  enum class Side { Left, RightAbove, Right, Bottom };

  // window.cpp
  void build_hint();
  void show_hint(const std::filesystem::path& opening);
  void build_docks();
  void build_status_bar();
  QWidget* build_status();
  QWidget* build_picked();
  QDockWidget* dock(const QString& title, QWidget* content, Side side);
  void connect_canvas();
  void build_workers();
  void changed();
  void show_status();

  // window_actions.cpp
  void build_actions();
  void build_file_actions(QMenu& menu, QToolBar& bar);
  void build_view_actions(QMenu& menu, QToolBar& bar);
  void build_tool_actions(QMenu& menu, QToolBar& bar);
  QAction* action(QMenu& menu, QToolBar* bar, const QString& text, const QKeySequence& keys,
                  std::optional<Icon> icon, std::function<void()> done);
  void ask_to_open();
  void ask_to_open_folder();
  void ask_for_picture();
  void ask_for_turntable();
  void fill_recent();
  void ask_for_origin_of_selected();
  void look_along(const glm::dvec3& direction, const glm::dvec3& up);
  void toggle_wireframe();
  void close_selected();
  void escape();

  // window_open.cpp
  void open_next();
  void take(Loaded loaded);
  std::string name_for(const std::filesystem::path& path) const;
  void name_layers(std::vector<Layer>& layers, const std::string& document);
  void apply_options(Layer& layer, const std::string& own_name);
  void report_unmatched();
  void first_look(const Opened& opened, const std::vector<std::string>& layers);
  void use(const Document& document);
  void play(const Document& document);
  void offer_ground();
  void hide_sensors_of_scenes();
  void show_hidden_sensors();
  void report_no_image(std::optional<std::chrono::nanoseconds> first);
  void show_images();
  void forget(const std::string& document);
  void remove_layer(const std::string& name);
  void offer_comparisons();
  void show_documents();

  // window_measures.cpp
  void build_clip_panel();
  void set_clip(const std::optional<ClipBox>& box);
  void measure(bool on);
  void measure_to(glm::ivec2 at_px);
  void show_measured();
  void update_echoes();

  // window_picking.cpp
  void show_legend_of(const std::string& layer);
  void click(glm::ivec2 at_px, Qt::KeyboardModifiers keys);
  void follow_eye();
  void put_viewpoint(const glm::dvec3& p_w_m);
  void take_place(glm::ivec2 at_px, glm::ivec2 towards_px);
  const ShownScan* scan_of(const std::string& layer) const;
  void go_to(std::chrono::nanoseconds time);
  void click_pixel(glm::ivec2 pixel);
  void mark_in_image(const EchoBeam& beam, const glm::dvec3& origin_w_m);
  void take_scan(FinishedScan made);
  void take_comparison(const Comparison& comparison, const Layer& measured);

  WindowStart start_;
  std::set<std::string> unmatched_;  // options of the program that no layer has satisfied yet
  std::vector<Document> documents_;
  std::vector<std::string> hidden_sensors_;  // sensors of scenes, hidden while a dataset is played
  std::map<std::string, ShownScan> scans_here_;  // scans by layer
  std::deque<std::filesystem::path> queue_;
  RecentFiles recent_;
  bool has_looked_ = false;
  std::optional<glm::dvec3> rode_from_w_m_;

  Canvas* canvas_ = nullptr;
  LayerPanel* layers_ = nullptr;
  FactTable *status_ = nullptr, *picked_ = nullptr;
  QLabel *picked_title_ = nullptr, *hint_ = nullptr, *message_ = nullptr;
  QComboBox* follows_ = nullptr;
  QProgressBar* busy_ = nullptr;
  QPushButton* cancel_ = nullptr;  // cancels opening
  QMenu* recent_menu_ = nullptr;
  TimelinePanel* timeline_ = nullptr;
  ImagePanel* images_ = nullptr;
  ScanPanel* scan_ = nullptr;
  ComparePanel* compare_ = nullptr;
  ClipPanel* clip_ = nullptr;
  QAction* measures_ = nullptr;             // checked while clicks measure
  std::map<QWidget*, QDockWidget*> docks_;  // docks by content
  QTimer status_clock_;
  std::unique_ptr<TerrainTracker> tracker_;
  std::unique_ptr<Playback> playback_;
  std::unique_ptr<Picker> picker_;
  std::unique_ptr<Ruler> ruler_;
  Job opening_, echoes_;
  bool are_echoes_stale_ = false;  // requested again while they were projected
};

}  // namespace groundray
