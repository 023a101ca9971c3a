#include "apps/golden/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string_view>
#include <utility>

#include "apps/golden/html_text.h"
#include "core/image/png_io.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

constexpr double font_px = 11;
constexpr double tick_px = 4;  // length of the mark at an axis
constexpr std::string_view text_colour = "#57606a", line_colour = "#8c959f",
                           grid_colour = "#eaeef2";

/// Rectangle of a chart within its SVG element, in px.
struct Frame {
  double left = 0, top = 0, width = 0, height = 0;

  double right() const { return left + width; }
  double bottom() const { return top + height; }
};

/// Builds an SVG element part by part.
class Svg {
 public:
  Svg(double width, double height, const std::string& title) {
    add("<svg width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" role=\"img\" "
        "xmlns=\"http://www.w3.org/2000/svg\">\n<title>{2}</title>\n",
        width, height, escaped(title));
  }
  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
  }
  void add_text(double x, double y, std::string_view anchor, const std::string& text) {
    add("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" fill=\"{}\" "
        "text-anchor=\"{}\">{}</text>\n",
        x, y, font_px, text_colour, anchor, escaped(text));
  }
  /// Adds a text that reads upwards, centred at a point.
  void add_upright(double x, double y, const std::string& text) {
    add("<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" font-size=\"{}\" fill=\"{}\" "
        "text-anchor=\"middle\">{}</text>\n",
        x, y, font_px, text_colour, escaped(text));
  }
  void add_line(double x, double y, double dx, double dy, std::string_view colour) {
    add("<path stroke=\"{}\" fill=\"none\" d=\"M{:.1f} {:.1f}l{:.1f} {:.1f}\"/>\n", colour, x, y,
        dx, dy);
  }
  std::string done() {
    add("</svg>\n");
    return std::move(text_);
  }

 private:
  std::string text_;
};

void add_across(const Axis& axis, const Frame& frame, Svg& svg) {
  constexpr double px_each = 75;
  const auto most = std::max(2, static_cast<int>(frame.width / px_each));
  const Ticks ticks = ticks_between(axis.low, axis.high, most);
  for (const double tick : ticks.values) {
    const double x = frame.left + frame.width * (tick - axis.low) / (axis.high - axis.low);
    svg.add_line(x, frame.bottom(), 0, tick_px, line_colour);
    svg.add_text(x, frame.bottom() + tick_px + font_px, "middle", tick_text(tick, ticks.step));
  }
  svg.add_text(frame.left + frame.width / 2, frame.bottom() + 32, "middle", axis.label);
}

/// Returns the largest number of ticks of the vertical axis.
int ticks_up(const Frame& frame) {
  constexpr double px_each = 28;
  return std::max(2, static_cast<int>(frame.height / px_each));
}

/// Adds the vertical axis; its label is centred at `label_x`.
void add_up(const Axis& axis, const Frame& frame, double label_x, Svg& svg) {
  const Ticks ticks = ticks_between(axis.low, axis.high, ticks_up(frame));
  for (const double tick : ticks.values) {
    const double y = frame.bottom() - frame.height * (tick - axis.low) / (axis.high - axis.low);
    svg.add_line(frame.left - tick_px, y, tick_px, 0, line_colour);
    svg.add_text(frame.left - tick_px - 3, y + 4, "end", tick_text(tick, ticks.step));
  }
  svg.add_upright(label_x, frame.top + frame.height / 2, axis.label);
}

std::string css(const Colour& colour) {
  const auto byte = [](double v) { return std::lround(std::clamp(v, 0.0, 1.0) * 255); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(colour.x), byte(colour.y), byte(colour.z));
}

/// Adds a bar of colours at the place of `frame`, and its marks and label right of it.
void add_bar(const ColourBar& bar, const Frame& frame, Svg& svg) {
  const double step = frame.height / static_cast<double>(bar.colours.size());
  for (std::size_t i = 0; i < bar.colours.size(); ++i) {
    svg.add("<rect x=\"{:.1f}\" y=\"{:.2f}\" width=\"{:.1f}\" height=\"{:.2f}\" fill=\"{}\"/>\n",
            frame.left, frame.bottom() - step * static_cast<double>(i + 1), frame.width, step + 0.5,
            css(bar.colours[i]));
  }
  for (const auto& [share, text] : bar.marks) {
    const double y = frame.bottom() - frame.height * share;
    svg.add_line(frame.right(), y, tick_px, 0, line_colour);
    svg.add_text(frame.right() + tick_px + 2, y + 4, "start", text);
  }
  svg.add_upright(frame.right() + 72, frame.top + frame.height / 2, bar.label);
}

/// Returns the factor that enlarges a picture to at least some 300 px.
int enlargement(const Image8& image) {
  constexpr int enough_px = 300;
  const int size_px = std::max({image.width(), image.height(), 1});
  return std::max(1, (enough_px + size_px - 1) / size_px);
}

}  // namespace

Ticks ticks_between(double a, double b, int most) {
  const auto [low, high] = std::minmax(a, b);
  if (!(high > low) || !std::isfinite(high - low)) return {};
  const double raw = (high - low) / most;
  const double decade = math::pow(10.0, std::floor(math::log10(raw)));
  for (const double digit : {1.0, 2.0, 5.0, 10.0, 20.0}) {
    const double step = digit * decade;
    const double slack = 1e-9 * (high - low) / step;
    const double first = std::ceil(low / step - slack), last = std::floor(high / step + slack);
    if (last - first + 1 > most) continue;
    Ticks ticks{.values = {}, .step = step};
    for (double k = first; k <= last; ++k) ticks.values.push_back(k * step);
    return ticks;
  }
  return {};
}

std::string tick_text(double value, double step) {
  if (std::abs(value) >= 1e7 || (value != 0 && step < 1e-4)) return number_text(value);
  const auto decimals = static_cast<int>(std::max(0.0, std::ceil(-math::log10(step) - 1e-9)));
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.starts_with('-'))
    text.replace(0, 1, text.find_first_not_of("-0.") < text.size() ? "−" : "");
  return text;
}

std::string histogram_svg(const Histogram& histogram) {
  const Frame frame{.left = 72, .top = 10, .width = 420, .height = 140};
  Svg svg(510, 215, histogram.title);
  const auto& counts = histogram.counts;
  const std::uint64_t most = counts.empty() ? 0 : *std::ranges::max_element(counts);
  for (const double tick : ticks_between(0, static_cast<double>(most), ticks_up(frame)).values) {
    const double y = frame.bottom() - frame.height * tick / static_cast<double>(most);
    svg.add_line(frame.left, y, frame.width, 0, grid_colour);
  }
  svg.add("<path fill=\"#2f6f9f\" d=\"");
  const double step = frame.width / static_cast<double>(std::max<std::size_t>(counts.size(), 1));
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    const double tall = frame.height * static_cast<double>(counts[i]) / static_cast<double>(most);
    svg.add("M{:.2f} {:.2f}v-{:.2f}h{:.2f}v{:.2f}z", frame.left + step * static_cast<double>(i),
            frame.bottom(), tall, step * 0.92, tall);
  }
  svg.add("\"/>\n");
  svg.add_line(frame.left, frame.bottom(), frame.width, 0, line_colour);
  svg.add_line(frame.left, frame.top, 0, frame.height, line_colour);
  const std::string unit = histogram.unit.empty() ? "" : ", " + histogram.unit;
  add_across({histogram.title + unit, histogram.low, histogram.high}, frame, svg);
  add_up({histogram.counted, 0, static_cast<double>(most)}, frame, 14, svg);
  if (histogram.below > 0)
    svg.add_text(frame.left, frame.bottom() + 50, "start",
                 fmt::format("{} below", histogram.below));
  if (histogram.above > 0)
    svg.add_text(frame.right(), frame.bottom() + 50, "end",
                 fmt::format("{} above", histogram.above));
  return svg.done();
}

std::string picture_svg(const Picture& picture) {
  const int scale = enlargement(picture.image);
  const Frame frame{.left = picture.up ? 78.0 : 1.0,
                    .top = 10,
                    .width = 1.0 * scale * picture.image.width(),
                    .height = 1.0 * scale * picture.image.height()};
  const double right = picture.bar ? 122 : 24, below = picture.across ? 40 : 10;
  Svg svg(frame.right() + right, frame.bottom() + below, picture.caption);
  svg.add(
      "<image x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" "
      "preserveAspectRatio=\"none\" href=\"data:image/png;base64,{}\"/>\n",
      frame.left, frame.top, frame.width, frame.height,
      base64(png_bytes(picture.image, picture.caption)));
  svg.add(
      "<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" fill=\"none\" "
      "stroke=\"{}\"/>\n",
      frame.left, frame.top, frame.width, frame.height, line_colour);
  if (picture.across) add_across(*picture.across, frame, svg);
  if (picture.up) add_up(*picture.up, frame, 12, svg);
  constexpr double bar_px = 14, most_px = 260;
  const double tall = std::min(frame.height, most_px);
  if (picture.bar) {
    add_bar(*picture.bar, {frame.right() + 16, frame.top + (frame.height - tall) / 2, bar_px, tall},
            svg);
  }
  return svg.done();
}

}  // namespace groundray::golden
