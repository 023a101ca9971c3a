#include "core/image/exr_io.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>

#include "core/error.h"
#include "core/io/file_io.h"

namespace groundray {
namespace {

constexpr std::size_t most_name_bytes = 255;  // longest name that OpenEXR reads

/// Stream in memory. OpenEXR's own file stream swallows errors in its destructor, so the file is
/// composed in memory and then written.
class MemoryOStream : public Imf::OStream {
 public:
  MemoryOStream() : OStream("memory") {}
  void write(const char bytes[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    bytes_.replace(position_, size, bytes, size);
    position_ += size;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

constexpr Imf::PixelType pixel_type_of(const ImageF*) { return Imf::FLOAT; }
constexpr Imf::PixelType pixel_type_of(const Image32*) { return Imf::UINT; }

void check_names(const std::vector<ExrLayer>& layers, Violations& broken) {
  std::set<std::string> names;
  for (const ExrLayer& layer : layers) {
    const int channels =
        std::visit([](const auto* image) { return image->channels(); }, layer.image);
    broken.unless(channels > 0, "an image is empty");
    broken.unless(std::ssize(layer.names) == channels,
                  "there are {} names for {} channels; give one per channel", layer.names.size(),
                  channels);
    for (const std::string& name : layer.names) {
      broken.unless(!name.empty() && name.size() <= most_name_bytes,
                    "'{}' cannot name a channel: names have 1 to {} bytes", name.substr(0, 40),
                    most_name_bytes);
      broken.unless(names.insert(name).second, "two channels are named '{}'", name);
    }
  }
}

void check_sizes(const std::vector<ExrLayer>& layers, Violations& broken) {
  broken.unless(!layers.empty(), "there is no image to write");
  std::optional<std::pair<int, int>> first;
  for (const ExrLayer& layer : layers) {
    const std::pair size = std::visit(
        [](const auto* image) { return std::pair(image->width(), image->height()); }, layer.image);
    if (!first) first = size;
    broken.unless(size == *first, "images of {} x {} and {} x {} px cannot be layers of one file",
                  first->first, first->second, size.first, size.second);
  }
}

void insert(Imf::Header& header, const ExrAttribute& attribute, Violations& broken) {
  const auto& [name, value] = attribute;
  const bool is_new = header.find(name) == header.end();
  const bool fits = !name.empty() && name.size() <= most_name_bytes;
  broken.unless(fits, "'{}' cannot name an attribute: names have 1 to {} bytes", name.substr(0, 40),
                most_name_bytes);
  broken.unless(is_new, "the attribute '{}' already exists: choose another name", name);
  if (!fits || !is_new) return;
  if (const auto* text = std::get_if<std::string>(&value)) {
    header.insert(name, Imf::StringAttribute(*text));
  } else if (const auto* number = std::get_if<float>(&value)) {
    header.insert(name, Imf::FloatAttribute(*number));
  } else {
    // The 16 floats are the same: GLM's matrices are for column vectors and stored by columns,
    // Imath's are for row vectors and stored by rows.
    Imath::M44f matrix;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) matrix[i][j] = std::get<glm::mat4>(value)[i][j];
    }
    header.insert(name, Imf::M44fAttribute(matrix));
  }
}

template <typename T>
void insert(Imf::Header& header, Imf::FrameBuffer& pixels, const std::vector<std::string>& names,
            const Image<T>& image) {
  const std::size_t stride = names.size() * sizeof(T);
  for (std::size_t i = 0; i < names.size(); ++i) {
    header.channels().insert(names[i], Imf::Channel(pixel_type_of(&image)));
    // The library takes a pointer to mutable values but only reads them.
    auto* const base = reinterpret_cast<char*>(const_cast<T*>(image.values().data() + i));
    pixels.insert(names[i], Imf::Slice(pixel_type_of(&image), base, stride,
                                       stride * static_cast<std::size_t>(image.width())));
  }
}

}  // namespace

void write_exr(const std::filesystem::path& path, const std::vector<ExrLayer>& layers,
               const std::vector<ExrAttribute>& attributes) {
  Violations broken(path.string());
  check_names(layers, broken);
  check_sizes(layers, broken);
  broken.throw_if_any();
  const auto [width, height] =
      std::visit([](const auto* image) { return std::pair(image->width(), image->height()); },
                 layers.front().image);
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.zipCompressionLevel() = 2;  // see docs/reference/formats.md: time and size of others
  for (const ExrAttribute& attribute : attributes) insert(header, attribute, broken);
  broken.throw_if_any();
  Imf::FrameBuffer pixels;
  for (const ExrLayer& layer : layers) {
    std::visit([&](const auto* image) { insert(header, pixels, layer.names, *image); },
               layer.image);
  }
  MemoryOStream stream;
  {
    Imf::OutputFile file(stream, header);
    file.setFrameBuffer(pixels);
    file.writePixels(height);
  }
  write_text(path, stream.bytes());
}

}  // namespace groundray
