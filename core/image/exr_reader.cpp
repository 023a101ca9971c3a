#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <OpenEXR/openexr.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <new>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_errors.h"
#include "core/io/file_io.h"
#include "core/io/memory.h"

namespace groundray {
namespace {

constexpr std::int64_t most_values = 4 * most_image_pixels;

class BytesStream : public Imf::IStream {
 public:
  BytesStream(std::string_view bytes, const std::string& name)
      : IStream(name.c_str()), bytes_(bytes) {}
  bool read(char to[], int count) override {
    const auto size = static_cast<std::size_t>(std::max(count, 0));
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

/// A rectangle of pixels.
struct Window {
  Imath::Box2i data;
  std::int64_t width = 0, height = 0;

  explicit Window(const Imath::Box2i& box)
      : data(box),
        width(std::int64_t{box.max.x} - box.min.x + 1),
        height(std::int64_t{box.max.y} - box.min.y + 1) {}
};

std::optional<std::string> text_of(const Imf::Attribute& attribute) {
  const auto joined = [](const auto* values, std::size_t count) {
    return fmt::format("{}", fmt::join(std::span(values, count), " "));
  };
  if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute))
    return text->value();
  if (const auto* whole = dynamic_cast<const Imf::IntAttribute*>(&attribute))
    return fmt::format("{}", whole->value());
  if (const auto* number = dynamic_cast<const Imf::FloatAttribute*>(&attribute))
    return fmt::format("{}", number->value());
  if (const auto* number = dynamic_cast<const Imf::DoubleAttribute*>(&attribute))
    return fmt::format("{}", number->value());
  if (const auto* vector = dynamic_cast<const Imf::V2fAttribute*>(&attribute))
    return joined(vector->value().getValue(), 2);
  if (const auto* vector = dynamic_cast<const Imf::V3fAttribute*>(&attribute))
    return joined(vector->value().getValue(), 3);
  if (const auto* matrix = dynamic_cast<const Imf::M33fAttribute*>(&attribute))
    return joined(matrix->value().getValue(), 9);
  if (const auto* matrix = dynamic_cast<const Imf::M44fAttribute*>(&attribute))
    return joined(matrix->value().getValue(), 16);
  return std::nullopt;
}

/// Rejects unsupported parts before OpenEXR allocates memory for them.
void check_part(const Imf::Header& header, const Window& window, const Imath::Box2i& first,
                const std::string& name) {
  check_size(name, window.width, window.height);
  if (header.hasType() && Imf::isDeepData(header.type())) {
    throw Error(
        "{}: deep pixels are not supported; each channel must have one value per pixel: flatten "
        "the image",
        name);
  }
  if (window.data != first) {
    throw Error(
        "{}: its parts differ in size or position; they must be equal: save each part as a "
        "separate file (exrmultipart -separate)",
        name);
  }
  if (header.hasTileDescription()) {
    const Imf::TileDescription& tiles = header.tileDescription();
    check_size(name + ": its tiles", tiles.xSize, tiles.ySize);
  }
  const auto& channels = header.channels();
  for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
    if (channel.channel().xSampling == 1 && channel.channel().ySampling == 1) continue;
    throw Error(
        "{}: its channel {} is subsampled by {} x {}; each channel must have full resolution: save "
        "it as RGB",
        name, channel.name(), channel.channel().xSampling, channel.channel().ySampling);
  }
}

/// Returns the name of a channel in the whole file.
std::string whole_name(const Imf::Header& header, int part, const std::string& channel) {
  if (part == 0 || !header.hasName() || header.name().empty() ||
      channel.starts_with(header.name() + ".")) {
    return channel;
  }
  return header.name() + "." + channel;
}

template <typename T>
void add(Imf::FrameBuffer& pixels, const char* channel, Imf::PixelType type, const Window& window,
         Image<T>& image) {
  image = Image<T>(static_cast<int>(window.width), static_cast<int>(window.height), 1);
  auto* const base = reinterpret_cast<char*>(image.values().data());
  pixels.insert(channel, Imf::Slice::Make(type, base, window.data, sizeof(T),
                                          sizeof(T) * static_cast<std::size_t>(window.width)));
}

// The frame buffer points to the pixels, which must stay in place while channels are added.
static_assert(std::is_nothrow_move_constructible_v<ExrChannel>);

std::vector<ExrChannel> read_part(Imf::MultiPartInputFile& file, int part, const Window& window) {
  const Imf::Header& header = file.header(part);
  std::vector<ExrChannel> result;
  Imf::FrameBuffer pixels;
  const auto& channels = header.channels();
  for (auto channel = channels.begin(); channel != channels.end(); ++channel) {
    ExrChannel& to = result.emplace_back(ExrChannel{whole_name(header, part, channel.name()), {}});
    if (channel.channel().type == Imf::UINT) {
      add(pixels, channel.name(), Imf::UINT, window, to.image.emplace<Image32>());
    } else {
      add(pixels, channel.name(), Imf::FLOAT, window, to.image.emplace<ImageF>());
    }
  }
  Imf::InputPart input(file, part);
  input.setFrameBuffer(pixels);
  input.readPixels(window.data.min.y, window.data.max.y);
  return result;
}

/// Checks all parts, their total size, and that no two channels have the same name.
void check_parts(const Imf::MultiPartInputFile& file, const std::string& name) {
  std::set<std::string> names;
  std::int64_t values = 0;
  for (int part = 0; part < file.parts(); ++part) {
    const Imf::Header& header = file.header(part);
    const Window window(header.dataWindow());
    check_part(header, window, file.header(0).dataWindow(), name);
    for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
      const std::string whole = whole_name(header, part, channel.name());
      if (!names.insert(whole).second) {
        throw Error("{}: two of its channels are named {}; save each part as a separate file", name,
                    whole);
      }
      values += window.width * window.height;
      if (values > most_values) {
        throw Error("{}: it has more than {} values; scale it down or save fewer channels", name,
                    most_values);
      }
    }
  }
  require_memory(name, "its pixels", static_cast<double>(values) * sizeof(float));
}

/// Throws what is wrong with the headers. OpenEXR's C++ reader allocates the size that an attribute
/// declares before it reads the attribute, and accepts a size that contradicts the type; its C
/// library checks both first.
void check_headers(std::string_view bytes, const std::string& name) {
  struct File {
    std::string_view bytes;
    std::array<char, 256> fault;  // no string: exceptions must not pass through C
  } file{bytes, {}};
  exr_context_initializer_t options = EXR_DEFAULT_CONTEXT_INITIALIZER;
  options.user_data = &file;
  options.error_handler_fn = [](exr_const_context_t context, exr_result_t, const char* message) {
    void* user_data = nullptr;
    exr_get_user_data(context, &user_data);
    auto* const read = static_cast<File*>(user_data);
    if (read != nullptr && read->fault[0] == '\0')  // the first is the cause of the others
      std::snprintf(read->fault.data(), read->fault.size(), "%s", message);
  };
  options.size_fn = [](exr_const_context_t, void* user_data) {
    return static_cast<std::int64_t>(static_cast<File*>(user_data)->bytes.size());
  };
  options.read_fn = [](exr_const_context_t, void* user_data, void* to, std::uint64_t size,
                       std::uint64_t offset, exr_stream_error_func_ptr_t) {
    const std::string_view whole = static_cast<File*>(user_data)->bytes;
    const std::string_view part = whole.substr(std::min<std::size_t>(offset, whole.size()), size);
    std::memcpy(to, part.data(), part.size());
    return static_cast<std::int64_t>(part.size());
  };
  exr_context_t context = nullptr;
  const exr_result_t result = exr_start_read(&context, name.c_str(), &options);
  exr_finish(&context);
  if (file.fault[0] != '\0') throw std::runtime_error(file.fault.data());  // with success, too
  if (result != EXR_ERR_SUCCESS) throw std::runtime_error(exr_get_default_error_message(result));
}

ExrFile decode(std::string_view bytes, const std::string& name) {
  BytesStream stream(bytes, name);
  Imf::MultiPartInputFile file(stream);
  check_parts(file, name);
  const Imf::Header& first = file.header(0);
  const Window window(first.dataWindow());
  const Window display(first.displayWindow());
  check_size(name + ": its display window", display.width, display.height);
  ExrFile result{
      .width = static_cast<int>(window.width),
      .height = static_cast<int>(window.height),
      .corner_px = {window.data.min.x - display.data.min.x, window.data.min.y - display.data.min.y},
      .display_size_px = {static_cast<int>(display.width), static_cast<int>(display.height)},
      .channels = {},
      .attributes = {}};
  for (auto attribute = first.begin(); attribute != first.end(); ++attribute) {
    if (auto text = text_of(attribute.attribute()))
      result.attributes.emplace(attribute.name(), *std::move(text));
  }
  for (int part = 0; part < file.parts(); ++part) {
    std::ranges::move(read_part(file, part, window), std::back_inserter(result.channels));
  }
  return result;
}

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

ImageF decode_picture(std::string_view bytes, const std::string& name, std::int64_t most_pixels) {
  BytesStream stream(bytes, name);
  Imf::InputFile file(stream);
  const Imath::Box2i data = file.header().dataWindow();
  if (data != file.header().displayWindow()) {
    throw Error("{}: its data window is not its display window: save the uncropped image", name);
  }
  const std::int64_t width = std::int64_t{data.max.x} - data.min.x + 1;
  const std::int64_t height = std::int64_t{data.max.y} - data.min.y + 1;
  check_size(name, width, height, most_pixels);
  const std::vector<std::string> channels = color_channels(file.header().channels(), name);
  require_image_memory(name, width, height, sizeof(float) * channels.size());
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

/// Returns decode(bytes, name), whose exceptions are reported as damage.
auto decoded(std::string_view bytes, const std::string& name, const auto& decode) {
  try {
    check_headers(bytes, name);
    return decode(bytes, name);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& fault) {
    throw_damaged(name, "OpenEXR", fault.what());
  }
}

}  // namespace

const ExrChannel* ExrFile::find(std::string_view name) const {
  const auto found = std::ranges::find(channels, name, &ExrChannel::name);
  return found == channels.end() ? nullptr : &*found;
}

ExrFile read_exr(const std::filesystem::path& path) {
  return parse_exr(read_text(path), path.string());
}

ExrFile parse_exr(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with(exr_magic)) {
    throw Error("{}: it is not an OpenEXR (.exr) image{}", name,
                bytes.empty() ? ": it is empty" : ", despite its name: convert it");
  }
  return decoded(bytes, name, decode);
}

ImageF parse_exr_picture(std::string_view bytes, const std::string& name,
                         std::int64_t most_pixels) {
  return decoded(bytes, name, [=](std::string_view all, const std::string& file) {
    return decode_picture(all, file, most_pixels);
  });
}

}  // namespace groundray
