#include "apps/dataset/range_conf.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec4.hpp>

#include "core/error.h"
#include "core/io/text_lines.h"

namespace groundray {
namespace {

Pose pose_of(const std::array<double, 7>& numbers) {
  const glm::dquat rotation(numbers[6], numbers[3], numbers[4], numbers[5]);
  return {.rotation = glm::conjugate(glm::normalize(rotation)),
          .translation_m = {numbers[0], numbers[1], numbers[2]}};
}

ConfScan bmesh(const std::vector<std::string_view>& words, const std::string& place) {
  constexpr std::size_t count = 9;
  constexpr double most_off = 1e-3;  // rounding to three decimals
  constexpr double farthest = 1e15;
  std::array<double, 7> numbers{};
  bool is_sound = words.size() == count;
  for (std::size_t i = 0; is_sound && i < numbers.size(); ++i) {
    const auto number = number_of<double>(words[i + 2]);
    is_sound = number && std::abs(*number) <= farthest;  // rejects NaN
    numbers[i] = number.value_or(0);
  }
  if (!is_sound) {
    throw Error("{}: it must be `bmesh FILE tx ty tz qx qy qz qw`, with all numbers within {:.0e}",
                place, farthest);
  }
  const double norm = glm::length(glm::dvec4(numbers[3], numbers[4], numbers[5], numbers[6]));
  if (!(std::abs(norm - 1) <= most_off))
    throw Error("{}: the length of its quaternion is {:.6g}; it must be 1", place, norm);
  return {.file = std::string(words[1]), .X_DS = pose_of(numbers)};
}

}  // namespace

std::vector<ConfScan> parse_conf(std::string_view text, const std::string& name) {
  std::vector<ConfScan> scans;
  TextLines lines(text);
  while (const auto line = lines.next()) {
    const auto words = words_of(*line);
    if (words.empty() || words[0] != "bmesh") continue;  // lines for cameras and meshes are ignored
    scans.push_back(bmesh(words, fmt::format("{}:{}", name, lines.number())));
  }
  return scans;
}

}  // namespace groundray
