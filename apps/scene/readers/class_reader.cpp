#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <string_view>
#include <system_error>

#include "apps/scene/readers/readers.h"
#include "core/near_names.h"

namespace groundray::yaml {
namespace {

// Classes from which the numbers of other datasets follow; data/labels map them.
constexpr std::array<std::string_view, 17> classes_of_surfaces{
    "ground", "grass", "shrub",  "rock",   "tree",    "vehicle", "person", "animal", "fence_post",
    "mud",    "water", "puddle", "gravel", "asphalt", "log",     "sign",   "object"};

}  // namespace

std::map<std::uint16_t, std::string> read_classes(Map& root, Faults& faults) {
  const Node* const node = root.find("classes", Need::Optional);
  if (!node) return {};
  const std::vector<std::string> known(classes_of_surfaces.begin(), classes_of_surfaces.end());
  std::map<std::uint16_t, std::string> classes;
  Map map(*node, "classes", faults);
  for (std::size_t i = 0; node->kind == Node::Kind::Map && i + 1 < node->items.size(); i += 2) {
    const std::string& key = node->items[i].text;
    std::uint16_t label = 0;
    const auto [end, fault] = std::from_chars(key.data(), key.data() + key.size(), label);
    if (fault != std::errc{} || end != key.data() + key.size()) {
      faults.add(node->items[i], "classes", "'{}' must be a label, a whole number from 0 to 65535",
                 key);
      continue;
    }
    std::string word;
    const Node* const at = map.read_text(key, Need::Required, word);
    if (at && std::ranges::find(known, word) == known.end()) {
      faults.add(*at, "classes", "{} is '{}', but must be one of {}{}", label, word,
                 fmt::join(known, ", "), suggestion(word, known));
    } else if (at) {
      classes[label] = word;
    }
  }
  return classes;
}

}  // namespace groundray::yaml
