#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "apps/dataset/dataset_reader.h"
#include "apps/scene/simulation.h"
#include "apps/view/recorded/timeline.h"
#include "apps/view/rendering/view.h"
#include "apps/view/window/job.h"
#include "apps/view/window/panels/image_panel.h"
#include "core/io/point_cloud.h"

namespace groundray {

/// Displayed scan with the data of its echoes that the layer lacks.
struct ShownScan {
  std::shared_ptr<const RecordedSensor> sensor;
  RecordedFrame frame;
  std::shared_ptr<const PointCloud> cloud;  ///< null: read from the frame's file when needed
  RecordedNames names;
  glm::dvec3 origin_w_m{0};  ///< origin of D, in W
};

/// Dataset or scene that is played.
struct Recording {
  std::shared_ptr<const RecordedDataset> dataset;  ///< null for a scene, which has no scans
  std::shared_ptr<const Timeline> timeline;
  std::string prefix;  ///< prefix of its layers' names
};

/// Brings the view to a time of a dataset: the current scans, the sensors and their trail, and
/// moving objects. Reads in another thread; of several requests made meanwhile, only the last is
/// carried out.
class Playback {
 public:
  struct Hooks {
    std::function<void()> changed{};                  ///< the layers of the view have changed
    std::function<void(const ImageSource&)> image{};  ///< current image of the selected camera
    /// Called if the camera has no image yet, with the time of its first one, if there is any.
    std::function<void(std::optional<std::chrono::nanoseconds>)> no_image{};
    std::function<void(const std::string&)> failed{};
  };

  /// @param view  must outlive this.
  Playback(View& view, Hooks hooks);

  void open(Recording recording);
  void close();
  bool is_open() const noexcept { return recording_.timeline != nullptr; }
  const Recording& recording() const noexcept { return recording_; }
  /// Sets the scene that defines the moving objects, which datasets do not record; null for none.
  /// @param prefix  of the names of the scene's layers.
  void set_world(std::shared_ptr<const Simulation> simulation, const std::string& prefix);

  void go_to(std::chrono::nanoseconds time);
  void set_trail(bool on);
  void set_camera(const std::string& name);

  /// Hides a layer permanently, whatever the time.
  void exclude(const std::string& layer);
  /// Reverts exclude() for layers whose names begin with `prefix`.
  void include_again(const std::string& prefix);

  /// Returns the scan of a layer; null if it is not a scan of the dataset.
  const ShownScan* scan(const std::string& layer) const;
  /// Returns the indices of the selected camera and its current frame on the timeline. The
  /// displayed image may lag behind.
  std::optional<std::pair<std::size_t, std::size_t>> camera_frame() const;
  /// Returns the current position of the platform (its first sensor) in W.
  std::optional<glm::dvec3> platform_w_m() const;
  bool is_busy() const noexcept { return job_.is_running(); }

 private:
  struct Request {
    Recording recording;
    std::shared_ptr<const Simulation> simulation;
    std::string world_prefix;
    std::map<std::size_t, std::size_t> frames;  // index of the frame already shown, by sensor
    std::chrono::nanoseconds time{0};
    bool has_trail = true;
  };
  struct Step {
    std::vector<Layer> layers;
    std::map<std::string, ShownScan> scans;
    std::map<std::size_t, std::size_t> frames;  // index of the frame shown, by sensor
  };

  static Step step_to(const Request& request);
  void begin_step();
  void take(Step step);
  void show_image();
  std::optional<std::chrono::nanoseconds> first_image() const;

  View& view_;
  Hooks hooks_;
  Recording recording_;
  std::shared_ptr<const Simulation> simulation_;
  std::string world_prefix_;
  std::chrono::nanoseconds time_{0};
  bool has_trail_ = true;
  bool is_stale_ = false;  // the job under way is for another time than requested
  std::string camera_;
  std::set<std::string> excluded_;
  std::map<std::string, ShownScan> scans_;
  std::map<std::size_t, std::size_t> frames_;
  Job job_;
};

}  // namespace groundray
