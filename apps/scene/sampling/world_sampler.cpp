#include "apps/scene/sampling/world_sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "apps/scene/fingerprint.h"
#include "core/error.h"

namespace groundray::sampling {
namespace {

using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;

constexpr std::string_view block = "worlds";

Node plain_node(std::string text) {
  return {.kind = Node::Kind::Plain, .text = std::move(text), .items = {}};
}

// Reads the rows of a table of values that are drawn together.
Choice read_table(Map& map, std::size_t columns, Faults& faults) {
  std::vector<std::vector<Node>> rows;
  for (const Node& row : map.list("rows", Need::Required)) {
    if (row.kind == Node::Kind::List && row.items.size() == columns) {
      rows.push_back(row.items);
    } else {
      faults.add(row, "rows", "has {}, but must be a list of {} values, one for each column",
                 yaml::shown(row), columns);
    }
  }
  const Node* const given = map.find("rows", Need::Required);
  if (given && given->kind == Node::Kind::List && given->items.empty())
    faults.add(*given, "rows", "is empty, so that nothing can be drawn");
  return weighted(std::move(rows), map, "weights", faults);
}

// Returns the texts of the columns of a table.
std::vector<std::string> read_columns(Map& map, Faults& faults) {
  std::vector<std::string> columns;
  for (const Node& column : map.list("columns", Need::Required))
    if (yaml::is_text(column, "columns", faults)) columns.push_back(column.text);
  return columns;
}

}  // namespace

std::optional<WorldSampler> WorldSampler::read(const Node& scene, Faults& faults) {
  Map root(scene, "", faults);
  const Node* const given = root.find(block, Need::Optional);
  if (!given) return std::nullopt;
  WorldSampler sampler;
  sampler.scene_ = scene;
  root.read_whole("seed", Need::Optional, sampler.seed_.value);
  Map worlds(*given, block, faults);
  const Node* const count = worlds.read_whole("count", Need::Required, sampler.count_);
  if (count) sampler.count_place_ = faults.place(*count);
  if (count && sampler.count_ == 0) faults.add(*count, "count", "is 0, but must be 1 or more");
  const Node* const vary = worlds.find("vary", Need::Required);
  worlds.close();
  if (!vary) return sampler;
  Map varied(*vary, "vary", faults);  // rejects repeated keys
  if (vary->kind != Node::Kind::Map) return sampler;
  for (std::size_t i = 0; i + 1 < vary->items.size(); i += 2)
    sampler.read_draw(vary->items[i], vary->items[i + 1], faults);
  for (const Draw& draw : sampler.draws_) sampler.check_keys(draw, faults);
  sampler.check_overlaps(faults);
  return sampler;
}

void WorldSampler::read_draw(const Node& name, const Node& node, Faults& faults) {
  Draw draw{.name = name.text, .keys = {name.text}, .distribution = {}, .at = node};
  Faults no_faults({});
  const Node* const table = node.kind == Node::Kind::Map
                                ? Map(node, name.text, no_faults).find("table", Need::Optional)
                                : nullptr;
  if (table) {
    Map outer(node, name.text, faults);
    outer.find("table", Need::Required);
    outer.close();
    Map map(*table, "table", faults);
    draw.keys = read_columns(map, faults);
    draw.distribution = read_table(map, draw.keys.size(), faults);
    map.close();
  } else {
    draw.distribution = read_distribution(node, name.text, faults);
  }
  draws_.push_back(std::move(draw));
}

void WorldSampler::check_keys(const Draw& draw, Faults& faults) const {
  for (const std::string& key : draw.keys) {
    const KeyPath path = parse_key_path(key);
    if (path.front() == block || path.front() == "seed" || path.front() == "groundray") {
      faults.add(draw.at, key,
                 "cannot vary: the seed of a world follows from `seed` and its number");
    } else if (std::holds_alternative<Presence>(draw.distribution)) {
      if (!find(scene_, path))
        faults.add(draw.at, key, "is not in the scene, so that it is never present");
    } else if (const std::string missing = first_missing(scene_, path); !missing.empty()) {
      faults.add(draw.at, key,
                 "the scene has no {}; keys lead through maps, names and numbers of list items",
                 missing);
    }
  }
}

void WorldSampler::check_overlaps(Faults& faults) const {
  std::vector<std::pair<KeyPath, const Draw*>> paths;
  for (const Draw& draw : draws_) {
    for (const std::string& key : draw.keys) {
      KeyPath path = parse_key_path(key);
      const auto clash = std::ranges::find_if(paths, [&](const auto& other) {
        const bool is_inside_optional =
            path.size() != other.first.size() &&
            (std::holds_alternative<Presence>(draw.distribution) ||
             std::holds_alternative<Presence>(other.second->distribution));
        return overlap(path, other.first) && !is_inside_optional;
      });
      if (clash != paths.end()) {
        faults.add(draw.at, key, "varies what '{}' varies too", fmt::join(clash->first, "."));
      }
      paths.emplace_back(std::move(path), &draw);
    }
  }
}

std::vector<std::string> WorldSampler::keys() const {
  std::vector<std::string> keys;
  for (const Draw& draw : draws_) keys.insert(keys.end(), draw.keys.begin(), draw.keys.end());
  return keys;
}

RandomKey WorldSampler::random_key(const std::string& name, std::uint32_t world) const noexcept {
  Fingerprint print;
  print.add(std::span<const char>(name));
  return {.seed = seed_,
          .sensor = static_cast<std::uint32_t>(print.value() >> 32),
          .frame = world,
          .pulse = static_cast<std::uint32_t>(print.value()),
          .sub_ray = 0,
          .stream = RandomStream::World};
}

Seed WorldSampler::seed_of(std::uint32_t world) const noexcept {
  const auto bits = random_bits(random_key("seed", world));
  return {std::uint64_t{bits[0]} << 32 | bits[1]};
}

std::vector<Node> WorldSampler::values_of(std::uint32_t world) const {
  std::vector<Node> values;
  for (const Draw& draw : draws_) {
    std::vector<Node> drawn =
        sampling::draw(draw.distribution, random_key(draw.name, world), draw.at);
    std::ranges::move(drawn, std::back_inserter(values));
  }
  return values;
}

Node WorldSampler::scene_of(std::uint32_t world) const {
  if (world >= count_) {
    throw Error("{}: key 'count': is {}, so that the worlds are 0 to {}; there is no world {}",
                count_place_, count_, count_ - 1, world);
  }
  const std::vector<std::string> keys = this->keys();
  const std::vector<Node> values = values_of(world);
  Node scene = scene_;
  Node drawn{.kind = Node::Kind::Map, .text = {}, .items = {}};
  for (std::size_t i = 0; i < keys.size(); ++i) {
    drawn.items.push_back(plain_node(keys[i]));
    drawn.items.push_back(values[i]);
  }
  std::vector<KeyPath> absent;  // removed last, because numbers of list items would change
  std::size_t next = 0;
  for (const Draw& draw : draws_) {
    const bool is_presence = std::holds_alternative<Presence>(draw.distribution);
    for (const std::string& key : draw.keys) {
      const Node& value = values[next++];
      if (!is_presence) {
        set(scene, parse_key_path(key), value);
      } else if (value.text == "false") {
        absent.push_back(parse_key_path(key));
      }
    }
  }
  remove(scene, absent);
  set(scene, {"seed"}, plain_node(fmt::format("{}", seed_of(world).value)));
  remove(scene, {{std::string(block)}});
  set(scene, {"world"},
      {.kind = Node::Kind::Map,
       .text = {},
       .items = {plain_node("number"), plain_node(fmt::format("{}", world)), plain_node("drawn"),
                 std::move(drawn)}});
  return scene;
}

WorldSampler load_worlds(const std::filesystem::path& path) {
  const Node scene = yaml::parse(yaml::read_file(path), path);
  Faults faults(path);
  auto worlds = WorldSampler::read(scene, faults);
  faults.throw_if_any();
  if (!worlds) {
    throw Error("{}: it has no block `worlds`, from whose distributions worlds are drawn",
                path.string());
  }
  return std::move(*worlds);
}

}  // namespace groundray::sampling
