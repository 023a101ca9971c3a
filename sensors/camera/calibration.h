#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/pose.h"
#include "sensors/camera/lens_models.h"

// The files in which calibrations of cameras are kept. What each format can say, and in which order
// it has its coefficients, is in docs/camera_lens.md.
namespace groundray {

/// How images of a stereo pair are rectified: to pinholes of one orientation, side by side.
struct Rectification {
  glm::dquat R_RC{1, 0, 0, 0};  ///< from the axes of the camera to those of the rectified one
  PixelScale scale;             ///< of the rectified image
  double offset_m = 0;          ///< of this camera from the left one, along x: 0, or the baseline
};

/// One camera as a file has it. Pixel centres have integer coordinates, whatever the file's.
struct CameraCalibration {
  std::string
      name;  ///< camera_name of ROS, cam0... of Kalibr, the number of COLMAP, else camera...
  LensModel model;
  glm::ivec2 size_px{0};     ///< of the image; 0 if the file does not say
  std::optional<Pose> X_IC;  ///< of the camera in the frame of the IMU
  std::optional<Pose> X_FC;  ///< of the camera in that of the first camera of the file
  double time_shift_s = 0;   ///< a stamp of the camera plus this is one of the IMU
  /// Written to ROS' files, and never read: without it they say that the image is not rectified.
  std::optional<Rectification> rectification;
};

/// The formats of calibration files.
enum class CalibrationFormat { RosYaml, OpenCvYaml, OpenCvXml, KalibrYaml, ColmapText, BasaltJson };

/// Reads the cameras of a file in any of the formats, which its content tells.
/// @throws Error with path, line, column, key, rule and likely fix for every fault of the file;
///         models that are none of LensModel are faults.
std::vector<CameraCalibration> load_camera_calibrations(const std::filesystem::path& path);

/// As load_camera_calibrations, of a text already in memory; `path` stands for the file in
/// messages.
std::vector<CameraCalibration> parse_camera_calibrations(std::string_view text,
                                                         const std::filesystem::path& path);

/// Returns the text of a file with these cameras, from which reading gives them back: lenses of no
/// distortion as a Pinhole, numbers to the last bit, poses to rounding. Names stay where the format
/// has them.
/// @throws Error for every camera and what of it the format cannot say: a model, a skew,
///         coefficients beyond its own, poses, time shifts, a second camera; or a size that is
///         missing.
std::string camera_calibrations_text(std::span<const CameraCalibration> cameras,
                                     CalibrationFormat format);

/// Writes that text as a whole file. @throws Error as camera_calibrations_text and write_text.
void write_camera_calibrations(const std::filesystem::path& path,
                               std::span<const CameraCalibration> cameras,
                               CalibrationFormat format);

}  // namespace groundray
