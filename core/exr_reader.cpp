#include "core/exr_reader.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "core/error.h"
#include "core/image_faults.h"
#include "core/product_io.h"

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
      throw std::runtime_error("the file ends too soon");
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

/// The pixels of a part.
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

/// Refuses what cannot be read, before OpenEXR takes memory for it.
void check_part(const Imf::Header& header, const Window& window, const Imath::Box2i& first,
                const std::string& name) {
  check_size(name, window.width, window.height);
  if (header.hasType() && Imf::isDeepData(header.type())) {
    throw Error("{}: its pixels are deep; they must have one value for each channel: flatten it",
                name);
  }
  if (window.data != first) {
    throw Error(
        "{}: its parts are of different sizes or places; they must be the same: save each part as "
        "a file of its own (exrmultipart -separate)",
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
        "{}: its channel {} is not for each pixel, but each {} x {}; it must be: save it as RGB",
        name, channel.name(), channel.channel().xSampling, channel.channel().ySampling);
  }
}

/// Returns the name that a channel has in the whole file.
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

// Pixels stay where they are while channels are added.
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

/// Checks all parts, and that together they are not too large and have no channel twice.
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
        throw Error("{}: two of its channels are named {}; save each part as a file of its own",
                    name, whole);
      }
      values += window.width * window.height;
      if (values > most_values) {
        throw Error("{}: it has more than {} values; scale it down or save fewer channels", name,
                    most_values);
      }
    }
  }
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
    throw Error("{}: it is not an OpenEXR (.exr) picture{}", name,
                bytes.empty() ? ": it is empty" : ", whatever its name: convert it");
  }
  try {
    return decode(bytes, name);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& fault) {
    throw_damaged(name, "OpenEXR", fault.what());
  }
}

}  // namespace groundray
