#include "core/image/image_io.h"

#include <png.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/image_errors.h"
#include "core/io/file_io.h"
#include "core/io/text_lines.h"
// libjpeg's headers need <cstdio> before them.
#include <jerror.h>
#include <jpeglib.h>

namespace groundray {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view png_magic = "\x89PNG\r\n\x1a\n"sv;
constexpr std::string_view jpeg_magic = "\xff\xd8\xff"sv;

/// Decoder of PNG. libpng and libjpeg report errors by longjmp, which must not skip a destructor:
/// the steps passed to attempt() only call the library and own nothing.
class PngReader {
 public:
  PngReader(std::string_view bytes, const std::string& name)
      : name_(name),
        rest_(bytes),
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_fault, ignore)),
        info_(png_ != nullptr ? png_create_info_struct(png_) : nullptr) {
    if (info_ == nullptr) throw_damaged(name_, "PNG", "not enough memory to read it");
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  /// Returns the image with 8 or 16 bits per value, whatever the file has.
  template <typename T>
  Image<T> read(std::int64_t most_pixels) {
    attempt([this] {
      png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
      png_set_read_fn(png_, this, next);
      png_read_info(png_, info_);
    });
    const png_uint_32 height = png_get_image_height(png_, info_);
    check_size(name_, png_get_image_width(png_, info_), height, most_pixels);
    attempt([this] {
      png_set_expand(png_);
      if constexpr (sizeof(T) == 1) {
        png_set_scale_16(png_);
      } else {
        png_set_expand_16(png_);
        if constexpr (std::endian::native == std::endian::little) png_set_swap(png_);
      }
      png_set_interlace_handling(png_);
      png_read_update_info(png_, info_);
    });
    require_image_memory(name_, png_get_image_width(png_, info_), height,
                         sizeof(T) * png_get_channels(png_, info_));
    Image<T> image(static_cast<int>(png_get_image_width(png_, info_)), static_cast<int>(height),
                   png_get_channels(png_, info_));
    std::vector<png_bytep> rows;
    for (int y = 0; y < image.height(); ++y) {
      rows.push_back(reinterpret_cast<png_bytep>(image.at(0, y).data()));
    }
    attempt([this, &rows] {
      png_read_image(png_, rows.data());
      png_read_end(png_, nullptr);
    });
    return image;
  }

 private:
  template <typename Step>
  void attempt(const Step& step) {
    if (setjmp(png_jmpbuf(png_)) != 0) throw_damaged(name_, "PNG", fault_.data());
    step();
  }
  [[noreturn]] static void on_fault(png_structp png, png_const_charp fault) {
    auto& self = *static_cast<PngReader*>(png_get_error_ptr(png));
    std::snprintf(self.fault_.data(), self.fault_.size(), "%s", fault);
    png_longjmp(png, 1);
  }
  static void ignore(png_structp, png_const_charp) {}
  static void next(png_structp png, png_bytep to, std::size_t size) {
    auto& self = *static_cast<PngReader*>(png_get_io_ptr(png));
    if (size > self.rest_.size()) png_error(png, "unexpected end of file");
    std::memcpy(to, self.rest_.data(), size);
    self.rest_.remove_prefix(size);
  }

  const std::string& name_;
  std::string_view rest_;
  std::array<char, 128> fault_{};
  png_structp png_;
  png_infop info_;
};

class JpegReader {
 public:
  JpegReader(std::string_view bytes, const std::string& name) : name_(name) {
    jpeg_.err = jpeg_std_error(&faults_);
    jpeg_.client_data = this;
    faults_.error_exit = on_fault;
    faults_.emit_message = on_warning;
    attempt([&] {
      jpeg_create_decompress(&jpeg_);
      jpeg_mem_src(&jpeg_, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    });
  }
  ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  Image8 read(std::int64_t most_pixels) {
    attempt([this] { jpeg_read_header(&jpeg_, TRUE); });
    check_size(name_, jpeg_.image_width, jpeg_.image_height, most_pixels);
    // Progressive images are kept whole as coefficients of 2 bytes.
    require_image_memory(name_, jpeg_.image_width, jpeg_.image_height, 9);
    if (jpeg_.jpeg_color_space == JCS_CMYK || jpeg_.jpeg_color_space == JCS_YCCK) {
      throw Error("{}: its colours are CMYK; they must be grey or RGB: convert the image", name_);
    }
    jpeg_.out_color_space = jpeg_.jpeg_color_space == JCS_GRAYSCALE ? JCS_GRAYSCALE : JCS_RGB;
    attempt([this] { jpeg_start_decompress(&jpeg_); });
    Image8 image(static_cast<int>(jpeg_.output_width), static_cast<int>(jpeg_.output_height),
                 jpeg_.output_components);
    attempt([this, &image] {
      while (jpeg_.output_scanline < jpeg_.output_height) {
        JSAMPROW row = image.at(0, static_cast<int>(jpeg_.output_scanline)).data();
        jpeg_read_scanlines(&jpeg_, &row, 1);
      }
      jpeg_finish_decompress(&jpeg_);
    });
    return image;
  }

 private:
  template <typename Step>
  void attempt(const Step& step) {
    if (setjmp(jump_) != 0) {
      std::array<char, JMSG_LENGTH_MAX> fault{};
      faults_.format_message(reinterpret_cast<j_common_ptr>(&jpeg_), fault.data());
      throw_damaged(name_, "JPEG", fault.data());
    }
    step();
  }
  [[noreturn]] static void on_fault(j_common_ptr jpeg) {
    std::longjmp(static_cast<JpegReader*>(jpeg->client_data)->jump_, 1);
  }
  /// Treats missing or unreadable data as an error: libjpeg fills it with grey and only warns.
  static void on_warning(j_common_ptr jpeg, int level) {
    constexpr std::array harmless{JWRN_ADOBE_XFORM, JWRN_EXTRANEOUS_DATA, JWRN_JFIF_MAJOR,
                                  JWRN_NOT_SEQUENTIAL, JWRN_TOO_MUCH_DATA};
    const bool matters = std::ranges::find(harmless, jpeg->err->msg_code) == harmless.end();
    if (level < 0 && matters) on_fault(jpeg);
  }

  const std::string& name_;
  jpeg_decompress_struct jpeg_{};
  jpeg_error_mgr faults_{};
  std::jmp_buf jump_{};
};

/// Returns values as fractions of the maximum of T. Only the quotient is rounded: the integers are
/// exact in float.
template <typename T>
ImageF fractions(const Image<T>& image, const std::string& name) {
  require_image_memory(name, image.width(), image.height(),
                       sizeof(float) * static_cast<std::size_t>(image.channels()));
  ImageF result(image.width(), image.height(), image.channels());
  std::ranges::transform(image.values(), result.values().begin(), [](T value) {
    return static_cast<float>(value) / static_cast<float>(std::numeric_limits<T>::max());
  });
  return result;
}

/// Header of a Radiance picture.
struct HdrHeader {
  int width = 0, height = 0;
  glm::dvec3 exposure{1};  ///< factors by which light was multiplied, for each channel
};

/// Parses the header and removes it from the front of `bytes`.
HdrHeader take_hdr_header(std::string_view& bytes, const std::string& name,
                          std::int64_t most_pixels) {
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
  check_size(name, *width, *height, most_pixels);
  require_image_memory(name, *width, *height, 3 * sizeof(float));
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

ImageF parse_hdr_picture(std::string_view bytes, const std::string& name,
                         std::int64_t most_pixels) {
  const HdrHeader header = take_hdr_header(bytes, name, most_pixels);
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

Image8 read_image8(const std::filesystem::path& path) {
  return parse_image8(read_text(path), path.string());
}

Image8 parse_image8(std::string_view bytes, const std::string& name, std::int64_t most_pixels) {
  if (bytes.starts_with(png_magic)) return PngReader(bytes, name).read<std::uint8_t>(most_pixels);
  if (bytes.starts_with(jpeg_magic)) return JpegReader(bytes, name).read(most_pixels);
  throw Error("{}: it is neither a PNG nor a JPEG image{}", name,
              bytes.empty() ? ": it is empty" : ", despite its name: convert it");
}

ImageF read_heights(const std::filesystem::path& path) {
  return parse_heights(read_text(path), path.string());
}

ImageF parse_heights(std::string_view bytes, const std::string& name, std::int64_t most_pixels) {
  if (bytes.starts_with(png_magic)) {
    return fractions(PngReader(bytes, name).read<std::uint16_t>(most_pixels), name);
  }
  if (bytes.starts_with(jpeg_magic))
    return fractions(JpegReader(bytes, name).read(most_pixels), name);
  if (is_image_f(bytes)) return parse_image_f(bytes, name, PictureOf::Heights, most_pixels);
  throw Error("{}: it is not a PNG, JPEG, OpenEXR (.exr) or Radiance (.hdr) image{}", name,
              bytes.empty() ? ": it is empty" : ", despite its name: convert it");
}

ImageF read_image_f(const std::filesystem::path& path, PictureOf what) {
  return parse_image_f(read_text(path), path.string(), what);
}

ImageF parse_image_f(std::string_view bytes, const std::string& name, PictureOf what,
                     std::int64_t most_pixels) {
  std::optional<ImageF> image;
  if (bytes.starts_with(hdr_magic)) image = parse_hdr_picture(bytes, name, most_pixels);
  if (bytes.starts_with(exr_magic)) image = parse_exr_picture(bytes, name, most_pixels);
  if (!image) {
    throw Error("{}: it is neither a Radiance (.hdr) nor an OpenEXR (.exr) image{}", name,
                bytes.empty() ? ": it is empty" : ", despite its name: convert it");
  }
  check_values(*image, what, name);
  return *std::move(image);
}

}  // namespace groundray
