#include <fmt/format.h>

#include <cstddef>
#include <exception>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/io/npy_io.h"
#include "reconstruction/dem/ground/ground_filter.h"

/// Classifies the points of an array of shape (n, 3): writes for each point its class (0: ground,
/// 1: above, 2: below) and its height above the ground.
///   filter_ground IN.npy OUT.npy (airborne | ground_scan) [OPTION=NUMBER...]
namespace {

using groundray::GroundFilterOptions;

GroundFilterOptions options_of(std::span<char*> words) {
  if (std::string_view(words[0]) != "airborne" && std::string_view(words[0]) != "ground_scan")
    throw groundray::Error("{} must be airborne or ground_scan", words[0]);
  GroundFilterOptions options = std::string_view(words[0]) == "airborne"
                                    ? GroundFilterOptions::airborne()
                                    : GroundFilterOptions::ground_scan();
  for (const std::string word : words.subspan(1)) {
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    const double value = std::stod(word.substr(equals + 1));
    double* const option = name == "cell_m"            ? &options.cell_m
                           : name == "slope"           ? &options.slope
                           : name == "window_radius_m" ? &options.window_radius_m
                           : name == "threshold_m"     ? &options.threshold_m
                           : name == "scaling_m"       ? &options.scaling_m
                                                       : nullptr;
    if (option == nullptr) throw groundray::Error("unknown option {}", name);
    *option = value;
  }
  return options;
}

void filter_file(std::span<char*> arguments) {
  const groundray::NpyArray read = groundray::read_npy(arguments[0]);
  std::vector<glm::dvec3> points_m(read.cloud.rows());
  for (int axis = 0; axis < 3; ++axis) {
    const std::span<const double> values = read.cloud.column<double>(std::to_string(axis));
    for (std::size_t i = 0; i < values.size(); ++i) points_m[i][axis] = values[i];
  }
  const GroundFilterOptions options = options_of(arguments.subspan(2));
  const groundray::GroundPoints found = groundray::filter_ground(points_m, options);
  std::vector<std::byte> rows;
  for (std::size_t i = 0; i < found.classes.size(); ++i) {
    rows.push_back(static_cast<std::byte>(found.classes[i]));
    const auto height = std::as_bytes(std::span(&found.height_m[i], 1));
    rows.insert(rows.end(), height.begin(), height.end());
  }
  groundray::write_npy(arguments[1], {{"class", "|u1"}, {"height_m", "<f4"}}, found.classes.size(),
                       rows);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  try {
    filter_file(std::span(argv, static_cast<std::size_t>(argc)).subspan(1));
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
