#include "apps/view/recorded/recorded_image.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string_view>

#include "core/error.h"

namespace groundray {
namespace {

using Kind = ImageChannel::Kind;

glm::ivec2 common_size(const std::vector<ImageChannel>& channels,
                       const std::filesystem::path& path) {
  if (channels.empty()) throw Error("{}: the picture has no channel", path.string());
  const glm::ivec2 size_px = size_of(channels.front().values);
  for (const ImageChannel& channel : channels) {
    const glm::ivec2 other_px = size_of(channel.values);
    if (other_px == size_px) continue;
    throw Error("{}: {} has {} x {} px, but {} has {} x {}: do they belong to one frame?",
                path.string(), channels.front().file, size_px.x, size_px.y, channel.file,
                other_px.x, other_px.y);
  }
  return size_px;
}

// Third-party files may have two layers of the same name.
void make_names_unique(std::vector<ImageChannel>& channels) {
  std::map<std::string, int> seen;
  for (ImageChannel& channel : channels) {
    if (const int count = ++seen[channel.name]; count > 1)
      channel.name += fmt::format(" ({})", count);
  }
}

std::string value_text(const ImageChannel& channel, double value) {
  if (std::isnan(value)) return "none";
  if (std::isinf(value)) return channel.kind == Kind::Distance ? "sky" : "infinite";
  const bool is_whole = !std::holds_alternative<ImageF>(channel.values);
  return is_whole ? fmt::format("{}", value) : fmt::format("{:.6g}", value);
}

// Text such as "none" has no unit.
std::string with_unit(std::string text, const std::string& unit) {
  const bool is_number =
      std::isdigit(static_cast<unsigned char>(text.back())) || text.back() == ')';
  return unit.empty() || !is_number ? text : text + " " + unit;
}

std::string value_text(const ImageChannel& channel, const std::vector<double>& values,
                       const RecordedNames& names) {
  if (channel.kind == Kind::Categories) {
    const double value = values[0];
    const bool counts = value >= 0 && value <= 4294967295.0 && value == std::floor(value);
    if (!counts) return value_text(channel, value);
    const std::string name = name_of(channel, static_cast<std::uint32_t>(value), names);
    return name.empty() ? fmt::format("{}", value) : fmt::format("{} ({})", value, name);
  }
  if (values.size() == 1) return with_unit(value_text(channel, values[0]), channel.unit);
  if (std::ranges::all_of(values, [](double value) { return std::isnan(value); })) return "none";
  std::vector<std::string> texts;
  const bool is_flow = channel.kind == Kind::Flow;
  for (std::size_t k = 0; k < (is_flow ? 2 : values.size()); ++k)
    texts.push_back(value_text(channel, values[k]));
  const bool is_hidden = is_flow && values.size() > 2 && values[2] == 0;
  return with_unit(fmt::format("({})", fmt::join(texts, ", ")), channel.unit) +
         (is_hidden ? ", hidden or outside there" : "");
}

}  // namespace

double number_at(const PixelValues& values, glm::ivec2 pixel, int component) {
  return std::visit(
      [&](const auto& image) {
        return static_cast<double>(image.at(pixel.x, pixel.y)[static_cast<std::size_t>(component)]);
      },
      values);
}

int components_of(const PixelValues& values) {
  return std::visit([](const auto& image) { return image.channels(); }, values);
}

glm::ivec2 size_of(const PixelValues& values) {
  return std::visit([](const auto& image) { return glm::ivec2(image.width(), image.height()); },
                    values);
}

std::string name_of(const ImageChannel& channel, std::uint32_t number, const RecordedNames& names) {
  if (channel.name == "label") {
    if (number == 0) return "nothing";
    const auto found = names.labels.find(number);
    return found == names.labels.end() ? "" : found->second;
  }
  if (channel.name == "material" && number > 0 && number <= names.materials.size())
    return names.materials[number - 1];
  if (channel.name == "instance") {
    for (const RecordedNames::Objects& objects : names.objects) {
      if (objects.first <= number && number - objects.first < objects.count) return objects.name;
    }
  }
  return "";
}

RecordedImage::RecordedImage(const std::filesystem::path& stem, const RecordedNames& names)
    : channels_(read_frame_channels(stem)), names_(names) {
  size_px_ = common_size(channels_, stem);
  make_names_unique(channels_);
  constexpr std::string_view coverage = "coverage ";
  for (ImageChannel& channel : channels_) {
    if (!channel.name.starts_with(coverage)) continue;
    const auto label = std::strtoul(channel.name.c_str() + coverage.size(), nullptr, 10);
    const auto name = names.labels.find(static_cast<std::uint32_t>(label));
    if (name != names.labels.end()) channel.name += " (" + name->second + ")";
  }
}

RecordedImage::RecordedImage(const std::filesystem::path& file)
    : channels_(read_file_channels(file)) {
  size_px_ = common_size(channels_, file);
  make_names_unique(channels_);
}

std::optional<std::size_t> RecordedImage::find(const std::string& name) const {
  const auto found = std::ranges::find(channels_, name, &ImageChannel::name);
  if (found == channels_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - channels_.begin());
}

DrawnChannel RecordedImage::draw(std::size_t channel,
                                 std::optional<std::pair<double, double>> range,
                                 double exposure_ev) const {
  if (range && !(range->first < range->second)) {
    throw Error("a range of colours from {} to {} is empty: are its limits swapped?", range->first,
                range->second);
  }
  return draw_channel(channels_.at(channel), names_, range, exposure_ev);
}

std::vector<PixelValue> RecordedImage::values_at(glm::ivec2 pixel) const {
  std::vector<PixelValue> values;
  if (pixel.x < 0 || pixel.y < 0 || pixel.x >= size_px_.x || pixel.y >= size_px_.y) return values;
  for (std::size_t i = 0; i < channels_.size(); ++i)
    values.push_back({channels_[i].name, value_text(channels_[i], numbers_at(i, pixel), names_)});
  return values;
}

std::vector<double> RecordedImage::numbers_at(std::size_t channel, glm::ivec2 pixel) const {
  const PixelValues& values = channels_.at(channel).values;
  std::vector<double> numbers;
  for (int k = 0; k < components_of(values); ++k) numbers.push_back(number_at(values, pixel, k));
  return numbers;
}

std::optional<double> RecordedImage::distance_m(glm::ivec2 pixel) const {
  const auto channel = find("distance");
  if (!channel) return std::nullopt;
  return numbers_at(*channel, pixel)[0];
}

std::optional<double> RecordedImage::depth_m(glm::ivec2 pixel) const {
  const auto channel = find("depth");
  if (!channel) return std::nullopt;
  return numbers_at(*channel, pixel)[0];
}

}  // namespace groundray
