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
#include "apps/scene/world.h"
#include "apps/view/timeline.h"
#include "apps/view/view.h"
#include "apps/view/window/image_panel.h"
#include "apps/view/window/job.h"
#include "core/point_cloud.h"

namespace groundray {

/// A scan that is shown: what tells of its echoes besides the layer.
struct ShownScan {
  std::shared_ptr<const RecordedSensor> sensor;
  RecordedFrame frame;
  std::shared_ptr<const PointCloud> cloud;  ///< null: to be read from the frame's file
  RecordedNames names;
  glm::dvec3 origin_w_m{0};  ///< of D
};

/// A dataset that is played.
struct Recording {
  std::shared_ptr<const RecordedDataset> dataset;  ///< null: a scene, which has no scans
  std::shared_ptr<const Timeline> timeline;
  std::string prefix;  ///< of its layers' names
};

/// Brings the view to a time of a dataset: the scans that are current then, where the sensors are
/// and have been, and what moves. Reads off the window's thread; of times asked for meanwhile, only
/// the last is gone to.
class Playback {
 public:
  struct Hooks {
    std::function<void()> changed{};                  ///< the view holds something else
    std::function<void(const ImageSource&)> image{};  ///< the chosen camera's, at the time
    /// It has none yet, but will from a time on, if it has any.
    std::function<void(std::optional<std::chrono::nanoseconds>)> no_image{};
    std::function<void(const std::string&)> failed{};
  };

  /// @param view  is to outlive this.
  Playback(View& view, Hooks hooks);

  void open(Recording recording);
  void close();
  bool is_open() const noexcept { return recording_.timeline != nullptr; }
  const Recording& recording() const noexcept { return recording_; }
  /// What moves comes of a scene: a dataset does not say where it was. Null for none.
  /// @param prefix  of the names of the scene's layers.
  void set_world(std::shared_ptr<const World> world, const std::string& prefix);

  void go_to(std::chrono::nanoseconds time);
  void set_trail(bool on);
  void set_camera(const std::string& name);

  /// Shows a layer no more, whatever the time.
  void keep_away(const std::string& layer);
  /// Shows those again whose names begin with something.
  void show_again(const std::string& prefix);

  /// Returns what is known of a scan layer, null if it is none of the dataset's.
  const ShownScan* scan(const std::string& layer) const;
  /// Returns the chosen camera's frame at the time, as its sensor's and its number among the
  /// frames; what is shown may be another for a while.
  std::optional<std::pair<std::size_t, std::size_t>> camera_frame() const;
  /// Returns where the platform is at the time, in W: its first sensor.
  std::optional<glm::dvec3> platform_w_m() const;
  bool is_busy() const noexcept { return job_.is_running(); }

 private:
  struct Request {
    Recording recording;
    std::shared_ptr<const World> world;
    std::string world_prefix;
    std::map<std::size_t, std::size_t> frames;  // by sensor: which is shown already
    std::chrono::nanoseconds time{0};
    bool has_trail = true;
  };
  struct Step {
    std::vector<Layer> layers;
    std::map<std::string, ShownScan> scans;
    std::map<std::size_t, std::size_t> frames;  // by sensor: which is shown
  };

  static Step step_to(const Request& asked);
  void begin_step();
  void take(Step step);
  void show_image();
  std::optional<std::chrono::nanoseconds> first_image() const;

  View& view_;
  Hooks hooks_;
  Recording recording_;
  std::shared_ptr<const World> world_;
  std::string world_prefix_;
  std::chrono::nanoseconds time_{0};
  bool has_trail_ = true;
  bool is_stale_ = false;  // what is under way is not the time that is wanted
  std::string camera_;
  std::set<std::string> kept_away_;
  std::map<std::string, ShownScan> scans_;
  std::map<std::size_t, std::size_t> frames_;
  Job job_;
};

}  // namespace groundray
