#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "apps/view/recorded_sensor.h"
#include "core/image.h"

namespace groundray {

/// Values of an image's pixels, of as many channels as it takes.
using PixelValues = std::variant<Image8, Image16, Image32, ImageF>;

/// Something that an image tells of each pixel.
struct ImageChannel {
  /// How it is drawn.
  enum class Kind {
    Light,       ///< linear, R G B or grey: as bright as suits the eye
    Picture,     ///< as it is stored
    Number,      ///< by a colour map; of three numbers the last one, a position's height
    Distance,    ///< by a colour map in equal steps of the logarithm, near is bright
    Vector,      ///< x y z as red, green and blue, 0 being grey
    Flow,        ///< u v: the direction as hue, the length as saturation
    Categories,  ///< a colour for each number, black for 0
  };
  std::string name;  ///< for people, unique in an image: "light", "depth", "normal", "label"
  std::string unit;  ///< "m"; empty for none
  Kind kind = Kind::Number;
  std::optional<double> full{};  ///< what has full colour, 0 having none; else that is looked up
  std::string file;              ///< name of the file that has it
  PixelValues values;            ///< as stored; of 16-bit pictures 0 to 1
};

/// What the colours of a picture mean.
struct ImageLegend {
  struct Category {
    std::uint32_t number = 0;
    std::string name;  ///< "4", or "4 tree, bush"
    glm::dvec3 colour{0};
    std::size_t pixels = 0;
  };
  /// Of numbers: what the ends of the colours stand for; of light: 0 and what is white; of vectors
  /// and flow: 0 and the length that has full colour.
  double low = 0, high = 1;
  std::string unit;
  bool is_logarithmic = false;       ///< steps between low and high are
  std::vector<glm::dvec3> colours;   ///< from low to high, of numbers alone
  std::vector<Category> categories;  ///< those that occur, most frequent first, 32 at most
};

/// A channel as it is shown.
struct DrawnChannel {
  Image8 picture;  ///< RGB
  ImageLegend legend;
};

/// A value under a pixel, for people.
struct PixelValue {
  std::string channel;
  std::string text;  ///< with its unit: "12.345 m", "4 (tree)", "unknown"
};

/// What was recorded of one image of a camera: all files of a frame. Immutable; any number of
/// threads may ask.
class RecordedImage {
 public:
  /// Reads all files of a frame: docs/formats.md lists them.
  /// @param stem  path of the frame without what its files' names end with.
  /// @throws Error naming the file, if one is damaged, there is none, or their sizes differ.
  RecordedImage(const std::filesystem::path& stem, const RecordedNames& names);

  /// Reads one file, whoever made it: PNG, JPEG, Radiance, OpenEXR or a raster as read_picture
  /// shows it. @throws Error likewise.
  explicit RecordedImage(const std::filesystem::path& file);

  glm::ivec2 size_px() const noexcept { return size_px_; }
  const std::vector<ImageChannel>& channels() const noexcept { return channels_; }
  /// Returns the number of the channel of a name; none if there is none.
  std::optional<std::size_t> find(const std::string& name) const;

  /// Draws a channel.
  /// @param range  what the ends of the colour map stand for; else what suits: of numbers the 1 %
  ///               and the 99 % quantile of those that are finite.
  DrawnChannel draw(std::size_t channel,
                    std::optional<std::pair<double, double>> range = std::nullopt) const;

  /// Returns the values of all channels under a pixel; none beside the image.
  std::vector<PixelValue> values_at(glm::ivec2 pixel) const;
  /// Returns the values of one channel under a pixel, as stored. @pre the pixel is in the image.
  std::vector<double> numbers_at(std::size_t channel, glm::ivec2 pixel) const;

  /// Returns how far what a pixel's centre sees is from the lens; infinite for sky, none if the
  /// image does not tell.
  std::optional<double> distance_m(glm::ivec2 pixel) const;
  /// Returns the depth along the optical axis, likewise.
  std::optional<double> depth_m(glm::ivec2 pixel) const;

 private:
  glm::ivec2 size_px_{0};
  std::vector<ImageChannel> channels_;
  RecordedNames names_;
};

/// Reads the channels of all files of a frame, those that people ask for most first.
/// @throws Error as RecordedImage.
std::vector<ImageChannel> read_frame_channels(const std::filesystem::path& stem);

/// Reads the channels of one picture. @throws Error as RecordedImage.
std::vector<ImageChannel> read_file_channels(const std::filesystem::path& file);

/// Draws a channel, as RecordedImage::draw.
DrawnChannel draw_channel(const ImageChannel& channel, const RecordedNames& names,
                          std::optional<std::pair<double, double>> range);

/// Returns what is known of a channel's number: the name of a label, an instance or a material;
/// empty for none.
std::string name_of(const ImageChannel& channel, std::uint32_t number, const RecordedNames& names);

/// Returns the value of a place in an image's values as a number.
double number_at(const PixelValues& values, glm::ivec2 pixel, int component);

/// Returns how many numbers a pixel has, and how large the image is.
int components_of(const PixelValues& values);
glm::ivec2 size_of(const PixelValues& values);

}  // namespace groundray
