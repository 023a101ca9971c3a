#include "apps/dataset/run_part.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/near_names.h"

namespace groundray {
namespace {

constexpr std::string_view sensor_option = "--sensor ", frames_option = "--frames ";
constexpr std::size_t no_end = std::numeric_limits<std::size_t>::max();

std::string range_text(const FrameRange& range) {
  const std::string end = range.end == no_end ? "" : fmt::to_string(range.end);
  const std::string step = range.step == 1 ? "" : fmt::format(":{}", range.step);
  return fmt::format("{}:{}{}", range.first, end, step);
}

std::vector<std::string> listed_names(std::string_view list) {
  std::vector<std::string> names;
  for (bool is_last = false; !is_last;) {
    const std::size_t comma = list.find(',');
    is_last = comma == std::string_view::npos;
    names.emplace_back(list.substr(0, comma));
    list.remove_prefix(is_last ? list.size() : comma + 1);
  }
  return names;
}

}  // namespace

bool FrameChoice::has_sensor(std::string_view name) const {
  return sensors.empty() || std::ranges::find(sensors, name) != sensors.end();
}

std::int64_t FrameChoice::count(std::int64_t total) const noexcept {
  const std::size_t end = std::min(frames.end, static_cast<std::size_t>(total));
  if (frames.first >= end) return 0;
  return static_cast<std::int64_t>((end - frames.first - 1) / frames.step + 1);
}

std::string text_of(const FrameChoice& choice) {
  std::string text;
  if (!choice.sensors.empty())
    text = fmt::format("{}{}", sensor_option, fmt::join(choice.sensors, ","));
  const FrameRange all;
  const auto& [first, end, step] = choice.frames;
  if (first == all.first && end == all.end && step == all.step) return text;
  return fmt::format("{}{}{}{}", text, text.empty() ? "" : " ", frames_option,
                     range_text(choice.frames));
}

std::optional<FrameChoice> parse_choice(std::string_view text) {
  FrameChoice choice;
  std::string_view rest = text;
  if (rest.starts_with(sensor_option)) {
    rest.remove_prefix(sensor_option.size());
    const std::size_t blank = rest.find(' ');
    choice.sensors = listed_names(rest.substr(0, blank));
    rest.remove_prefix(blank == std::string_view::npos ? rest.size() : blank + 1);
  }
  if (rest.starts_with(frames_option)) {
    try {
      choice.frames = parse_frames(rest.substr(frames_option.size()));
    } catch (const Error&) {
      return std::nullopt;
    }
  }
  if (text.empty() || text_of(choice) != text) return std::nullopt;
  return choice;
}

FrameChoice checked_choice(const FrameChoice& choice, const std::vector<RunSensor>& run) {
  std::vector<std::string> known;
  for (const RunSensor& sensor : run) known.push_back(sensor.name);
  for (const std::string& name : choice.sensors) {
    if (std::ranges::find(known, name) != known.end()) continue;
    throw Error("--sensor: the scene has no sensor '{}'{}; it has {}", name,
                suggestion(name, known), fmt::join(known, ", "));
  }
  FrameChoice checked{.sensors = {}, .frames = choice.frames};
  std::int64_t chosen = 0, all = 0, most = 0;
  for (const auto& [name, frames] : run) {
    all += frames;
    if (!choice.has_sensor(name)) continue;
    checked.sensors.push_back(name);
    chosen += choice.count(frames);
    most = std::max(most, frames);
  }
  if (chosen == 0)
    throw Error("--frames: {} includes no frame: those of {} are numbered from 0 to {}",
                range_text(choice.frames), fmt::join(checked.sensors, ", "), most - 1);
  if (chosen == all) return {};
  if (checked.sensors.size() == run.size()) checked.sensors.clear();
  return checked;
}

}  // namespace groundray
