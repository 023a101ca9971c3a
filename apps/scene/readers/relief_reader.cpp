#include "apps/scene/readers/relief_reader.h"

#include <string>
#include <utility>

#include "apps/scene/readers/pattern_reader.h"
#include "core/error.h"
#include "core/image/image_io.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using yaml::Faults;
using yaml::Map;
using yaml::Need;
using yaml::Node;
using yaml::positive;
using yaml::Rule;

constexpr Rule hurst_rule{[](double value) { return value >= 0 && value <= 1; },
                          "must be from 0 to 1"};

ImageRelief read_image_relief(Map map, const fs::path& path, Faults& faults) {
  ImageRelief relief;
  std::string file;
  if (const Node* const at = map.read_text("file", Need::Required, file)) {
    try {
      relief.image = read_heights(beside(path, file));
    } catch (const Error& fault) {
      faults.add(*at, "file", "the image cannot be read:\n{}", fault.what());
    }
  }
  map.read_number("amplitude_m", Need::Required, relief.amplitude_m);
  map.read_number("middle", Need::Optional, relief.middle);
  map.read_number("size_m", Need::Required, relief.size_m, positive);
  map.close();
  return relief;
}

FractalSpec read_fractal(Map map) {
  FractalSpec fractal;
  map.read_number("rms_m", Need::Required, fractal.rms_m, positive);
  map.read_number("hurst", Need::Optional, fractal.hurst, hurst_rule);
  map.read_number("shortest_m", Need::Required, fractal.shortest_m, positive);
  map.read_number("longest_m", Need::Required, fractal.longest_m, positive);
  map.read_whole("variant", Need::Optional, fractal.seed.value);
  map.close();
  return fractal;
}

}  // namespace

ReliefSpec read_relief(Map map, const fs::path& path, Faults& faults) {
  ReliefSpec relief;
  map.read_number("cell_m", Need::Required, relief.cell_m, positive);
  map.read_number("period_m", Need::Optional, relief.period_m, positive);
  if (auto image = map.map("image", Need::Optional))
    relief.image = read_image_relief(std::move(*image), path, faults);
  if (auto fractal = map.map("fractal", Need::Optional))
    relief.fractal = read_fractal(std::move(*fractal));
  if (!relief.image && !relief.fractal && map.node().kind == Node::Kind::Map)
    faults.add(map.node(), "relief", "must have 'image' or 'fractal', or both");
  map.close();
  return relief;
}

}  // namespace groundray
