#include "apps/golden/compare/images/image_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"
#include "core/io/memory.h"
#include "core/io/text_lines.h"

namespace groundray::golden {
namespace {

using Channels = std::vector<NamedChannel>;
using namespace std::string_view_literals;

constexpr std::string_view png_magic = "\x89PNG";
constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t most_pixels = 1 << 26, most_values = 1 << 29;

// Checks the memory of values in double, and of the comparison of one layer of three channels.
void check_values(const std::string& name, std::int64_t width, std::int64_t height,
                  std::size_t channels) {
  const double values =
      static_cast<double>(width * height) * static_cast<double>(std::max<std::size_t>(channels, 1));
  if (width * height > most_pixels || values > most_values) {
    throw Error(
        "{}: it has {} x {} pixels of {} channels; an image that is compared may have at most {} "
        "(8192 x 8192) and {} values: crop it or scale it down",
        name, width, height, channels, most_pixels, most_values);
  }
  constexpr double bytes_per_value = 2 * sizeof(double);  // interleaved and split into channels
  constexpr double bytes_per_pixel = 100;                 // measured: errors, sorted and drawn
  require_memory(name, "its values and errors",
                 bytes_per_value * values + bytes_per_pixel * static_cast<double>(width * height));
}

/// Splits an image with interleaved channels into single channels with these names.
template <typename T, typename Convert>
Channels split(const Image<T>& image, const std::vector<std::string>& names,
               const Convert& convert) {
  Channels channels;
  for (std::size_t k = 0; k < names.size(); ++k) {
    NamedChannel& to = channels.emplace_back(
        NamedChannel{names[k], Image<double>(image.width(), image.height(), 1)});
    const auto stride = static_cast<std::size_t>(image.channels());
    for (std::size_t i = 0; i < to.values.values().size(); ++i)
      to.values.values()[i] = convert(image.values()[i * stride + k]);
  }
  return channels;
}

template <typename T>
double as_it_is(T value) {
  return static_cast<double>(value);
}

std::vector<std::string> light_names(int channels) {
  if (channels < 3) return {"Y"};
  return {"R", "G", "B"};
}

Channels read_exr_channels(std::string_view bytes, const std::string& name) {
  const ExrFile file = parse_exr(bytes, name);
  check_values(name, file.display_size_px.x, file.display_size_px.y, file.channels.size());
  Channels channels;
  for (const ExrChannel& channel : file.channels) {
    NamedChannel& to = channels.emplace_back(NamedChannel{
        channel.name, Image<double>(file.display_size_px.x, file.display_size_px.y, 1)});
    std::ranges::fill(to.values.values(), nothing);
    std::visit(
        [&](const auto& image) {
          for (int y = 0; y < file.height; ++y) {
            for (int x = 0; x < file.width; ++x) {
              const glm::ivec2 at = file.corner_px + glm::ivec2(x, y);
              if (at.x < 0 || at.y < 0 || at.x >= to.values.width() || at.y >= to.values.height())
                continue;
              to.values.at(at.x, at.y)[0] = static_cast<double>(image.at(x, y)[0]);
            }
          }
        },
        channel.image);
  }
  return channels;
}

Channels depth_of(const PngNumbers& numbers, double step_m, const std::string& name) {
  if (!numbers.is_deep || numbers.values.channels() != 1) {
    throw Error("{}: depths must be one channel of 16 bits; it has {} of {}: is it a picture?",
                name, numbers.values.channels(), numbers.is_deep ? 16 : 8);
  }
  return split(numbers.values, {"Z"},
               [step_m](double value) { return value == 0 ? nothing : value * step_m; });
}

Channels kitti_flow_of(PngNumbers numbers, const std::string& name) {
  if (!numbers.is_deep || numbers.values.channels() != 3) {
    throw Error("{}: KITTI's flow must be three channels of 16 bits; it has {} of {}", name,
                numbers.values.channels(), numbers.is_deep ? 16 : 8);
  }
  const auto values = numbers.values.values();
  for (std::size_t i = 0; i + 2 < values.size(); i += 3) {
    if (values[i + 2] == 0) values[i] = values[i + 1] = nothing;
  }
  return split(numbers.values, {"FlowForward.u", "FlowForward.v"},
               [](double value) { return (value - 32768) / 64; });
}

Channels labels_of(const PngNumbers& numbers) {
  const Image<double>& from = numbers.values;
  Channels channels{{"Label", Image<double>(from.width(), from.height(), 1)}};
  const int colours = from.channels() < 3 ? 1 : 3;
  for (int y = 0; y < from.height(); ++y) {
    for (int x = 0; x < from.width(); ++x) {
      double label = 0;
      for (int k = 0; k < colours; ++k)
        label = label * 65536 + from.at(x, y)[static_cast<std::size_t>(k)];
      channels[0].values.at(x, y)[0] = label;
    }
  }
  return channels;
}

/// Returns the channels of a PNG or JPEG; a grey picture has three equal colours.
Channels read_png_channels(std::string_view bytes, const std::string& name, PngMeaning meaning) {
  const std::vector<std::string> picture_names{"Picture.R", "Picture.G", "Picture.B"};
  PngNumbers numbers = png_numbers(bytes, name);
  switch (meaning) {
    case PngMeaning::KittiDepth:
      return depth_of(numbers, 1.0 / 256, name);
    case PngMeaning::MillimetreDepth:
      return depth_of(numbers, 1e-3, name);
    case PngMeaning::KittiFlow:
      return kitti_flow_of(std::move(numbers), name);
    case PngMeaning::Label:
      return labels_of(numbers);
    case PngMeaning::Picture:
      break;
  }
  const double most = numbers.is_deep ? 65535 : 255;
  const auto share = [most](double value) { return value / most; };
  if (numbers.values.channels() >= 3) return split(numbers.values, picture_names, share);
  Channels grey = split(numbers.values, {picture_names[0]}, share);
  for (std::size_t k = 1; k < 3; ++k) grey.push_back({picture_names[k], grey[0].values});
  return grey;
}

/// Returns the floats that follow a file's header.
/// @throws Error unless `bytes` has exactly the expected size.
ImageF floats_after(std::string_view bytes, const std::string& name, std::int64_t width,
                    std::int64_t height, int channels, std::endian order) {
  if (width <= 0 || height <= 0 || width > most_pixels / height ||
      bytes.size() != static_cast<std::size_t>(width * height * channels) * sizeof(float)) {
    throw Error(
        "{}: it has {} bytes of pixels; {} x {} of {} x 4 bytes are expected: it is truncated or "
        "damaged",
        name, bytes.size(), width, height, channels);
  }
  ImageF image(static_cast<int>(width), static_cast<int>(height), channels);
  std::memcpy(image.values().data(), bytes.data(), bytes.size());
  if (order != std::endian::native) {
    for (float& value : image.values())
      value = std::bit_cast<float>(__builtin_bswap32(std::bit_cast<std::uint32_t>(value)));
  }
  return image;
}

Channels read_flo(std::string_view bytes, const std::string& name) {
  std::int32_t width = 0, height = 0;
  if (bytes.size() >= 12) {
    std::memcpy(&width, bytes.data() + 4, 4);
    std::memcpy(&height, bytes.data() + 8, 4);
  }
  bytes.remove_prefix(std::min<std::size_t>(12, bytes.size()));
  const ImageF image = floats_after(bytes, name, width, height, 2, std::endian::little);
  Channels channels = split(image, {"FlowForward.u", "FlowForward.v"}, [](float value) -> double {
    return std::abs(value) <= 1e9f ? value : nothing;  // larger values mark unknown flow
  });
  return channels;
}

Channels read_pfm(std::string_view bytes, const std::string& name) {
  TextLines lines(bytes);
  const int channels = lines.next() == "PF" ? 3 : 1;
  const auto size = words_of(lines.next().value_or(""sv));
  const auto scale_words = words_of(lines.next().value_or(""sv));
  const auto whole = [&](std::size_t i) {
    return number_of<int>(size.size() == 2 ? size[i] : ""sv).value_or(0);
  };
  const int width = whole(0), height = whole(1);
  const double scale =
      number_of<double>(scale_words.size() == 1 ? scale_words[0] : ""sv).value_or(0);
  if (width <= 0 || height <= 0 || scale == 0 || !std::isfinite(scale)) {
    throw Error("{}: its header must be PF or Pf, WIDTH HEIGHT, and a scale, each on its own line",
                name);
  }
  const ImageF upside_down = floats_after(lines.rest(), name, width, height, channels,
                                          scale > 0 ? std::endian::big : std::endian::little);
  ImageF image(width, height, channels);  // rows are stored bottom to top
  for (int y = 0; y < height; ++y) {
    const float* from = upside_down.at(0, height - 1 - y).data();
    std::copy_n(from, width * channels, image.at(0, y).data());
  }
  return split(image, channels == 1 ? std::vector<std::string>{"Z"} : light_names(3),
               as_it_is<float>);
}

Channels read_channels(const std::string& bytes, const std::string& name, PngMeaning png) {
  if (bytes.starts_with("\x76\x2f\x31\x01"sv)) return read_exr_channels(bytes, name);
  if (bytes.starts_with(png_magic)) return read_png_channels(bytes, name, png);
  if (bytes.starts_with("\xff\xd8"sv)) return read_png_channels(bytes, name, PngMeaning::Picture);
  if (bytes.starts_with("PIEH"sv)) return read_flo(bytes, name);
  if (bytes.starts_with("PF\n"sv) || bytes.starts_with("Pf\n"sv)) return read_pfm(bytes, name);
  if (bytes.starts_with("#?"sv)) {
    const ImageF image = parse_image_f(bytes, name, PictureOf::Light, most_pixels);
    check_values(name, image.width(), image.height(), 3);
    return split(image, light_names(image.channels()), as_it_is<float>);
  }
  throw Error(
      "{}: it is not an image that can be compared{}: supported are OpenEXR (.exr), Radiance "
      "(.hdr), PNG, JPEG, .flo and .pfm",
      name, bytes.empty() ? ", but an empty file" : "; convert it");
}

void rename(Channels& channels, const ImageReading& reading, const std::string& file) {
  for (const auto& [from, to] : reading.names) {
    const auto found = std::ranges::find(channels, from, &NamedChannel::name);
    if (found == channels.end()) {
      std::vector<std::string> there;
      for (const NamedChannel& channel : channels) there.push_back(channel.name);
      throw Error("{}: it has no channel '{}'; it has {}", file, from, fmt::join(there, ", "));
    }
    found->name = to;
  }
}

}  // namespace

PngNumbers png_numbers(std::string_view bytes, const std::string& name) {
  constexpr std::size_t depth_at = 24;  // after the signature and IHDR's length, name and size
  PngNumbers numbers;
  numbers.is_deep =
      bytes.starts_with(png_magic) && bytes.size() > depth_at && bytes[depth_at] == 16;
  const auto copy = [&](const auto& image, double scale) {
    // Grey becomes three equal channels.
    check_values(name, image.width(), image.height(),
                 static_cast<std::size_t>(std::max(image.channels(), 3)));
    numbers.values = {image.width(), image.height(), image.channels()};
    std::ranges::transform(image.values(), numbers.values.values().begin(),
                           [scale](auto value) { return std::round(scale * value); });
  };
  if (numbers.is_deep) {
    copy(parse_heights(bytes, name, most_pixels), 65535);
  } else {
    copy(parse_image8(bytes, name, most_pixels), 1);
  }
  return numbers;
}

const ImageLayer* ImageFile::find(std::string_view name) const {
  const auto found = std::ranges::find(layers, name, &ImageLayer::name);
  return found == layers.end() ? nullptr : &*found;
}

ImageFile read_image_file(const std::filesystem::path& path, const ImageReading& reading) {
  const std::string bytes = read_text(path), name = path.string();
  Channels channels = read_channels(bytes, name, reading.png);
  rename(channels, reading, name);
  ImageFile file{.size_px = {channels.front().values.width(), channels.front().values.height()},
                 .layers = {}};
  file.layers = layers_of(std::move(channels));
  if (bytes.starts_with(png_magic)) return file;
  for (ImageLayer& layer : file.layers) {
    if (layer.kind != LayerKind::Depth) continue;
    for (double& value : layer.values.values()) value *= reading.depth_unit_m;
  }
  return file;
}

}  // namespace groundray::golden
