#pragma once

#include <QWidget>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/recorded/echo_pixels.h"
#include "apps/view/recorded/recorded_image.h"
#include "apps/view/window/job.h"

class QBoxLayout;
class QCheckBox;
class QComboBox;
class QLabel;
class QSlider;

namespace groundray {

class LegendStrip;
class PictureArea;
class Timeline;

/// Origin of an image: a frame of a dataset's camera, or a picture file.
struct ImageSource {
  std::string title;
  std::filesystem::path file;  ///< path; for a frame, without a suffix
  bool is_frame = false;
  RecordedNames names{};
  std::shared_ptr<const Timeline> timeline{};  ///< timeline of a frame's dataset; otherwise null
  std::size_t sensor = 0, frame = 0;           ///< indices of a frame in the timeline
};

/// Panel with a camera's image and all values recorded for each pixel.
class ImagePanel : public QWidget {
 public:
  /// Callbacks; any may be empty.
  struct Hooks {
    std::function<void(const std::string&)> camera_chosen{};
    std::function<void(glm::ivec2)> clicked{};  ///< a pixel of the displayed image
    /// Another image is shown, or the user switched echoes on or off.
    std::function<void()> echoes_wanted{};
    std::function<void(double)> exposed{};             ///< the exposure has changed, EV
    std::function<void(const std::string&)> failed{};  ///< error message
  };

  explicit ImagePanel(Hooks hooks, QWidget* parent = nullptr);

  /// Offers cameras; selects the first, if any, and calls camera_chosen.
  void set_cameras(const std::vector<std::string>& names);
  std::string camera() const;

  /// Reads an image in another thread, then shows it in the selected channel. Of several requests
  /// made meanwhile, only the last is carried out.
  void show_image(const ImageSource& source);
  /// Shows a text instead of an image, and abandons any reading under way.
  void clear(const QString& why = {});
  void mark(std::optional<glm::dvec2> pixel);
  /// Sets the exposure of light and pictures, rounded to 0.1 EV within -10 to 10 EV.
  void set_exposure(double exposure_ev);
  /// Returns true if echoes are to be shown over the displayed image.
  bool wants_echoes() const;
  /// Shows echoes over the image, coloured by their distance from the camera.
  void show_echoes(const std::vector<EchoPixel>& echoes);

  /// Returns the displayed image, or null.
  std::shared_ptr<const RecordedImage> image() const { return image_; }
  /// Returns the origin of the displayed image; std::nullopt if there is none.
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
  void build_exposure(QBoxLayout& row);
  void read(const ImageSource& source);
  void redraw();
  void start(std::function<Shown()> work);
  void take(Shown shown);
  void show_controls(const ImageChannel& channel);
  double exposure_ev() const;
  void show_nothing(const QString& why);
  void point_at(std::optional<glm::ivec2> pixel);

  Hooks hooks_;
  std::optional<ImageSource> source_, next_;  // being read or shown, and requested after that
  std::optional<ImageSource> shown_;          // origin of image_
  std::shared_ptr<const RecordedImage> image_;
  std::string channel_name_;  // requested by the user, whether or not the image has it
  bool is_filling_ = false;
  bool is_stale_ = false;  // the job under way draws another channel than requested
  QComboBox *camera_ = nullptr, *channel_ = nullptr;
  QLabel *title_ = nullptr, *values_ = nullptr, *exposure_text_ = nullptr;
  QWidget* exposed_ = nullptr;  // all widgets of the exposure
  QSlider* exposure_ = nullptr;
  QCheckBox* echoes_ = nullptr;
  PictureArea* area_ = nullptr;
  LegendStrip* legend_ = nullptr;
  Job job_;
};

}  // namespace groundray
