#include "apps/python/fused_dem.h"

#include <fmt/format.h>
#include <nanobind/stl/array.h>

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "apps/python/binding/pickle.h"

namespace groundray::python {
namespace {

// Calls `use` with the name and the values of each layer.
void for_each_layer(auto& layers, const auto& use) {
  auto& [frame, elevation_m, variance_m2, lidar, stereo, chi2, surfaces, overhang_m, clearance_m,
         source, to_data_m, fill_sd_m, upper_bound_m, slope_rad] = layers;
  use("elevation_m", elevation_m);
  use("variance_m2", variance_m2);
  use("lidar_points", lidar);
  use("stereo_points", stereo);
  use("chi2", chi2);
  use("surfaces", surfaces);
  use("overhang_m", overhang_m);
  use("clearance_m", clearance_m);
  use("source", source);
  use("distance_to_data_m", to_data_m);
  use("fill_sd_m", fill_sd_m);
  use("upper_bound_m", upper_bound_m);
  use("slope_rad", slope_rad);
}

template <typename T>
AnyArray layer_view(const std::vector<T>& values, nb::handle owner) {
  return view(values.data(), {values.size()}, owner);
}
AnyArray layer_view(const std::vector<HeightSource>& values, nb::handle owner) {
  return view(reinterpret_cast<const std::uint8_t*>(values.data()), {values.size()}, owner);
}

template <typename T>
void read_layer(PickledState& state, const char* name, std::vector<T>& values) {
  values = state.next_array<T>(name);
}
void read_layer(PickledState& state, const char* name, std::vector<HeightSource>& values) {
  for (const std::uint8_t number : state.next_array<std::uint8_t>(name)) {
    if (number > static_cast<std::uint8_t>(HeightSource::Filled))
      state.refuse(name, fmt::format("has the value {}, which is not a source of heights", number));
    values.push_back(static_cast<HeightSource>(number));
  }
}

GridFrame read_frame(PickledState& state) {
  const auto [columns, rows] = state.next<std::array<int, 2>>("samples");
  const auto [x_m, y_m] = state.next<std::array<double, 2>>("origin_m");
  const auto [dx_m, dy_m] = state.next<std::array<double, 2>>("step_m");
  const glm::dvec2 step_m(dx_m, dy_m);
  GridFrame frame{{columns, rows}, {x_m, y_m}, step_m, 1.0 / step_m};
  refuse_faults(frame);
  return frame;
}

}  // namespace

nb::list state_of(nb::handle_t<FusedDem> self) {
  const auto& [layers, counts] = nb::cast<const FusedDem&>(self);
  const auto& [samples, origin_m, step_m, cells_per_m] = layers.frame;
  nb::list state;
  state.append(nb::make_tuple(samples.x, samples.y));
  state.append(nb::make_tuple(origin_m.x, origin_m.y));
  state.append(nb::make_tuple(step_m.x, step_m.y));
  for_each_layer(layers, [&](const char* /*name*/, const auto& values) {
    state.append(layer_view(values, self));
  });
  state.append(array_of(std::vector<std::uint64_t>{counts.points, counts.outside, counts.unusable,
                                                   counts.without_ground, counts.uncertain,
                                                   counts.bytes_on_disk}));
  return state;
}

FusedDem restored_dem(const nb::tuple& values) {
  constexpr std::size_t count = 17;
  PickledState state("FusedDem", values, count);
  FusedDem dem;
  dem.layers.frame = read_frame(state);
  const glm::uvec2 samples(dem.layers.frame.samples);
  const std::size_t size = std::size_t{samples.x} * samples.y;
  for_each_layer(dem.layers, [&](const char* name, auto& layer) {
    read_layer(state, name, layer);
    if (layer.size() != size)
      state.refuse(name, fmt::format("has {} values for {} samples", layer.size(), size));
  });
  const auto counts = state.next_array<std::uint64_t>("counts");
  if (counts.size() != 6) state.refuse("counts", "must be 6 numbers");
  dem.counts = {counts[0], counts[1], counts[2], counts[3], counts[4], counts[5]};
  return dem;
}

}  // namespace groundray::python
