#pragma once

#include <QWidget>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/scan_here.h"
#include "apps/view/window/job.h"
#include "apps/view/window/playback.h"

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QProgressBar;
class QPushButton;

namespace groundray {

/// What a scan from a place on the ground gave.
struct ScanMade {
  Layer layer;
  ShownScan scan;
  std::vector<std::string> notes;
};

/// Puts a sensor down anywhere on the ground of a scene or a DEM, and scans from there.
class ScanPanel : public QWidget {
 public:
  struct Hooks {
    std::function<void()> take_place{};  ///< the next press in the view is to be a place
    std::function<void(Layer)> show{};   ///< where the sensor stands
    std::function<void(ScanMade)> scanned{};
    std::function<void(const std::string&)> failed{};
  };

  explicit ScanPanel(Hooks hooks, QWidget* parent = nullptr);

  /// The scene that is scanned; null for none.
  void set_world(std::shared_ptr<const World> world);
  /// A DEM that is scanned as bare ground; it is read when that is needed.
  void set_dem(const std::filesystem::path& dem);
  /// Asks for a place in the view, as soon as there is ground to be put on.
  void ask_for_place();
  /// Puts the sensor down at a place of W, looking towards another unless both are one.
  void put_down(const glm::dvec3& at_w_m, const glm::dvec3& towards_w_m);
  void scan();
  void cancel();
  bool is_scanning() const noexcept { return job_.is_running(); }
  bool has_place() const noexcept { return at_m_.has_value(); }
  /// Chooses a preset by name; nothing happens if there is none.
  void choose(const std::string& preset);

 private:
  void build();
  void lay_out();
  void connect_widgets();
  void take_ground(std::shared_ptr<const World> world, const std::filesystem::path& dem);
  void with_ground(std::function<void()> then);
  void put(const glm::dvec3& at_w_m, const glm::dvec3& towards_w_m);
  SensorPlace place() const;
  void show_place();
  void update_buttons();
  Job::Hooks hooks_of_job();

  Hooks hooks_;
  std::shared_ptr<const World> world_;     // null of a DEM that is not read yet
  std::filesystem::path dem_;              // empty of a scene
  std::shared_ptr<SceneScanner> scanner_;  // used by the job alone
  std::vector<SensorPreset> presets_;
  std::optional<glm::dvec2> at_m_;  // in D
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
