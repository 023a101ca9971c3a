#include "apps/scene/sampling/distribution.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>

#include "core/math.h"

namespace groundray::sampling {
namespace {

using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;

constexpr double most_whole = 1e9;

// Returns the two numbers of an interval, or nullopt after a fault.
std::optional<std::pair<double, double>> read_interval(const Node& node, std::string_view key,
                                                       Faults& faults) {
  std::array<double, 2> ends{};
  if (!yaml::numbers(node, key, ends, yaml::any_number, faults)) return std::nullopt;
  if (ends[0] < ends[1] && std::isfinite(ends[1] - ends[0])) return std::pair(ends[0], ends[1]);
  faults.add(node, key, "is [{}, {}], from which nothing can be drawn: the first must be less",
             ends[0], ends[1]);
  return std::nullopt;
}

Distribution read_uniform(const Node& node, Map& /*map*/, Faults& faults) {
  const auto ends = read_interval(node, "uniform", faults);
  return ends ? Uniform{ends->first, ends->second} : Uniform{};
}

Distribution read_log_uniform(const Node& node, Map& /*map*/, Faults& faults) {
  const auto ends = read_interval(node, "log_uniform", faults);
  if (!ends) return LogUniform{};
  if (ends->first > 0) return LogUniform{ends->first, ends->second};
  faults.add(node, "log_uniform", "begins at {}, but logarithms need numbers > 0", ends->first);
  return LogUniform{};
}

Distribution read_normal(const Node& node, Map& map, Faults& faults) {
  std::array<double, 2> read{0, 1};
  Normal normal;
  if (!yaml::numbers(node, "normal", read, yaml::any_number, faults)) return normal;
  std::tie(normal.mean, normal.sd) = std::pair(read[0], read[1]);
  if (normal.sd <= 0) {
    faults.add(node, "normal",
               "is [mean, standard deviation] = [{}, {}], but the latter must be > 0", normal.mean,
               normal.sd);
    return Normal{};
  }
  const Node* const within = map.find("within", Need::Optional);
  const auto ends = within ? read_interval(*within, "within", faults) : std::nullopt;
  if (!ends) return normal;
  std::tie(normal.low, normal.high) = *ends;
  // Then at least 4 % of the numbers are inside, and one is found soon.
  if (normal.low <= normal.mean && normal.mean <= normal.high &&
      normal.high - normal.low >= normal.sd / 10)
    return normal;
  faults.add(*within, "within",
             "is [{}, {}], but must contain the mean {} and be at least a tenth of the standard "
             "deviation {} wide",
             normal.low, normal.high, normal.mean, normal.sd);
  return Normal{};
}

Distribution read_whole(const Node& node, Map& /*map*/, Faults& faults) {
  std::array<double, 2> ends{};
  if (!yaml::numbers(node, "whole", ends, yaml::any_number, faults)) return Whole{};
  const auto is_whole = [](double end) {
    return end == std::floor(end) && std::abs(end) <= most_whole;
  };
  if (is_whole(ends[0]) && is_whole(ends[1]) && ends[0] <= ends[1])
    return Whole{static_cast<std::int64_t>(ends[0]), static_cast<std::int64_t>(ends[1])};
  faults.add(node, "whole",
             "is [{}, {}], but must be two whole numbers of at most 1e9, the first not larger",
             ends[0], ends[1]);
  return Whole{};
}

Distribution read_choice(const Node& node, Map& map, Faults& faults) {
  std::vector<std::vector<Node>> rows;
  if (node.kind == Node::Kind::List)
    for (const Node& item : node.items) rows.push_back({item});
  if (rows.empty())
    faults.add(node, "choice", "is {}, but must be a list of values", yaml::shown(node));
  return weighted(std::move(rows), map, "choice", faults);
}

Distribution read_presence(const Node& node, Map& /*map*/, Faults& faults) {
  const auto read = yaml::number(node, "present", yaml::share_rule, faults);
  return Presence{read.value_or(1)};
}

using Reader = Distribution (*)(const Node&, Map&, Faults&);
constexpr std::array<std::pair<std::string_view, Reader>, 6> readers{
    {{"uniform", read_uniform},
     {"log_uniform", read_log_uniform},
     {"normal", read_normal},
     {"whole", read_whole},
     {"choice", read_choice},
     {"present", read_presence}}};

Node plain(std::string text, const Node& at) {
  return {.kind = Node::Kind::Plain,
          .line = at.line,
          .column = at.column,
          .text = std::move(text),
          .items = {}};
}

// Returns the shortest text of a number with a point, by which every reader of YAML knows it.
std::string number_text(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find('.') == std::string::npos) text.insert(std::min(text.find('e'), text.size()), ".0");
  return text;
}

// Draws numbers and presences; rows are chosen in draw().
struct TextOf {
  RandomKey key;

  double unit() const noexcept { return random_uniform(key).x; }
  std::string operator()(const Uniform& u) const {
    return number_text(std::clamp(u.low + unit() * (u.high - u.low), u.low, u.high));
  }
  std::string operator()(const LogUniform& u) const {
    const double low = math::log(u.low), high = math::log(u.high);
    return number_text(std::clamp(math::exp(low + unit() * (high - low)), u.low, u.high));
  }
  std::string operator()(const Normal& normal) const {
    constexpr std::uint32_t most_tries = 10000;  // 0.96 to this power is below 1e-177
    RandomKey next = key;
    for (; next.sub_ray < key.sub_ray + most_tries; ++next.sub_ray) {
      const double value = normal.mean + normal.sd * random_normal(next).x;
      if (normal.low <= value && value <= normal.high) return number_text(value);
    }
    return number_text(normal.mean);
  }
  std::string operator()(const Whole& whole) const {
    const double count = static_cast<double>(whole.high - whole.low + 1);
    const auto steps = static_cast<std::int64_t>(unit() * count);
    return fmt::format("{}", std::min(whole.low + steps, whole.high));
  }
  std::string operator()(const Choice& /*chosen in draw*/) const { return {}; }
  std::string operator()(const Presence& presence) const {
    return unit() < presence.probability ? "true" : "false";
  }
};

}  // namespace

Choice weighted(std::vector<std::vector<Node>> rows, Map& map, std::string_view key,
                Faults& faults) {
  Choice choice{.rows = std::move(rows), .weights_up_to = {}};
  std::vector<double> weights(choice.rows.size(), 1.0);
  const Node* const given = map.find("weights", Need::Optional);
  if (given) yaml::numbers(*given, "weights", weights, yaml::not_negative, faults);
  double sum = 0;
  for (const double weight : weights) choice.weights_up_to.push_back(sum += weight);
  if (sum <= 0 && given) faults.add(*given, key, "has no weight > 0, so that nothing can be drawn");
  return choice;
}

Distribution read_distribution(const Node& node, std::string_view key, Faults& faults) {
  Map map(node, key, faults);
  if (node.kind != Node::Kind::Map) return Uniform{};
  Distribution read;
  std::vector<std::string_view> found;
  for (const auto& [word, reader] : readers) {
    const Node* const at = map.find(word, Need::Optional);
    if (!at) continue;
    found.push_back(word);
    if (found.size() == 1) read = reader(*at, map, faults);
  }
  if (found.size() > 1) {
    faults.add(node, key, "has {}, but must have one of them", fmt::join(found, " and "));
  } else if (found.empty()) {
    faults.add(node, key,
               "has no distribution: give uniform, log_uniform, normal, whole, choice, present or "
               "table");
  }
  map.close();
  return read;
}

std::vector<Node> draw(const Distribution& distribution, RandomKey key, const Node& at) {
  const auto* const choice = std::get_if<Choice>(&distribution);
  if (!choice) return {plain(std::visit(TextOf{key}, distribution), at)};
  const double drawn = random_uniform(key).x * choice->weights_up_to.back();
  const auto above = std::ranges::upper_bound(choice->weights_up_to, drawn);
  const auto row = static_cast<std::size_t>(above - choice->weights_up_to.begin());
  return choice->rows[std::min(row, choice->rows.size() - 1)];
}

}  // namespace groundray::sampling
