#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/images/difference_picture.h"
#include "apps/golden/compare/images/image_comparison.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

using Pixel = std::span<const double>;

bool is_finite(Pixel pixel) {
  return std::ranges::all_of(pixel, [](double value) { return std::isfinite(value); });
}

double distance(Pixel a, Pixel b) {
  double squares = 0;
  for (std::size_t k = 0; k < a.size(); ++k) squares += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(squares);
}

/// Errors of the pixels that have a value in both images.
struct Errors {
  Image<double> image;  ///< NaN where either image has no value
  std::vector<double> all;
  std::vector<std::size_t> pixels;  ///< pixel index of each error
  std::size_t only_reference = 0, only_other = 0;

  glm::ivec2 place(std::size_t error) const {
    const auto pixel = static_cast<int>(pixels[error]);
    return {pixel % image.width(), pixel / image.width()};
  }
};

/// Returns the errors of all pixels that have a value in both layers.
/// @param is_there  returns true if a pixel has a value.
/// @param error  returns the error of the other's pixel, its second argument.
Errors errors_of(const ImageLayer& reference, const ImageLayer& other,
                 const std::function<bool(Pixel)>& is_there,
                 const std::function<double(Pixel, Pixel)>& error) {
  Errors errors;
  errors.image = Image<double>(reference.values.width(), reference.values.height(), 1);
  std::size_t index = 0;
  for (int y = 0; y < errors.image.height(); ++y) {
    for (int x = 0; x < errors.image.width(); ++x, ++index) {
      const Pixel a = reference.values.at(x, y), b = other.values.at(x, y);
      const bool in_a = is_there(a), in_b = is_there(b);
      double& to = errors.image.at(x, y)[0];
      to = std::numeric_limits<double>::quiet_NaN();
      if (in_a && !in_b) ++errors.only_reference;
      if (in_b && !in_a) ++errors.only_other;
      if (!in_a || !in_b) continue;
      to = error(a, b);
      errors.all.push_back(to);
      errors.pixels.push_back(index);
    }
  }
  return errors;
}

/// Reports the numbers of pixels with a value in both images and in only one.
/// @return true if any pixel has a value in both; otherwise the section states so and, unless
///         neither image has a value, fails.
bool tell_presence(const std::string& name, const Errors& errors, Section& into) {
  const std::size_t alone = errors.only_reference + errors.only_other;
  if (errors.all.empty() && alone > 0) {
    fail(into, name + ": in both", 0, "px", "nothing is compared without a common pixel");
  } else {
    tell(into, name + ": in both", static_cast<double>(errors.all.size()), "px");
  }
  tell(into, name + ": in the reference alone", static_cast<double>(errors.only_reference), "px");
  tell(into, name + ": in the other alone", static_cast<double>(errors.only_other), "px");
  if (!errors.all.empty()) return true;
  into.text +=
      name + (alone > 0
                  ? ": the images have no pixel in common, so there are no errors to report.\n"
                  : ": neither image has a value, so there are no errors to report.\n");
  return false;
}

void say_worst(const ImageLayer& reference, const ImageLayer& other, const Errors& errors,
               Section& into) {
  const glm::ivec2 at = errors.place(figures_of(errors.all).worst);
  if (errors.image.at(at.x, at.y)[0] == 0) return;
  const auto text = [&](const ImageLayer& layer) {
    std::string values;
    for (const double value : layer.values.at(at.x, at.y)) values += fmt::format(" {:.6g}", value);
    return values;
  };
  into.text +=
      fmt::format("{}: the largest error is in column {}, row {}:{} where the reference has{}.\n",
                  reference.name, reference.first_px.x + at.x, reference.first_px.y + at.y,
                  text(other), text(reference));
}

double share_percent(const std::vector<double>& values, const std::function<bool(double)>& is) {
  return 100.0 * static_cast<double>(std::ranges::count_if(values, is)) /
         static_cast<double>(values.size());
}

/// Warns if the median ratio of depths suggests different units.
void suspect_unit(const std::string& name, const std::vector<double>& ratios, Section& into) {
  const double ratio = quantile(ratios, 0.5);
  if (0.02 < ratio && ratio < 50) return;
  into.text += fmt::format(
      "{} of the other is {:.4g} times the reference's at the median: is it in another unit? Give "
      "its unit (--depth-unit-m 0.001 for millimetres; --reference-depth-unit-m for the "
      "reference).\n",
      name, ratio);
}

void compare_depths(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  const std::string& name = reference.name;
  const auto is_there = [](Pixel pixel) { return is_depth(pixel[0]); };
  const Errors errors =
      errors_of(reference, other, is_there, [](Pixel a, Pixel b) { return b[0] - a[0]; });
  if (!tell_presence(name, errors, into)) return;
  tell_errors(into, name, "m", errors.all);
  std::vector<double> relative, ratios;
  for (std::size_t i = 0; i < errors.all.size(); ++i) {
    const double depth_m = reference.values.values()[errors.pixels[i]];
    relative.push_back(100 * errors.all[i] / std::abs(depth_m));
    ratios.push_back((depth_m + errors.all[i]) / depth_m);
  }
  const ErrorFigures figures = figures_of(relative);
  tell(into, name + ": mean relative error", figures.mean, "%");
  tell(into, name + ": RMS relative error", figures.rms, "%");
  tell(into, name + ": median size of relative error", figures.median_size, "%");
  tell(into, name + ": share of errors beyond 1 %",
       share_percent(relative, [](double percent) { return std::abs(percent) > 1; }), "%");
  say_worst(reference, other, errors, into);
  suspect_unit(name, ratios, into);
  draw_layers(reference, other, errors.image, " m", into);
}

double angle_deg(Pixel a, Pixel b) {
  const glm::dvec3 u(a[0], a[1], a[2]), v(b[0], b[1], b[2]);
  return glm::degrees(math::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v)));
}

void compare_normals(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  const std::string& name = reference.name;
  const Errors errors = errors_of(
      reference, other, [](Pixel pixel) { return is_finite(pixel) && length_of(pixel) > 0; },
      angle_deg);
  if (!tell_presence(name, errors, into)) return;
  tell_sizes(into, name + ": angle", "deg", errors.all);
  tell(into, name + ": share of angles beyond 1 deg",
       share_percent(errors.all, [](double angle) { return angle > 1; }), "%");
  const double flipped = share_percent(errors.all, [](double angle) { return angle > 90; });
  tell(into, name + ": share on the other side", flipped, "%");
  say_worst(reference, other, errors, into);
  const double median = quantile(errors.all, 0.5);
  if (median > 150) {
    into.text += name +
                 ": the other's normals point to the opposite side; groundray's point to the "
                 "visible side.\n";
  } else if (median > 20) {
    into.text += name +
                 ": do both use the same axes? groundray's normals are in the world frame (east, "
                 "north, up), not in the camera's.\n";
  }
  draw_layers(reference, other, errors.image, " deg", into);
}

/// Returns the luminance (Rec. 709) of a layer of three channels, else its first channel.
Image<double> luminance_of(const ImageLayer& layer) {
  Image<double> result(layer.values.width(), layer.values.height(), 1);
  for (int y = 0; y < result.height(); ++y) {
    for (int x = 0; x < result.width(); ++x) {
      const Pixel pixel = layer.values.at(x, y);
      result.at(x, y)[0] =
          pixel.size() == 3 ? 0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2] : pixel[0];
    }
  }
  return result;
}

/// Adds a table of the means and errors of each channel.
void tell_channels(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  Table table{reference.name + " by channel",
              {"channel", "mean of reference", "mean of other", "mean error", "RMS error"},
              {}};
  for (std::size_t k = 0; k < reference.channels.size(); ++k) {
    double sum = 0;
    std::vector<double> errors;
    const auto a = reference.values.values(), b = other.values.values();
    for (std::size_t i = k; i < a.size(); i += reference.channels.size()) {
      if (!std::isfinite(a[i]) || !std::isfinite(b[i])) continue;
      sum += a[i];
      errors.push_back(b[i] - a[i]);
    }
    const ErrorFigures figures = figures_of(errors);
    const double mean = sum / static_cast<double>(errors.size());
    table.rows.push_back({reference.channels[k], fmt::format("{:.6g}", mean),
                          fmt::format("{:.6g}", mean + figures.mean),
                          fmt::format("{:.6g}", figures.mean), fmt::format("{:.6g}", figures.rms)});
  }
  into.tables.push_back(std::move(table));
}

void compare_colours(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  const std::string& name = reference.name;
  const auto mean_error = [](Pixel a, Pixel b) {
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += b[k] - a[k];
    return sum / static_cast<double>(a.size());
  };
  const Errors errors = errors_of(reference, other, is_finite, mean_error);
  if (!tell_presence(name, errors, into)) return;
  std::vector<double> each, light;
  double sum = 0, sum_of_other = 0;
  for (const std::size_t pixel : errors.pixels) {
    for (std::size_t k = 0; k < reference.channels.size(); ++k) {
      const std::size_t i = pixel * reference.channels.size() + k;
      const double a = reference.values.values()[i], b = other.values.values()[i];
      each.push_back(b - a);
      light.push_back(a);
      sum += a;
      sum_of_other += b;
    }
  }
  tell_errors(into, name, "", each);
  if (sum != 0) tell(into, name + ": mean of other by mean of reference", sum_of_other / sum);
  const double white = name == "Picture" ? 1 : quantile(light, 0.99);
  if (white > 0) {
    tell(into, fmt::format("{}: PSNR, white being {:.4g}", name, white),
         20 * math::log10(white / figures_of(each).rms), "dB");
    tell(into, name + ": structural similarity (SSIM) of luminance, an aid to the eye",
         structural_similarity(luminance_of(reference), luminance_of(other), white));
  }
  tell_channels(reference, other, into);
  say_worst(reference, other, errors, into);
  draw_layers(reference, other, errors.image, "", into);
}

void compare_flows(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  const std::string& name = reference.name;
  const Errors errors = errors_of(reference, other, is_finite, distance);
  if (!tell_presence(name, errors, into)) return;
  tell_sizes(into, name + ": end-point error", "px", errors.all);
  std::size_t outliers = 0;
  double reversed_px = 0, error_px = 0;
  for (std::size_t i = 0; i < errors.all.size(); ++i) {
    const glm::ivec2 at = errors.place(i);
    const Pixel a = reference.values.at(at.x, at.y), b = other.values.at(at.x, at.y);
    if (errors.all[i] > 3 && errors.all[i] > 0.05 * length_of(a)) ++outliers;
    reversed_px += math::hypot(a[0] + b[0], a[1] + b[1]);
    error_px += errors.all[i];
  }
  const auto count = static_cast<double>(errors.all.size());
  tell(into, name + ": outliers as KITTI has them (Fl: beyond 3 px and 5 %)",
       100 * static_cast<double>(outliers) / count, "%");
  say_worst(reference, other, errors, into);
  if (reversed_px < 0.5 * error_px)
    into.text += name + ": the other's flow is closer to the reference with its sign reversed.\n";
  draw_layers(reference, other, errors.image, " px", into);
}

void tell_confusions(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  constexpr std::size_t most_rows = 12;
  std::map<std::pair<double, double>, std::size_t> counts;
  for (std::size_t i = 0; i < reference.values.values().size(); ++i) {
    const double a = reference.values.values()[i], b = other.values.values()[i];
    if (a != b) ++counts[{a, b}];
  }
  std::vector<std::pair<std::pair<double, double>, std::size_t>> sorted(counts.begin(),
                                                                        counts.end());
  std::ranges::stable_sort(sorted, std::greater{}, [](const auto& entry) { return entry.second; });
  sorted.resize(std::min(sorted.size(), most_rows));
  if (sorted.empty()) return;
  Table table{reference.name + ": most frequent confusions", {"reference", "other", "pixels"}, {}};
  for (const auto& entry : sorted) {
    table.rows.push_back({fmt::format("{}", entry.first.first),
                          fmt::format("{}", entry.first.second), fmt::format("{}", entry.second)});
  }
  into.tables.push_back(std::move(table));
}

void compare_labels(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  const Errors errors = errors_of(
      reference, other, [](Pixel) { return true; },
      [](Pixel a, Pixel b) { return a[0] == b[0] ? 0.0 : 1.0; });
  const double different = share_percent(errors.all, [](double error) { return error > 0; });
  tell(into, reference.name + ": share of equal pixels", 100 - different, "%");
  tell_confusions(reference, other, into);
  if (different > 0)
    draw_differences(reference.name + ": where labels differ", errors.image, "", into);
}

std::string unit_of(const std::string& layer) {
  if (layer == "P" || layer == "Bound") return "m";
  if (layer == "Velocity") return "m/s";
  return layer == "Incidence" ? "rad" : "";
}

void compare_numbers(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  const std::string &name = reference.name, unit = unit_of(name);
  const bool is_vector = reference.channels.size() > 1;
  const Errors errors = errors_of(reference, other, is_finite, [&](Pixel a, Pixel b) {
    return is_vector ? distance(a, b) : b[0] - a[0];
  });
  if (!tell_presence(name, errors, into)) return;
  if (is_vector) {
    tell_sizes(into, name + ": difference", unit, errors.all);
  } else {
    tell_errors(into, name, unit, errors.all);
  }
  say_worst(reference, other, errors, into);
  if (figures_of(errors.all).largest > 0)
    draw_differences(name + ": other less reference", errors.image,
                     unit.empty() ? unit : " " + unit, into);
}

void compare_by_kind(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  switch (reference.kind) {
    case LayerKind::Depth:
      return compare_depths(reference, other, into);
    case LayerKind::Normal:
      return compare_normals(reference, other, into);
    case LayerKind::Colour:
      return compare_colours(reference, other, into);
    case LayerKind::Flow:
      return compare_flows(reference, other, into);
    case LayerKind::Label:
      return compare_labels(reference, other, into);
    case LayerKind::Number:
      return compare_numbers(reference, other, into);
  }
}

}  // namespace

void compare_layers(const ImageLayer& reference, const ImageLayer& other, Section& into) {
  const std::size_t before = into.pictures.size();
  compare_by_kind(reference, other, into);
  add_pixel_axes(reference, std::span(into.pictures).subspan(before));
}

}  // namespace groundray::golden
