#include "apps/golden/compare/images/image_comparison.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <tuple>
#include <vector>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/images/image_alignment.h"
#include "apps/golden/compare/images/layer_comparison.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

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

}  // namespace

Section compare_images(const std::filesystem::path& reference, const std::filesystem::path& other,
                       const ImageOptions& options) {
  const ImageFile of_reference = read_image_file(reference, options.reference);
  const ImageFile of_other = read_image_file(other, options.other);
  try {
    return compare_images(of_reference, of_other, options.significance,
                          fmt::format("{} against {}", other.string(), reference.string()));
  } catch (const Error& fault) {
    throw Error("{} cannot be compared with {}: {}", other.string(), reference.string(),
                fault.what());
  }
}

Section compare_images(const ImageFile& reference, const ImageFile& other,
                       const Significance& significance, const std::string& title) {
  if (reference.size_px != other.size_px) {
    throw Error(
        "it has {} x {} px and the reference {} x {}; both must have the same pixels: render or "
        "crop it to that size (scaling would change the values)",
        other.size_px.x, other.size_px.y, reference.size_px.x, reference.size_px.y);
  }
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
  section.verdict = verdict_of(section.measures);
  return section;
}

}  // namespace groundray::golden
