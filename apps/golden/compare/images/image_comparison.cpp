#include "apps/golden/compare/images/image_comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "apps/golden/compare/error_figures.h"
#include "core/error.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

constexpr double much_nearer = 0.5;
constexpr double nearly_the_same = 1e-4;

/// Shift or reflection by which pixels of the other image are looked up.
struct Reading {
  std::string what;
  int x_half_px = 0, y_half_px = 0;  // shift of the content
  bool is_x_mirrored = false, is_y_mirrored = false;
};

std::vector<Reading> readings() {
  std::vector<Reading> all{{"mirrored left to right", 0, 0, true, false},
                           {"mirrored top to bottom", 0, 0, false, true},
                           {"turned by 180 degrees", 0, 0, true, true}};
  for (int y = -2; y <= 2; ++y) {
    for (int x = -2; x <= 2; ++x) {
      if (x != 0 || y != 0)
        all.push_back({fmt::format("moved by ({}, {}) px", x / 2.0, y / 2.0), x, y});
    }
  }
  return all;
}

/// Looks up values at whole and half pixels; NaN outside the image.
struct Lookup {
  const Image<double>& image;

  double operator()(int x_half, int y_half, std::size_t channel) const {
    const int x0 = (x_half - (x_half & 1)) / 2, x1 = x0 + (x_half & 1);
    const int y0 = (y_half - (y_half & 1)) / 2, y1 = y0 + (y_half & 1);
    if (x0 < 0 || y0 < 0 || x1 >= image.width() || y1 >= image.height())
      return std::numeric_limits<double>::quiet_NaN();
    return (image.at(x0, y0)[channel] + image.at(x1, y0)[channel] + image.at(x0, y1)[channel] +
            image.at(x1, y1)[channel]) /
           4;
  }
};

/// Returns the distance in pixels, along rows and columns, of the pixels by which alignment is
/// judged: some 2^20 of them.
int sampling_step(const Image<double>& image) {
  constexpr double enough = 1 << 20;
  const double pixels = 1.0 * image.width() * image.height();
  return std::max(1, static_cast<int>(std::sqrt(pixels / enough)));
}

/// Returns the mean relative difference of sampled values that are finite in both images; infinity
/// if these are fewer than half of them.
double difference(const Image<double>& reference, const Image<double>& other,
                  const Reading& reading) {
  const Lookup lookup{other};
  double sum = 0;
  std::size_t sampled = 0, count = 0;
  const auto channels = static_cast<std::size_t>(reference.channels());
  const int step = sampling_step(reference);
  for (int y = 0; y < reference.height(); y += step) {
    const int from_y = reading.is_y_mirrored ? reference.height() - 1 - y : y;
    for (int x = 0; x < reference.width(); x += step, sampled += channels) {
      const int from_x = reading.is_x_mirrored ? reference.width() - 1 - x : x;
      for (std::size_t k = 0; k < channels; ++k) {
        const double a = reference.at(x, y)[k];
        const double b = lookup(2 * from_x - reading.x_half_px, 2 * from_y - reading.y_half_px, k);
        if (!std::isfinite(a) || !std::isfinite(b)) continue;
        if (a != b) sum += std::abs(a - b) / (std::abs(a) + std::abs(b));
        ++count;
      }
    }
  }
  return 2 * count < sampled || count == 0 ? std::numeric_limits<double>::infinity()
                                           : sum / static_cast<double>(count);
}

// Layers that the tests of light use; they are not compared themselves.
constexpr std::array<std::string_view, 2> test_layers{"StdError", "Samples"};

bool is_of_tests(const ImageLayer& layer) {
  return std::ranges::find(test_layers, layer.name) != test_layers.end();
}

std::string names_of(const ImageFile& file) {
  std::vector<std::string> names;
  for (const ImageLayer& layer : file.layers) names.push_back(layer.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Returns the names of the layers that `file` has and `than` lacks.
std::string alone(const ImageFile& file, const ImageFile& than) {
  std::vector<std::string> names;
  for (const ImageLayer& layer : file.layers) {
    if (than.find(layer.name) == nullptr && !is_of_tests(layer)) names.push_back(layer.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

void say_what(const ImageFile& reference, const ImageFile& other, Section& into) {
  for (const ImageLayer& layer : reference.layers) {
    const ImageLayer* of_other = other.find(layer.name);
    if (of_other != nullptr && of_other->channels != layer.channels) {
      into.text +=
          fmt::format("{} is {} in the reference and {} in the other.\n", layer.name,
                      fmt::join(layer.channels, ", "), fmt::join(of_other->channels, ", "));
    }
  }
  const std::string here = alone(reference, other), there = alone(other, reference);
  if (!here.empty()) into.text += "In the reference alone, not compared: " + here + ".\n";
  if (!there.empty()) into.text += "In the other alone, not compared: " + there + ".\n";
}

/// Warns if the first common layer that shows shapes is much nearer to the reference when shifted
/// or mirrored.
void suspect_alignment(const ImageFile& reference, const ImageFile& other, Section& into) {
  for (const char* name : {"Z", "Distance", "RGB", "Y", "Picture", "N", "Albedo", "P"}) {
    const ImageLayer *a = reference.find(name), *b = other.find(name);
    if (a == nullptr || b == nullptr || a->channels.size() != b->channels.size()) continue;
    if (const auto found = misalignment(a->values, b->values)) {
      into.text += fmt::format(
          "THE OTHER IMAGE SEEMS TO BE MISALIGNED: {}, its {} differs from the reference's by "
          "{:.3g} % on average, unchanged by {:.3g} %. In groundray, pixel centres have integer "
          "coordinates and the first row is at the top.\n",
          found->what, name, 100 * found->difference, 100 * found->as_it_is);
    }
    return;
  }
}

double median_difference(const ImageLayer& a, const ImageLayer& b) {
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.values.values().size(); ++i) {
    const double of_a = a.values.values()[i], of_b = b.values.values()[i];
    if (is_depth(of_a) && is_depth(of_b)) differences.push_back(std::abs(of_a - of_b));
  }
  return quantile(std::move(differences), 0.5);
}

/// Warns if a depth channel seems to hold ranges, or the other way round.
void suspect_meaning(const ImageFile& reference, const ImageFile& other, Section& into) {
  const ImageLayer *depth = reference.find("Z"), *range = reference.find("Distance");
  if (depth == nullptr || range == nullptr) return;
  for (const auto& [name, right, wrong] :
       {std::tuple("Z", depth, range), std::tuple("Distance", range, depth)}) {
    const ImageLayer* of_other = other.find(name);
    if (of_other == nullptr) continue;
    if (median_difference(*wrong, *of_other) < 0.1 * median_difference(*right, *of_other)) {
      into.text += fmt::format(
          "The other's {} is much closer to the reference's {}: Z is measured along the camera's "
          "axis, Distance along the ray. Map the channel accordingly (--channels THEIRS=OURS).\n",
          name, wrong->name);
    }
  }
}

/// Reports the number of range errors that exceed the reference's own certified bound.
void tell_beyond_bound(const ImageFile& reference, const ImageFile& other, Section& into) {
  constexpr double float_rounding = 1.2e-7;  // 2^-23: twice the relative rounding error of a float
  const ImageLayer *range = reference.find("Distance"), *bound = reference.find("Bound"),
                   *of_other = other.find("Distance");
  if (range == nullptr || bound == nullptr || of_other == nullptr) return;
  std::size_t both = 0, beyond = 0;
  for (std::size_t i = 0; i < range->values.values().size(); ++i) {
    const double a = range->values.values()[i], b = of_other->values.values()[i];
    if (!is_depth(a) || !is_depth(b)) continue;
    ++both;
    if (std::abs(a - b) > bound->values.values()[i] + float_rounding * (a + b)) ++beyond;
  }
  if (both == 0) return;
  tell(into, "Distance: errors beyond the reference's own bound", static_cast<double>(beyond),
       "px");
}

constexpr int reach_px = 5;
constexpr std::size_t window_px = 2 * reach_px + 1;

std::array<double, window_px> weights() {
  constexpr double sigma_px = 1.5;
  std::array<double, window_px> result{};
  double sum = 0;
  for (std::size_t i = 0; i < window_px; ++i) {
    const double off_px = static_cast<double>(i) - reach_px;
    sum += result[i] = math::exp(-off_px * off_px / (2 * sigma_px * sigma_px));
  }
  for (double& weight : result) weight /= sum;
  return result;
}

/// Weighted means of a, b, a a, b b and a b.
using Moments = std::array<double, 5>;
constexpr int moments = 5;

/// Returns weighted means along each row. The Gaussian is separable: means along columns follow.
Image<double> along_rows(const Image<double>& a, const Image<double>& b) {
  const auto weight = weights();
  Image<double> result(a.width(), a.height(), moments);
  for (int y = 0; y < a.height(); ++y) {
    for (int x = reach_px; x < a.width() - reach_px; ++x) {
      const auto to = result.at(x, y);
      for (std::size_t i = 0; i < window_px; ++i) {
        const int from = x + static_cast<int>(i) - reach_px;
        const double of_a = a.at(from, y)[0], of_b = b.at(from, y)[0];
        const Moments terms{of_a, of_b, of_a * of_a, of_b * of_b, of_a * of_b};
        for (std::size_t k = 0; k < terms.size(); ++k) to[k] += weight[i] * terms[k];
      }
    }
  }
  return result;
}

double similarity(const Moments& mean, double range) {
  const double c1 = 0.01 * range * 0.01 * range, c2 = 0.03 * range * 0.03 * range;
  const double both = mean[0] * mean[1], squares = mean[0] * mean[0] + mean[1] * mean[1];
  const double variances = mean[2] + mean[3] - squares, covariance = mean[4] - both;
  return (2 * both + c1) * (2 * covariance + c2) / ((squares + c1) * (variances + c2));
}

/// Selects the figures that are shown first: the RMS error of each layer, those that differ before
/// others, then further ones while there is space. The headline states those of all layers.
void write_headline(Section& into) {
  constexpr std::size_t most = 5;
  using Endings = std::array<std::string_view, 3>;
  constexpr std::array<Endings, 4> groups{
      Endings{": RMS error", ": RMS", ": share of equal pixels"},
      Endings{": largest error", ": largest", ": largest"},
      Endings{": mean error", ": mean", ": mean"},
      Endings{": 95th percentile of its size", ": 95th percentile", ": 95th percentile"}};
  std::vector<std::string> parts;
  bool are_equal = true;
  for (const Endings& group : groups) {
    std::vector<std::string> equal;  // figures of layers that do not differ
    for (const Measure& measure : into.measures) {
      const auto ends = [&](std::string_view end) { return measure.name.ends_with(end); };
      if (std::ranges::none_of(group, ends)) continue;
      const bool is_equal = measure.value == (measure.name.ends_with("pixels") ? 100 : 0);
      (is_equal ? equal : into.main).push_back(measure.name);
      if (&group != &groups[0]) continue;
      parts.push_back(fmt::format("{} {:.4g}{}{}", measure.name, measure.value,
                                  measure.unit.empty() ? "" : " ", measure.unit));
      are_equal = are_equal && is_equal;
    }
    std::ranges::move(equal, std::back_inserter(into.main));
  }
  into.main.resize(std::min(into.main.size(), most));
  if (parts.empty()) {
    into.headline = "The images have no value in common.";
  } else {
    into.headline = are_equal ? "All values that both images have are equal."
                              : fmt::format("{}.", fmt::join(parts, "; "));
  }
}

/// @throws Error if the images differ in size.
void check_sizes(const ImageFile& reference, const ImageFile& other) {
  if (reference.size_px != other.size_px) {
    throw Error(
        "it has {} x {} px and the reference {} x {}; both must have the same pixels: render or "
        "crop it to that size (scaling would change the values)",
        other.size_px.x, other.size_px.y, reference.size_px.x, reference.size_px.y);
  }
}

}  // namespace

ImageFile cropped(const ImageFile& image, const PixelBox& box) {
  const glm::ivec2 &first = box.first_px, &size = box.size_px, &whole_px = image.size_px;
  const auto is_in = [](int from, int count, int all) {
    return from >= 0 && count > 0 && from < all && count <= all - from;
  };
  if (!is_in(first.x, size.x, whole_px.x) || !is_in(first.y, size.y, whole_px.y)) {
    throw Error(
        "the pixels {} {} {} {} must be COLUMN ROW WIDTH HEIGHT within the image of {} x {} px, "
        "not empty",
        first.x, first.y, size.x, size.y, whole_px.x, whole_px.y);
  }
  ImageFile result{box.size_px, image.layers};
  for (ImageLayer& layer : result.layers) {
    const Image<double> whole = std::move(layer.values);
    layer.first_px = box.first_px;
    layer.values = Image<double>(size.x, size.y, whole.channels());
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x)
        std::ranges::copy(whole.at(first.x + x, first.y + y), layer.values.at(x, y).begin());
    }
  }
  return result;
}

std::optional<Misalignment> misalignment(const Image<double>& reference,
                                         const Image<double>& other) {
  const double as_it_is = difference(reference, other, {});
  if (!std::isfinite(as_it_is) || as_it_is < nearly_the_same) return std::nullopt;
  Misalignment best{.difference = std::numeric_limits<double>::infinity(), .as_it_is = as_it_is};
  for (const Reading& reading : readings()) {
    const double now = difference(reference, other, reading);
    if (now >= best.difference) continue;
    best.difference = now;
    best.what = reading.what;
  }
  if (best.difference > much_nearer * as_it_is) return std::nullopt;
  return best;
}

Section compare_images(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const ImageOptions& options) {
  ImageFile of_reference = read_image_file(reference, options.reference);
  ImageFile of_other = read_image_file(other, options.other);
  try {
    check_sizes(of_reference, of_other);
    if (options.pixels) {
      of_reference = cropped(of_reference, *options.pixels);
      of_other = cropped(of_other, *options.pixels);
    }
    return compare_images(of_reference, of_other, options.significance,
                          fmt::format("{} against {}", other.string(), reference.string()));
  } catch (const Error& fault) {
    throw Error("{} cannot be compared with {}: {}", other.string(), reference.string(),
                fault.what());
  }
}

Section compare_images(const ImageFile& reference, const ImageFile& other,
                       const Significance& significance, const std::string& title) {
  check_sizes(reference, other);
  Section section;
  section.title = title;
  say_what(reference, other, section);
  bool any = false;
  for (const ImageLayer& layer : reference.layers) {
    const ImageLayer* of_other = other.find(layer.name);
    if (of_other == nullptr || is_of_tests(layer) ||
        of_other->channels.size() != layer.channels.size()) {
      continue;
    }
    any = true;
    compare_layers(layer, *of_other, section);
    if (layer.name == "RGB") match_light(reference, other, significance, section);
  }
  if (!any) {
    throw Error(
        "they have no layer in common: the reference has {}, the other {}; map the channels "
        "(--channels THEIRS=OURS) and give the meaning of a PNG (--png)",
        names_of(reference), names_of(other));
  }
  tell_beyond_bound(reference, other, section);
  suspect_meaning(reference, other, section);
  suspect_alignment(reference, other, section);
  write_headline(section);
  section.verdict = verdict_of(section.measures);
  return section;
}

double structural_similarity(const Image<double>& a, const Image<double>& b, double range) {
  const auto weight = weights();
  const Image<double> rows = along_rows(a, b);
  double sum = 0;
  std::size_t count = 0;
  for (int y = reach_px; y < a.height() - reach_px; ++y) {
    for (int x = reach_px; x < a.width() - reach_px; ++x) {
      Moments mean{};
      for (std::size_t i = 0; i < window_px; ++i) {
        const auto row = rows.at(x, y + static_cast<int>(i) - reach_px);
        for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += weight[i] * row[k];
      }
      const double here = similarity(mean, range);
      if (!std::isfinite(here)) continue;
      sum += here;
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace groundray::golden
