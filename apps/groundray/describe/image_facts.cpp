#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <variant>

#include "apps/groundray/describe/file_facts.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"
#include "terrain/dem/dem_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;

// Returns "R: 0 to 1" for a channel of an image; values that are not finite are counted.
template <typename T>
std::string channel_text(std::string_view name, const Image<T>& image, int channel, double scale) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  std::size_t others = 0;
  const auto values = image.values();
  for (auto i = static_cast<std::size_t>(channel); i < values.size();
       i += static_cast<std::size_t>(image.channels())) {
    const double value = static_cast<double>(values[i]) * scale;
    if (!std::isfinite(value)) {
      ++others;
      continue;
    }
    low = std::min(low, value);
    high = std::max(high, value);
  }
  std::string text = low > high ? fmt::format("{}: no finite value", name)
                                : fmt::format("{}: {:.6g} to {:.6g}", name, low, high);
  return others == 0 ? text : fmt::format("{}, {} not finite", text, others);
}

template <typename T>
void add_channels(const Image<T>& image, double scale, Facts& facts) {
  static constexpr std::array<std::array<std::string_view, 4>, 4> names{
      {{"grey"}, {"grey", "alpha"}, {"R", "G", "B"}, {"R", "G", "B", "alpha"}}};
  for (int channel = 0; channel < image.channels(); ++channel)
    facts.emplace_back("channel", channel_text(names[static_cast<std::size_t>(image.channels() - 1)]
                                                    [static_cast<std::size_t>(channel)],
                                               image, channel, scale));
}

std::string size_text(int width, int height) { return fmt::format("{} x {} px", width, height); }

Facts exr_facts(const fs::path& file) {
  const ExrFile exr = read_exr(file);
  Facts facts{{"kind", "image, OpenEXR"}, {"size", size_text(exr.width, exr.height)}};
  if (exr.display_size_px != glm::ivec2(exr.width, exr.height))
    facts.emplace_back("display", size_text(exr.display_size_px.x, exr.display_size_px.y));
  for (const ExrChannel& channel : exr.channels) {
    facts.emplace_back(
        "channel",
        std::visit([&](const auto& image) { return channel_text(channel.name, image, 0, 1); },
                   channel.image));
  }
  for (const auto& [name, value] : exr.attributes)
    facts.emplace_back("attribute", fmt::format("{}: {}", name, value.substr(0, 80)));
  return facts;
}

// False for a damaged file, too, about which read_image8 has the better message.
bool has_16_bits(const fs::path& file) {
  try {
    return inspect_dem(file).sample_type == "UInt16";
  } catch (const Error&) {
    return false;
  }
}

// Values as stored: read_heights returns those of 16 bits as fractions.
Facts picture_facts(const fs::path& file) {
  constexpr double most_of_16_bits = 65535;
  const bool is_deep = has_16_bits(file);
  const std::string form = file_ending(file) == ".png" ? "PNG" : "JPEG";
  Facts facts{{"kind", fmt::format("image, {} of {} bits", form, is_deep ? 16 : 8)}};
  const auto add = [&](const auto& image, double scale) {
    facts.emplace_back("size", size_text(image.width(), image.height()));
    add_channels(image, scale, facts);
  };
  if (is_deep) {
    add(read_heights(file), most_of_16_bits);
  } else {
    add(read_image8(file), 1);
  }
  return facts;
}

}  // namespace

Facts image_facts(const fs::path& file) {
  const std::string ending = file_ending(file);
  if (ending == ".exr") return exr_facts(file);
  if (ending != ".hdr") return picture_facts(file);
  const ImageF image = read_image_f(file);
  Facts facts{{"kind", "image, Radiance"}, {"size", size_text(image.width(), image.height())}};
  add_channels(image, 1, facts);
  return facts;
}

}  // namespace groundray
