#include "terrain/relief/relief.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "terrain/dem/byte_hash.h"
#include "terrain/lod/deviation.h"
#include "terrain/lod/passes/node_arrays.h"
#include "terrain/relief/periodic_image.h"
#include "terrain/trail/trails.h"

namespace groundray {
namespace {

constexpr int period_block_cells = 8;
// Keeps the width of a pair of nodes of any level within the range of int.
constexpr double most_cells = 1 << 26;
constexpr double smallest_period = 64;  // samples
// Largest relative stretch of a copy of an image.
constexpr double most_stretch = 0.1;
// Memory per sample of a period during construction, bytes: heights, waves, their sum, and nodes.
constexpr double bytes_per_sample = 32;

void check_fractal(const FractalSpec& spec, double cell_m, Violations& broken) {
  broken.unless(spec.rms_m >= 0 && std::isfinite(spec.rms_m),
                "fractal: rms_m = {} must be finite and not negative", spec.rms_m);
  broken.unless(0 <= spec.hurst && spec.hurst <= 1, "fractal: hurst = {} must be from 0 to 1",
                spec.hurst);
  broken.unless(spec.shortest_m >= 2 * cell_m,
                "fractal: shortest_m = {} must be at least two cells, {}: lengthen it or make "
                "cell_m smaller",
                spec.shortest_m, 2 * cell_m);
  broken.unless(spec.shortest_m <= spec.longest_m && std::isfinite(spec.longest_m),
                "fractal: wavelengths [{}, {}] m are empty: are shortest_m and longest_m swapped?",
                spec.shortest_m, spec.longest_m);
}

void check_image_relief(const ImageRelief& spec, double cell_m, Violations& broken) {
  broken.unless(std::isfinite(spec.amplitude_m), "image: amplitude_m = {} must be finite",
                spec.amplitude_m);
  broken.unless(std::isfinite(spec.middle), "image: middle = {} must be finite", spec.middle);
  broken.unless(spec.size_m >= cell_m && std::isfinite(spec.size_m),
                "image: size_m = {} must be at least one cell, {}", spec.size_m, cell_m);
  broken.unless(spec.image.width() > 0, "image: it has no pixels");
  for (int y = 0; y < spec.image.height(); ++y) {
    for (int x = 0; x < spec.image.width(); ++x) {
      if (std::isfinite(spec.image.at(x, y)[0])) continue;
      broken.unless(false, "image: pixel ({}, {}) is not a finite number", x, y);
      return;  // one is enough
    }
  }
}

void check_relief(const ReliefSpec& spec) {
  const auto is_length = [](double value) { return value > 0 && std::isfinite(value); };
  Violations broken("relief");
  broken.unless(is_length(spec.cell_m), "cell_m = {} must be positive", spec.cell_m);
  broken.unless(is_length(spec.period_m) && spec.period_m <= 1e6,
                "period_m = {:g} must be positive and at most 1e6", spec.period_m);
  broken.unless(spec.image || spec.fractal || !spec.trails.empty(),
                "it needs an image, a fractal or trails");
  if (spec.image) check_image_relief(*spec.image, spec.cell_m, broken);
  if (spec.fractal) {
    check_fractal(*spec.fractal, spec.cell_m, broken);
    broken.unless(!(spec.fractal->longest_m > spec.period_m),
                  "fractal: longest_m = {} must not exceed period_m = {}", spec.fractal->longest_m,
                  spec.period_m);
  }
  broken.throw_if_any();
}

// Returns how many times the DEM's cells have to be halved.
int halvings(const GridFrame& dem, double cell_m) {
  const glm::dvec2 step_m = glm::abs(dem.step_m);
  int exponent = 0;
  while (std::ldexp(std::max(step_m.x, step_m.y), -exponent) > cell_m) ++exponent;
  const double cells = std::ldexp(std::max(dem.samples.x, dem.samples.y) - 1.0, exponent);
  if (cells > most_cells) {
    throw Error(
        "relief: with cells of {:g} m the DEM has {:g} cells on a side, more than the limit of "
        "{:g}; make cell_m larger",
        cell_m, cells, most_cells);
  }
  return exponent;
}

GridFrame refined_frame(const GridFrame& dem, int exponent) {
  const double parts = 1 << exponent;
  return {(dem.samples - 1) * (1 << exponent) + 1, dem.origin_m, dem.step_m / parts,
          dem.cells_per_m * parts};
}

glm::dvec2 copy_size_m(const ImageRelief& spec) {
  return {spec.size_m, spec.size_m * spec.image.height() / spec.image.width()};
}

// Returns the number of copies of an image in a period.
double copies(double period_m, double size_m) {
  return std::max(1.0, std::round(period_m / size_m));
}

// Returns the period in samples along one axis: a power of two that is no shorter than requested,
// and that a whole number of copies of the image fits.
double period_samples(double cell_m, double asked_m, double image_m) {
  double samples = smallest_period;
  const auto fits = [&] {
    const double period_m = samples * cell_m;
    if (period_m < asked_m) return false;
    if (image_m == 0) return true;
    return std::abs(period_m / (copies(period_m, image_m) * image_m) - 1) <= most_stretch;
  };
  while (!fits()) samples *= 2;
  return samples;
}

glm::ivec2 choose_period(const ReliefSpec& spec, glm::dvec2 cell_m, std::size_t memory_bytes) {
  const glm::dvec2 image_m = spec.image ? copy_size_m(*spec.image) : glm::dvec2(0);
  const glm::dvec2 samples{period_samples(cell_m.x, spec.period_m, image_m.x),
                           period_samples(cell_m.y, spec.period_m, image_m.y)};
  const double bytes = samples.x * samples.y * bytes_per_sample;
  if (bytes > static_cast<double>(memory_bytes)) {
    throw Error(
        "relief: a period of {:g} x {:g} samples takes {:g} MiB, more than the limit of {:g}; "
        "make period_m (now {:g}) shorter or cell_m (now {:g}) larger, or allow more memory",
        samples.x, samples.y, bytes / (1 << 20), static_cast<double>(memory_bytes) / (1 << 20),
        spec.period_m, spec.cell_m);
  }
  return samples;
}

HeightArray make_displacement(const ReliefSpec& spec, const GridFrame& frame,
                              std::size_t memory_bytes) {
  const glm::dvec2 cell_m = glm::abs(frame.step_m);
  const glm::ivec2 size = choose_period(spec, cell_m, memory_bytes);
  std::vector<double> sum_m(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
  if (spec.fractal) sum_m = fractal_field(*spec.fractal, size, cell_m);
  if (spec.image) {
    const glm::dvec2 period_m = glm::dvec2(size) * cell_m, copy_m = copy_size_m(*spec.image);
    const glm::ivec2 number(copies(period_m.x, copy_m.x), copies(period_m.y, copy_m.y));
    const auto values = sample_periodic(spec.image->image, size, number);
    for (std::size_t i = 0; i < values.size(); ++i)
      sum_m[i] += spec.image->amplitude_m * (values[i] - spec.image->middle);
  }
  return {size, std::vector<float>(sum_m.begin(), sum_m.end())};
}

// Ignores terms without weight, whose height may be missing.
double weighted(double weight, double height_m) noexcept {
  return weight == 0 ? 0 : weight * height_m;
}

// Returns the height of a facet of the DEM at (x, y) in its cell, both 0 to 1.
double facet_height_m(const Cell& cell, double x, double y) noexcept {
  if (x + y <= 1) return weighted(1 - x - y, cell.nw) + weighted(x, cell.ne) + weighted(y, cell.sw);
  return weighted(x + y - 1, cell.se) + weighted(1 - y, cell.ne) + weighted(1 - x, cell.sw);
}

}  // namespace

Relief::Relief(const ReliefSpec& spec, const GridFrame& dem, std::size_t memory_bytes)
    : exponent_((check_relief(spec), halvings(dem, spec.cell_m))),
      frame_(refined_frame(dem, exponent_)),
      displacement_(make_displacement(spec, frame_, memory_bytes)) {
  // Coarser levels have no values of their own. The height of any template is a weighted mean of
  // displacements, as is that of the reference surface, so they differ by at most the range.
  const float span_m = passes::rounded_up(displacement_.max_m() - displacement_.min_m());
  whole_ = {span_m, span_m, span_m, static_cast<float>(displacement_.min_m()),
            static_cast<float>(displacement_.max_m())};
  certify_period();
}

// Certifies the central one of three by three periods, so that all nodes have neighbours.
void Relief::certify_period() {
  const glm::ivec2 size = period();
  const Lattice lattice{3 * size + 1, period_block_cells};
  std::vector<float> samples, thinned;
  const auto fill = [&](int level, std::vector<float>& out) {
    out.clear();
    for (int row = 0; row <= size.y; row += 1 << level) {
      for (int column = 0; column <= size.x; column += 1 << level)
        out.push_back(displacement_m({column, row}));
    }
    return HeightWindow{.first = {size.x >> level, size.y >> level},
                        .size = {(size.x >> level) + 1, (size.y >> level) + 1},
                        .heights_m = out.data(),
                        .row_stride = (size.x >> level) + 1};
  };
  const HeightWindow all = fill(0, samples);
  for (int level = 0;
       level < exponent_ && (period_block_cells << level) <= std::min(size.x, size.y); ++level) {
    const glm::ivec2 first = size / (period_block_cells << level);
    levels_.push_back(unknown_nodes(first, NodeDetail::Full));
    accumulate_deviations(lattice, level, all, fill(level, thinned), first, levels_.back());
    if (level > 0) saturate_keys(levels_.back(), first, levels_[levels_.size() - 2], 2 * first);
    const auto& keys = levels_.back().key_m;
    whole_.key_m = std::max(whole_.key_m, *std::max_element(keys.begin(), keys.end()));
  }
}

std::shared_ptr<const Relief> Relief::with_trails(std::span<const TrailSpec> specs,
                                                  const Trail::GroundHeight& dem,
                                                  glm::dvec2 origin_w_m) const {
  const glm::dvec2 cell_m = glm::abs(frame_.step_m);
  auto relief = std::make_shared<Relief>(*this);
  if (!specs.empty())
    relief->trails_ =
        std::make_shared<const Trails>(specs, dem, origin_w_m, std::max(cell_m.x, cell_m.y));
  return relief;
}

double Relief::dem_height_m(const Cell& dem, glm::ivec2 sample) const noexcept {
  const double per_side = 1.0 / (1 << exponent_);
  const int x = sample.x - (dem.column << exponent_), y = sample.y - (dem.row << exponent_);
  return facet_height_m(dem, x * per_side, y * per_side);
}

float Relief::height_m(double dem_m, glm::ivec2 sample) const noexcept {
  const double relief_m = displacement_m(sample);
  return static_cast<float>(trails_ ? trails_->height_m(frame_.to_D(sample), dem_m, relief_m)
                                    : dem_m + relief_m);
}

float Relief::height_m(const Cell& dem, glm::ivec2 sample) const noexcept {
  return height_m(dem_height_m(dem, sample), sample);
}

float Relief::height_without_trails_m(const Cell& dem, glm::ivec2 sample) const noexcept {
  return static_cast<float>(dem_height_m(dem, sample) + displacement_m(sample));
}

HeightGrid Relief::refined(const HeightGrid& dem) const {
  const auto columns = static_cast<std::size_t>(frame_.samples.x);
  std::vector<float> heights_m(columns * static_cast<std::size_t>(frame_.samples.y));
  const glm::ivec2 last(dem.columns() - 2, dem.rows() - 2);
  run_pass(run_in_parallel, static_cast<std::size_t>(frame_.samples.y), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < frame_.samples.x; ++x) {
      const Cell cell =
          dem.cell(std::min(x >> exponent_, last.x), std::min(y >> exponent_, last.y));
      heights_m[row * columns + static_cast<std::size_t>(x)] = height_m(cell, {x, y});
    }
  });
  return {frame_.samples, frame_.origin_m, frame_.step_m, std::move(heights_m)};
}

Relief::Node Relief::node(int level, glm::ivec2 node) const noexcept {
  if (static_cast<std::size_t>(level) >= levels_.size()) return whole_;
  const NodeLevel& nodes = levels_[static_cast<std::size_t>(level)];
  const int column = node.x & (nodes.size.x - 1), row = node.y & (nodes.size.y - 1);
  const auto i = static_cast<std::size_t>(row) * static_cast<std::size_t>(nodes.size.x) +
                 static_cast<std::size_t>(column);
  return {nodes.key_m[i], nodes.deviation_m[i], nodes.full_m[i], nodes.low_m[i], nodes.high_m[i]};
}

float Relief::max_key_m(int level) const noexcept {
  if (static_cast<std::size_t>(level) >= levels_.size()) return whole_.key_m;
  const auto& keys = levels_[static_cast<std::size_t>(level)].key_m;
  return *std::max_element(keys.begin(), keys.end());
}

// Rounding moves a point of the surface and a point of the node by at most half a unit in the last
// place each.
double Relief::rounding_m(float low_m, float high_m) noexcept {
  return 0x1.00001p-23 *
         std::max(std::abs(static_cast<double>(low_m)), std::abs(static_cast<double>(high_m)));
}

std::uint64_t Relief::fingerprint() const noexcept {
  const auto values = displacement_.heights_m();
  const std::array<std::int32_t, 3> shape{exponent_, period().x, period().y};
  const auto bytes = [](const auto& of) {
    return std::string_view(reinterpret_cast<const char*>(of.data()), of.size() * sizeof(of[0]));
  };
  return byte_hash(bytes(values)) ^ std::rotl(byte_hash(bytes(shape)), 1) ^
         (trails_ ? std::rotl(trails_->fingerprint(), 2) : 0);
}

}  // namespace groundray
