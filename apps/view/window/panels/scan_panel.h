#pragma once

#include <QWidget>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/virtual_scan.h"
#include "apps/view/window/job.h"
#include "apps/view/window/playback.h"

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QProgressBar;
class QPushButton;

namespace groundray {

/// Result of a scan from a position on the ground.
struct FinishedScan {
  Layer layer;
  ShownScan scan;
  std::vector<std::string> notes;
};

/// Panel that places a lidar on the ground of a scene or DEM, and scans from there.
class ScanPanel : public QWidget {
 public:
  struct Hooks {
    std::function<void()> take_place{};  ///< requests a position by the next press in the view
    std::function<void(Layer)> show{};   ///< marker of the sensor's pose
    std::function<void(FinishedScan)> scanned{};
    std::function<void(const std::string&)> failed{};
  };

  explicit ScanPanel(Hooks hooks, QWidget* parent = nullptr);

  /// Sets the scene to scan; null for none.
  void set_world(std::shared_ptr<const Simulation> simulation);
  /// Sets a DEM to scan as bare ground; it is read on first use.
  void set_dem(const std::filesystem::path& dem);
  /// Requests a position in the view as soon as the ground is loaded.
  void ask_for_place();
  /// Places the sensor at a position of W, heading towards another one unless both are equal.
  void place_at(const glm::dvec3& at_w_m, const glm::dvec3& towards_w_m);
  void scan();
  void cancel();
  bool is_scanning() const noexcept { return job_.is_running(); }
  bool has_place() const noexcept { return at_m_.has_value(); }
  /// Selects a preset by name; an unknown name has no effect.
  void choose(const std::string& preset);

 private:
  void build();
  void connect_widgets();
  void take_ground(std::shared_ptr<const Simulation> simulation, const std::filesystem::path& dem);
  void with_ground(std::function<void()> then);
  void put(const glm::dvec3& at_w_m, const glm::dvec3& towards_w_m);
  SensorPlace place() const;
  void show_place();
  void update_buttons();
  Job::Hooks hooks_of_job();

  Hooks hooks_;
  std::shared_ptr<const Simulation> simulation_;  // null until a DEM is read
  std::filesystem::path dem_;                     // empty for a scene
  std::shared_ptr<SceneScanner> scanner_;         // used by the job only
  std::vector<SensorPreset> presets_;
  std::optional<glm::dvec2> at_m_;  // position in D
  int scans_ = 0;
  QComboBox* preset_ = nullptr;
  QDoubleSpinBox *height_ = nullptr, *heading_ = nullptr;
  QCheckBox* tilt_ = nullptr;
  QPushButton *place_ = nullptr, *scan_ = nullptr, *cancel_ = nullptr;
  QProgressBar* progress_ = nullptr;
  QLabel *where_ = nullptr, *status_ = nullptr;
  Job job_;
};

}  // namespace groundray
