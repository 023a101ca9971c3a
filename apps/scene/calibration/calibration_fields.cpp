#include "apps/scene/calibration/calibration_fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "core/error.h"

namespace groundray::calibration {

using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;

const Node* required(Map& map, std::string_view key, Faults& faults) {
  const Node* node = map.find(key, Need::Optional);
  if (!node && map.node().kind == Node::Kind::Map) faults.add(map.node(), key, "missing");
  return node;
}

std::string text_at(Map& map, std::string_view key, Faults& faults) {
  const Node* node = required(map, key, faults);
  return node && yaml::is_text(*node, key, faults) ? node->text : "";
}

std::vector<double> list_of(const Node& node, std::string_view key, Faults& faults) {
  std::vector<double> values;
  const std::span<const Node> items =
      node.kind == Node::Kind::List ? std::span(node.items) : std::span(&node, 1);
  if (node.kind == Node::Kind::Null) return values;
  for (const Node& item : items) {
    const auto value = yaml::number(item, key, yaml::any_number, faults);
    if (!value) return {};
    values.push_back(*value);
  }
  return values;
}

std::vector<double> numbers_at(Map& map, std::string_view key,
                               std::initializer_list<const char*> names, Faults& faults) {
  const Node* node = required(map, key, faults);
  if (!node) return {};
  const std::size_t before = faults.count();
  std::vector<double> values = list_of(*node, key, faults);
  if (values.size() == names.size() || faults.count() > before)
    return values.size() == names.size() ? values : std::vector<double>();
  faults.add(*node, key, "has {} numbers, but must have {}: {}", values.size(), names.size(),
             fmt::join(names, " "));
  return {};
}

int pixels_of(const Node& node, std::string_view key, Faults& faults) {
  const auto value = yaml::number(node, key, yaml::positive, faults);
  if (!value) return 0;
  if (*value == std::floor(*value) && *value <= 1e6) return static_cast<int>(*value);
  faults.add(node, key, "is {}, but must be a whole number of pixels", node.text);
  return 0;
}

glm::ivec2 size_of(const Node& node, std::string_view key, Faults& faults) {
  if (node.kind == Node::Kind::List && node.items.size() == 2)
    return {pixels_of(node.items[0], key, faults), pixels_of(node.items[1], key, faults)};
  faults.add(node, key, "is {}, but must be a list of width and height", yaml::shown(node));
  return {};
}

std::array<double, 4> four_of(const std::vector<double>& k) {
  std::array<double, 4> four{};
  std::copy_n(k.begin(), std::min<std::size_t>(4, k.size()), four.begin());
  return four;
}

void check(const LensModel& model, const Node& node, Faults& faults) {
  Violations broken("lens");
  check_lens(model, broken);
  try {
    broken.throw_if_any();
  } catch (const Error& fault) {
    faults.add(node, "", "{}", fault.what());
  }
}

LensModel brown_conrady(const PixelScale& scale, const std::vector<double>& k) {
  if (std::ranges::all_of(k, [](double value) { return value == 0; })) return Pinhole{scale};
  BrownConrady model{.scale = scale};
  std::ranges::copy(k, model.k.begin());
  return model;
}

}  // namespace groundray::calibration
