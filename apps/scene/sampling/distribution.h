#pragma once

#include <cstdint>
#include <limits>
#include <string_view>
#include <variant>
#include <vector>

#include "apps/scene/yaml_reader.h"
#include "core/random.h"

namespace groundray::sampling {

/// Uniform distribution on an open interval.
struct Uniform {
  double low = 0, high = 1;
};

/// Distribution whose logarithm is uniform on an open interval; low > 0.
struct LogUniform {
  double low = 1, high = 2;
};

/// Normal distribution, truncated to an interval that contains the mean.
struct Normal {
  double mean = 0, sd = 1;
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

/// Whole numbers of a closed interval, each as likely.
struct Whole {
  std::int64_t low = 0, high = 1;
};

/// Rows of values, of which one is drawn; weights are added up, so that the last is their sum.
struct Choice {
  std::vector<std::vector<yaml::Node>> rows;
  std::vector<double> weights_up_to;
};

/// Presence of a part of the scene, with a probability.
struct Presence {
  double probability = 1;
};

using Distribution = std::variant<Uniform, LogUniform, Normal, Whole, Choice, Presence>;

/// Reads a distribution: a map with one of the keys `uniform`, `log_uniform`, `normal`, `whole`,
/// `choice` and `present`, and with the options of that one. Records every fault.
/// @param key  the distribution's own key, for messages.
Distribution read_distribution(const yaml::Node& node, std::string_view key, yaml::Faults& faults);

/// Reads weights at `weights` of the distribution of `rows`; all are the same without them.
Choice weighted(std::vector<std::vector<yaml::Node>> rows, yaml::Map& map, std::string_view key,
                yaml::Faults& faults);

/// Draws the values of a distribution: one, or those of a row of Choice. Presence is `true` or
/// `false`.
/// @param key  its block, and those of the following `sub_ray`s, determine the values.
/// @param at   position of the values in messages.
std::vector<yaml::Node> draw(const Distribution& distribution, RandomKey key, const yaml::Node& at);

}  // namespace groundray::sampling
