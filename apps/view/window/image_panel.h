#pragma once

#include <QWidget>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/recorded_image.h"
#include "apps/view/window/job.h"

class QComboBox;
class QLabel;

namespace groundray {

class LegendStrip;
class PictureArea;
class Timeline;

/// Where an image is: a frame of a dataset's camera, or a picture file.
struct ImageSource {
  std::string title;
  std::filesystem::path file;  ///< of a frame, without an ending
  bool is_frame = false;
  RecordedNames names{};
  std::shared_ptr<const Timeline> timeline{};  ///< of a frame: whose it is; else null
  std::size_t sensor = 0, frame = 0;           ///< of a frame: which of the timeline's
};

/// What a camera saw, with all that is known of each pixel.
class ImagePanel : public QWidget {
 public:
  /// What is called as it is used; any may be empty.
  struct Hooks {
    std::function<void(const std::string&)> camera_chosen{};
    std::function<void(glm::ivec2)> clicked{};         ///< a pixel of what is shown
    std::function<void(const std::string&)> failed{};  ///< with the fault's message
  };

  explicit ImagePanel(Hooks hooks, QWidget* parent = nullptr);

  /// Offers cameras; the first is chosen, and the hook told, if there is any.
  void set_cameras(const std::vector<std::string>& names);
  std::string camera() const;

  /// Reads an image, off the window's thread, and shows it when it is there, in the channel that is
  /// chosen. While one is read, of those asked for only the last is read after it.
  void show_image(const ImageSource& source);
  /// Shows nothing, and why; what is being read is not heard of again.
  void clear(const QString& why = {});
  void mark(std::optional<glm::dvec2> pixel);

  /// Returns what is shown, null for nothing.
  std::shared_ptr<const RecordedImage> image() const { return image_; }
  /// Returns where that is from, none if nothing is shown.
  const std::optional<ImageSource>& shown() const noexcept { return shown_; }
  PictureArea& area() noexcept { return *area_; }
  bool is_busy() const noexcept { return job_.is_running(); }

 private:
  struct Shown {
    ImageSource source;
    std::shared_ptr<const RecordedImage> image;
    std::size_t channel = 0;
    DrawnChannel drawn;
  };

  void build();
  void read(const ImageSource& source);
  void redraw();
  void start(std::function<Shown()> work);
  void take(Shown shown);
  void show_nothing(const QString& why);
  void point_at(std::optional<glm::ivec2> pixel);

  Hooks hooks_;
  std::optional<ImageSource> source_, next_;  // asked for last, and after that
  std::optional<ImageSource> shown_;          // image_ is from there
  std::shared_ptr<const RecordedImage> image_;
  std::string channel_name_;  // that is wanted, whichever the image has
  bool is_filling_ = false;
  bool is_stale_ = false;  // what is under way is not the channel that is wanted
  QComboBox *camera_ = nullptr, *channel_ = nullptr;
  QLabel *title_ = nullptr, *values_ = nullptr;
  PictureArea* area_ = nullptr;
  LegendStrip* legend_ = nullptr;
  Job job_;
};

}  // namespace groundray
