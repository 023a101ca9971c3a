#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/vec3.hpp>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image_errors.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

using namespace std::string_view_literals;

/// Header of a Radiance picture.
struct HdrHeader {
  int width = 0, height = 0;
  glm::dvec3 exposure{1};  ///< factors by which light was multiplied, for each channel
};

/// Parses the header and removes it from the front of `bytes`.
HdrHeader take_hdr_header(std::string_view& bytes, const std::string& name) {
  HdrHeader header;
  TextLines lines(bytes);
  for (auto line = lines.next(); line && !line->empty(); line = lines.next()) {
    const std::size_t sign = line->find('=');
    const std::string_view key = line->substr(0, sign);
    const std::string_view value = sign < line->size() ? line->substr(sign + 1) : ""sv;
    if (key == "FORMAT" && words_of(value) != std::vector{"32-bit_rle_rgbe"sv}) {
      throw Error("{}: FORMAT = {:?} must be 32-bit_rle_rgbe: convert the image to RGB", name,
                  value.substr(0, 40));
    }
    if (key != "EXPOSURE" && key != "COLORCORR") continue;
    const auto words = words_of(value);
    if (words.size() != (key == "EXPOSURE" ? 1 : 3)) {
      throw_damaged(name, "Radiance", fmt::format("{} = {:?}", key, value.substr(0, 40)));
    }
    for (glm::length_t i = 0; i < 3; ++i) {
      const auto factor = number_of<double>(words[static_cast<std::size_t>(i) % words.size()]);
      if (!factor || !(*factor > 0) || !std::isfinite(*factor)) {
        throw Error("{}: {} = {:?} must be positive", name, key, value.substr(0, 40));
      }
      header.exposure[i] *= *factor;
    }
  }
  const auto line = lines.next().value_or(""sv);
  const auto words = words_of(line);
  const auto height = words.size() == 4 ? number_of<int>(words[1]) : std::nullopt;
  const auto width = words.size() == 4 ? number_of<int>(words[3]) : std::nullopt;
  if (!height || !width || words[0] != "-Y" || words[2] != "+X") {
    throw Error("{}: its size line {:?} must be -Y HEIGHT +X WIDTH, rows from the top", name,
                line.substr(0, 40));
  }
  check_size(name, *width, *height);
  header.width = *width;
  header.height = *height;
  bytes = lines.rest();
  return header;
}

using Rgbe = std::array<std::uint8_t, 4>;

/// Decodes rows of shared-exponent pixels in all three encodings: plain, with repeated pixels, and
/// with runs for each byte of the pixels.
class HdrRows {
 public:
  HdrRows(std::string_view bytes, const std::string& name) : rest_(bytes), name_(name) {}

  void read(std::vector<Rgbe>& row) {
    const std::size_t width = row.size();
    const bool has_runs = width >= 8 && width < 32768 && rest_.size() >= 4 &&
                          rest_.starts_with("\x02\x02"sv) && (rest_[2] & 0x80) == 0;
    if (!has_runs) return read_pixels(row);
    rest_.remove_prefix(2);
    const std::size_t high = take(), low = take();
    if ((high << 8 | low) != width) fail("a row of wrong length");
    for (std::size_t channel = 0; channel < 4; ++channel) read_runs(row, channel);
  }

 private:
  [[noreturn]] void fail(std::string_view fault) const { throw_damaged(name_, "Radiance", fault); }

  std::uint8_t take() {
    if (rest_.empty()) fail("unexpected end of file");
    const auto byte = static_cast<std::uint8_t>(rest_.front());
    rest_.remove_prefix(1);
    return byte;
  }

  void read_runs(std::vector<Rgbe>& row, std::size_t channel) {
    for (std::size_t x = 0; x < row.size();) {
      const std::uint8_t count = take();
      const bool repeats = count > 128;
      const std::size_t length = repeats ? count - 128u : count;
      if (length == 0 || length > row.size() - x) fail("a run beyond the end of its row");
      std::uint8_t value = 0;
      for (std::size_t i = 0; i < length; ++i) {
        if (i == 0 || !repeats) value = take();
        row[x++][channel] = value;
      }
    }
  }

  void read_pixels(std::vector<Rgbe>& row) {
    int shift = 0;  // consecutive repeat counts are the digits of one number in base 256
    for (std::size_t x = 0; x < row.size();) {
      Rgbe pixel{};
      for (std::uint8_t& byte : pixel) byte = take();
      if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
        row[x++] = pixel;
        shift = 0;
        continue;
      }
      const std::size_t count = std::size_t{pixel[3]} << shift;
      if (x == 0 || count > row.size() - x || shift > 16) fail("a run beyond the end of its row");
      const Rgbe previous = row[x - 1];
      std::fill_n(row.begin() + static_cast<std::ptrdiff_t>(x), count, previous);
      x += count;
      shift += 8;
    }
  }

  std::string_view rest_;
  const std::string& name_;
};

ImageF parse_hdr_picture(std::string_view bytes, const std::string& name) {
  const HdrHeader header = take_hdr_header(bytes, name);
  ImageF image(header.width, header.height, 3);
  std::vector<Rgbe> row(static_cast<std::size_t>(header.width));
  HdrRows rows(bytes, name);
  for (int y = 0; y < header.height; ++y) {
    rows.read(row);
    float* value = image.at(0, y).data();
    for (const Rgbe& pixel : row) {
      // The mantissa's 8 bits count from 2^-8, the exponent from -128; exponent 0 is black.
      const double unit = pixel[3] == 0 ? 0 : std::ldexp(1.0, pixel[3] - 136);
      for (std::size_t i = 0; i < 3; ++i) {
        const double exposure = header.exposure[static_cast<glm::length_t>(i)];
        *value++ = static_cast<float>(pixel[i] * unit / exposure);
      }
    }
  }
  return image;
}

class MemoryIStream : public Imf::IStream {
 public:
  MemoryIStream(std::string_view bytes, const std::string& name)
      : IStream(name.c_str()), bytes_(bytes) {}
  bool read(char to[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (position_ > bytes_.size() || size > bytes_.size() - position_) {
      throw std::runtime_error("unexpected end of file");
    }
    std::memcpy(to, bytes_.data() + position_, size);
    position_ += size;
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  std::string_view bytes_;
  std::uint64_t position_ = 0;
};

/// Returns the names of the channels to read, in order.
std::vector<std::string> color_channels(const Imf::ChannelList& channels, const std::string& name) {
  std::vector<std::string> there;
  bool subsampled = false;
  for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
    there.emplace_back(channel.name());
    subsampled |= channel.channel().xSampling != 1 || channel.channel().ySampling != 1;
  }
  const auto has = [&](const char* channel) { return channels.findChannel(channel) != nullptr; };
  std::vector<std::string> wanted;
  if (has("R") && has("G") && has("B")) {
    wanted = {"R", "G", "B"};
  } else if (has("Y")) {
    wanted = {"Y"};
  }
  if (wanted.empty() || subsampled) {
    throw Error("{}: its channels are {}{}; it must have R, G and B, or Y, at full resolution",
                name, fmt::join(there, ", "), subsampled ? ", some of them subsampled" : "");
  }
  if (has("A")) wanted.emplace_back("A");
  return wanted;
}

ImageF decode_exr(std::string_view bytes, const std::string& name) {
  MemoryIStream stream(bytes, name);
  Imf::InputFile file(stream);
  const Imath::Box2i data = file.header().dataWindow();
  if (data != file.header().displayWindow()) {
    throw Error("{}: its data window is not its display window: save the uncropped image", name);
  }
  const std::int64_t width = std::int64_t{data.max.x} - data.min.x + 1;
  const std::int64_t height = std::int64_t{data.max.y} - data.min.y + 1;
  check_size(name, width, height);
  const std::vector<std::string> channels = color_channels(file.header().channels(), name);
  ImageF image(static_cast<int>(width), static_cast<int>(height),
               static_cast<int>(channels.size()));
  Imf::FrameBuffer pixels;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const std::size_t stride = channels.size() * sizeof(float);
    auto* const base = reinterpret_cast<char*>(image.values().data() + i);
    pixels.insert(channels[i], Imf::Slice::Make(Imf::FLOAT, base, data, stride,
                                                stride * static_cast<std::size_t>(width)));
  }
  file.setFrameBuffer(pixels);
  file.readPixels(data.min.y, data.max.y);
  return image;
}

ImageF parse_exr_picture(std::string_view bytes, const std::string& name) {
  try {
    return decode_exr(bytes, name);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& fault) {
    throw_damaged(name, "OpenEXR", fault.what());
  }
}

void check_values(const ImageF& image, PictureOf what, const std::string& name) {
  const auto is_bad = [what](float value) {
    return !std::isfinite(value) || (what == PictureOf::Light && value < 0);
  };
  const auto values = image.values();
  const auto bad = std::ranges::find_if(values, is_bad);
  if (bad == values.end()) return;
  const auto pixel = (bad - values.begin()) / image.channels();
  throw Error(
      "{}: channel {} of the pixel in column {}, row {} (from 0, the top) is {}; {}: correct the "
      "image",
      name, (bad - values.begin()) % image.channels(), pixel % image.width(), pixel / image.width(),
      *bad,
      what == PictureOf::Light ? "light must be finite and not negative"
                               : "heights must be finite");
}

}  // namespace

ImageF read_image_f(const std::filesystem::path& path, PictureOf what) {
  return parse_image_f(read_text(path), path.string(), what);
}

ImageF parse_image_f(std::string_view bytes, const std::string& name, PictureOf what) {
  std::optional<ImageF> image;
  if (bytes.starts_with(hdr_magic)) image = parse_hdr_picture(bytes, name);
  if (bytes.starts_with(exr_magic)) image = parse_exr_picture(bytes, name);
  if (!image) {
    throw Error("{}: it is neither a Radiance (.hdr) nor an OpenEXR (.exr) image{}", name,
                bytes.empty() ? ": it is empty" : ", despite its name: convert it");
  }
  check_values(*image, what, name);
  return *std::move(image);
}

}  // namespace groundray
