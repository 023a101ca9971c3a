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

#include "apps/view/recorded/recorded_sensor.h"
#include "core/image/image.h"

namespace groundray {

/// Pixel values of an image with any number of channels.
using PixelValues = std::variant<Image8, Image16, Image32, ImageF>;

/// Quantity recorded for each pixel.
struct ImageChannel {
  /// Method of drawing.
  enum class Kind {
    Light,       ///< linear light, RGB or grey, exposed automatically
    AsStored,    ///< picture, drawn as stored
    Number,      ///< colour map; the last of three components, which is a position's height
    Distance,    ///< colour map on a logarithmic scale; near is bright
    Vector,      ///< x, y, z as red, green and blue; 0 is grey
    Flow,        ///< u, v: direction as hue, length as saturation
    Categories,  ///< a colour for each number, black for 0
  };
  std::string name;  ///< name for display, unique in an image: "light", "depth", "normal", "label"
  std::string unit;  ///< "m"; empty for none
  Kind kind = Kind::Number;
  /// Value of full colour, with no colour at 0; otherwise chosen from the data.
  std::optional<double> full{};
  std::string file;    ///< name of the file that has it
  PixelValues values;  ///< stored values; 16-bit pictures range from 0 to 1, except for raw values
};

/// Legend of a drawn channel.
struct ImageLegend {
  struct Category {
    std::uint32_t number = 0;
    std::string name;  ///< "4", or "4 tree, bush"
    glm::dvec3 colour{0};
    std::size_t pixels = 0;
  };
  /// Number, Distance: values at the ends of the colours. Light: 0 and the white level. Vector,
  /// Flow: 0 and the length of full colour.
  double low = 0, high = 1;
  std::string unit;
  bool is_logarithmic = false;       ///< true for logarithmic steps from low to high
  std::vector<glm::dvec3> colours;   ///< colours from low to high; Number and Distance only
  std::vector<Category> categories;  ///< categories that occur, most frequent first, 32 at most
};

/// Channel as drawn.
struct DrawnChannel {
  Image8 picture;  ///< RGB
  ImageLegend legend;
};

/// Value of a channel at a pixel, as text.
struct PixelValue {
  std::string channel;
  std::string text;  ///< value with unit or name: "12.345 m", "4 (tree)", "unknown"
};

/// Recorded image of a camera: all files of a frame, or a single picture. Immutable: any number of
/// threads may use one.
class RecordedImage {
 public:
  /// Reads all files of a frame, as listed in docs/reference/formats.md.
  /// @param stem  path of the frame's files without their suffixes.
  /// @throws Error naming the file, if one is damaged, there is none, or their sizes differ.
  RecordedImage(const std::filesystem::path& stem, const RecordedNames& names);

  /// Reads a single file of any origin: PNG, JPEG, Radiance, OpenEXR, .flo, or a raster as
  /// read_picture() shows it.
  /// @throws Error as above.
  explicit RecordedImage(const std::filesystem::path& file);

  glm::ivec2 size_px() const noexcept { return size_px_; }
  const std::vector<ImageChannel>& channels() const noexcept { return channels_; }
  /// Returns the index of the channel of that name, if there is one.
  std::optional<std::size_t> find(const std::string& name) const;

  /// Draws a channel.
  /// @param range  values at the ends of the colour map; by default chosen from the data: for
  ///               numbers, the 1 % and 99 % quantiles of the finite values.
  /// @param exposure_ev  for light and pictures: brightens by this power of 2, in linear light.
  /// @throws Error if the range is empty.
  DrawnChannel draw(std::size_t channel,
                    std::optional<std::pair<double, double>> range = std::nullopt,
                    double exposure_ev = 0) const;

  /// Returns the values of all channels at a pixel; empty outside the image.
  std::vector<PixelValue> values_at(glm::ivec2 pixel) const;
  /// Returns the values of one channel at a pixel, as stored. @pre The pixel is in the image.
  std::vector<double> numbers_at(std::size_t channel, glm::ivec2 pixel) const;

  /// Returns the distance from the lens to the point that the pixel's centre sees; infinite for
  /// sky, std::nullopt if it was not recorded.
  std::optional<double> distance_m(glm::ivec2 pixel) const;
  /// Returns the depth along the optical axis, with the same special values.
  std::optional<double> depth_m(glm::ivec2 pixel) const;

 private:
  glm::ivec2 size_px_{0};
  std::vector<ImageChannel> channels_;
  RecordedNames names_;
};

/// Reads the channels of all files of a frame, the most commonly viewed ones first.
/// @throws Error as RecordedImage.
std::vector<ImageChannel> read_frame_channels(const std::filesystem::path& stem);

/// Reads the channels of one picture. @throws Error as RecordedImage.
std::vector<ImageChannel> read_file_channels(const std::filesystem::path& file);

/// Draws a channel, as RecordedImage::draw.
DrawnChannel draw_channel(const ImageChannel& channel, const RecordedNames& names,
                          std::optional<std::pair<double, double>> range, double exposure_ev);

/// Returns the exposure at which 1 % of a picture's values exceed white: 0 for channels of light,
/// which are exposed so anyway, for those of other kinds, and for black pictures.
double automatic_exposure_ev(const ImageChannel& channel);

/// Returns the name of a channel's number: a label, an instance or a material; empty if it has
/// none.
std::string name_of(const ImageChannel& channel, std::uint32_t number, const RecordedNames& names);

/// Returns one component of a pixel as a double.
double number_at(const PixelValues& values, glm::ivec2 pixel, int component);

/// Returns the number of components per pixel.
int components_of(const PixelValues& values);
/// Returns the width and height, px.
glm::ivec2 size_of(const PixelValues& values);

}  // namespace groundray
