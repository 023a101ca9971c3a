#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/pose.h"
#include "sensors/camera/lens/lens_models.h"

// Camera calibration files. docs/theory/camera_lens.md lists what each format can represent, and
// the order of its coefficients.
namespace groundray {

/// Rectification of one camera of a stereo pair: both become pinholes of one orientation, side by
/// side.
struct Rectification {
  glm::dquat R_RC{1, 0, 0, 0};  ///< rotation from the camera's axes to those of the rectified one
  PixelScale scale;             ///< focal lengths and centre of the rectified image
  double offset_m = 0;          ///< x of this camera relative to the left one: 0, or the baseline
};

/// Camera of a calibration file. Pixel centres have integer coordinates, whatever the file's
/// convention.
struct CameraCalibration {
  /// Name: `camera_name` (ROS), `cam0`... (Kalibr, basalt), number (COLMAP), or `camera`,
  /// `camera1`, `camera2` (OpenCV).
  std::string name;
  LensModel model;
  glm::ivec2 size_px{0};     ///< size of the image; 0 if the file does not state it
  std::optional<Pose> X_IC;  ///< pose of the camera in the IMU's frame
  std::optional<Pose> X_FC;  ///< pose of the camera in the frame of the file's first camera
  double time_shift_s = 0;   ///< stamp of the IMU minus stamp of the camera
  /// Written to ROS files and never read; without it, they state that the image is not rectified.
  std::optional<Rectification> rectification;
};

/// Formats of calibration files.
enum class CalibrationFormat { RosYaml, OpenCvYaml, OpenCvXml, KalibrYaml, ColmapText, BasaltJson };

/// Reads the cameras of a file; the format is detected from the content.
/// @throws Error with path, line, column, key, rule and likely fix for every fault of the file,
///         including models that LensModel does not have.
std::vector<CameraCalibration> load_camera_calibrations(const std::filesystem::path& path);

/// Parses a text already in memory like load_camera_calibrations; `path` names the file in
/// messages.
std::vector<CameraCalibration> parse_camera_calibrations(std::string_view text,
                                                         const std::filesystem::path& path);

/// Returns the text of a file with these cameras. Reading it restores numbers to the last bit and
/// poses to rounding; a BrownConrady lens without distortion becomes a Pinhole. Names are kept
/// where the format has them.
/// @throws Error listing, for every camera, properties that the format cannot represent (model,
///         skew, coefficients, poses, time shift, rectification), and those that it needs and that
///         are missing: the size; X_IC for basalt; for Kalibr, X_FC of all cameras or none, with
///         the identity for the first. Also if there is no camera, or more than the format holds.
std::string camera_calibrations_text(std::span<const CameraCalibration> cameras,
                                     CalibrationFormat format);

}  // namespace groundray
