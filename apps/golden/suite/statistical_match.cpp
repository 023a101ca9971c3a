#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/images/difference_picture.h"
#include "apps/golden/compare/images/image_comparison.h"
#include "apps/golden/suite/checks.h"
#include "core/error.h"

namespace groundray::golden {
namespace {

constexpr double significance = 0.01;  // of each kind of test, as in Mitsuba's tests
// Relative rounding of a mean and an image stored as floats; smaller differences count as none.
constexpr double float_rounding = 2.4e-7;

const Columns::Column& required_column(const Columns& columns, const std::string& name) {
  const Columns::Column* column = columns.find(name);
  if (column == nullptr) throw Error("there is no column {}", name);
  return *column;
}

// Rejects means and variances that are not finite, and negative variances.
void refuse_unsound(const Columns::Column& column) {
  const bool is_variance = column.name.starts_with("Variance_");
  for (const double value : column.values) {
    if (!std::isfinite(value) || (is_variance && value < 0))
      throw Error("{} has the value {}: means must be finite, variances finite and not negative",
                  column.name, value);
  }
}

struct Channel {
  const std::vector<double>&actual, &mean, &variance;
  glm::ivec2 size_px;

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(size_px.x) +
           static_cast<std::size_t>(x);
  }

  // Returns the magnitude of the error of the mean over a block of pixels, in standard deviations;
  // these include the variance of the stored mean.
  double deviations(int x0, int y0, int x1, int y1) const {
    double off = 0, variances = 0, light = 0;
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const std::size_t i = index(x, y);
        off += actual[i] - mean[i];
        variances += variance[i];
        light += std::abs(mean[i]);
      }
    }
    const double rounding = float_rounding * light;
    if (!(std::abs(off) > rounding)) return std::isnan(off) ? INFINITY : 0;
    return std::abs(off) /
           std::sqrt(variances * (1 + 1.0 / statistical_runs) + rounding * rounding);
  }
};

// Returns the smallest relative error of all of a channel's light that the test of its mean
// detects.
double noticeable_share(const Channel& channel, double limit) {
  double light = 0, variances = 0;
  for (std::size_t i = 0; i < channel.mean.size(); ++i) {
    light += channel.mean[i];
    variances += channel.variance[i];
  }
  return limit * std::sqrt(variances * (1 + 1.0 / statistical_runs)) / light;
}

std::size_t blocks_along(int pixels) {
  return static_cast<std::size_t>((pixels + block_px - 1) / block_px);
}

double largest_of_blocks(const Channel& channel) {
  double largest = 0;
  for (int y = 0; y < channel.size_px.y; y += block_px) {
    for (int x = 0; x < channel.size_px.x; x += block_px) {
      largest =
          std::max(largest, channel.deviations(x, y, std::min(x + block_px, channel.size_px.x),
                                               std::min(y + block_px, channel.size_px.y)));
    }
  }
  return largest;
}

Image<double> image_of(const std::vector<double>& values, glm::ivec2 size_px) {
  Image<double> image(size_px.x, size_px.y, 1);
  std::ranges::copy(values, image.values().begin());
  return image;
}

void draw_channel(const std::string& name, const Channel& channel,
                  const std::vector<double>& deviations, Section& into) {
  const auto [low, high] = finite_range(channel.mean);
  tell(into, name + ": structural similarity, an aid to the eye",
       structural_similarity(image_of(channel.mean, channel.size_px),
                             image_of(channel.actual, channel.size_px), high - low));
  into.pictures.push_back({fmt::format("{}: expected mean, {:.4g} to {:.4g}", name, low, high),
                           false_colour(channel.mean, channel.size_px, low, high)});
  into.pictures.push_back(
      {name + ": actual", false_colour(channel.actual, channel.size_px, low, high)});
  into.pictures.push_back({name + ": standard deviations off, 0 to 6",
                           false_colour(deviations, channel.size_px, 0, 6)});
  into.histograms.push_back(histogram_of(name + ": standard deviations off", "", deviations, 0, 8));
}

}  // namespace

void Moments::add(const Columns& product) {
  if (product.size_px.x == 0) throw Error("it is not an image");
  if (runs_ == 0) {
    mean_ = {.rows = product.rows, .all = {}, .size_px = product.size_px};
    for (const std::string& name : names_) {
      for (const char* what : {"Mean_", "Variance_"})
        mean_.all.push_back({what + name, std::vector<double>(product.rows), Stored::Float});
    }
  }
  if (product.size_px != mean_.size_px) throw Error("its size differs from run to run");
  ++runs_;
  for (std::size_t k = 0; k < names_.size(); ++k) {
    const auto& values = required_column(product, names_[k]).values;
    auto& means = mean_.all[2 * k].values;
    auto& squares = mean_.all[2 * k + 1].values;
    for (std::size_t i = 0; i < values.size(); ++i) {  // Welford (1962)
      const double off = values[i] - means[i];
      means[i] += off / runs_;
      squares[i] += off * (values[i] - means[i]);
    }
  }
}

Columns Moments::columns() const {
  Columns columns = mean_;
  for (std::size_t k = 1; k < columns.all.size(); k += 2) {
    for (double& value : columns.all[k].values) value /= runs_ - 1;
  }
  for (const Columns::Column& column : columns.all) refuse_unsound(column);
  return columns;
}

void check_statistically(const StatisticalCheck& check, const std::string& because,
                         const Columns& image, const Columns& moments, Section& into) {
  if (image.size_px != moments.size_px || image.size_px.x == 0) {
    throw Error("it is {} x {} px; the stored image is {} x {} px", image.size_px.x,
                image.size_px.y, moments.size_px.x, moments.size_px.y);
  }
  const std::size_t tests = image.rows * check.columns.size();
  const double limit = student_limit(significance, tests, statistical_runs - 1);
  const std::size_t blocks =
      blocks_along(image.size_px.x) * blocks_along(image.size_px.y) * check.columns.size();
  std::size_t beyond = 0;
  double of_blocks = 0, of_channels = 0;
  for (const std::string& name : check.columns) {
    const Channel channel{required_column(image, name).values,
                          required_column(moments, "Mean_" + name).values,
                          required_column(moments, "Variance_" + name).values, image.size_px};
    refuse_unsound(required_column(moments, "Mean_" + name));
    refuse_unsound(required_column(moments, "Variance_" + name));
    std::vector<double> deviations(image.rows);
    for (int y = 0; y < image.size_px.y; ++y) {
      for (int x = 0; x < image.size_px.x; ++x)
        deviations[channel.index(x, y)] = channel.deviations(x, y, x + 1, y + 1);
    }
    beyond += static_cast<std::size_t>(
        std::ranges::count_if(deviations, [&](double value) { return value > limit; }));
    of_blocks = std::max(of_blocks, largest_of_blocks(channel));
    of_channels = std::max(of_channels, channel.deviations(0, 0, image.size_px.x, image.size_px.y));
    tell(into, name + ": would be noticed if all of it were off by",
         100 * noticeable_share(channel, normal_limit(significance, check.columns.size())), "%");
    draw_channel(name, channel, deviations, into);
  }
  hold(into, fmt::format("values more than {:.2f} standard deviations off", limit),
       static_cast<double>(beyond), fmt::format("of {}", tests),
       std::floor(static_cast<double>(tests) * (1 - check.share) * (1 + 1e-12)), because);
  hold(into, fmt::format("worst of {} blocks of 8 x 8 pixels", blocks), of_blocks,
       "standard deviations", normal_limit(significance, blocks), because);
  hold(into, "worst mean of a channel", of_channels, "standard deviations",
       normal_limit(significance, check.columns.size()), because);
}

}  // namespace groundray::golden
