#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/golden/report.h"
#include "core/image/png_io.h"
#include "core/io/file_io.h"

namespace groundray::golden {
namespace {

constexpr std::string_view style = R"(
:root { color-scheme: light; }
body { font: 15px/1.45 system-ui, sans-serif; color: #1b1f24; background: #fff;
  max-width: 76rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin: 0 0 .4rem; }
h3 { font-size: 1rem; margin: 1rem 0 .3rem; }
section { border-top: 1px solid #d0d7de; margin-top: 2rem; padding-top: 1rem; }
table { border-collapse: collapse; margin: .6rem 0; }
th, td { text-align: left; vertical-align: top; padding: .2rem .7rem .2rem 0;
  border-bottom: 1px solid #eaeef2; }
th { font-weight: 600; border-bottom-color: #8c959f; }
th.n { text-align: right; }
td.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
td.why, figcaption, .facts th { color: #57606a; }
.text { white-space: pre-line; max-width: 60rem; }
.v { white-space: nowrap; font-weight: 600; font-size: .85em; border-radius: .6em; padding: .05em .6em; }
.passed { color: #10602a; background: #d7f5df; } .failed { color: #9b1420; background: #ffdcdc; }
.told { color: #57606a; background: #eaeef2; }
.row { display: flex; flex-wrap: wrap; gap: .6rem 2.4rem; align-items: flex-start; }
.small { max-width: 24rem; }
figure { margin: .6rem 0; max-width: 100%; }
figure img { max-width: 100%; min-width: 15rem; border: 1px solid #d0d7de; image-rendering: pixelated; }
figcaption { font-size: .87em; max-width: 34rem; }
svg { max-width: 100%; height: auto; } svg text { font-family: system-ui, sans-serif; }
@media print { body { margin: 0; max-width: none; font-size: 10pt; }
  figure, tr, svg, .small { break-inside: avoid; } h2, h3 { break-after: avoid; }
  .v { border: 1px solid currentColor; } }
)";

std::string escaped(std::string_view text) {
  constexpr std::string_view special = "&<>\"'";
  constexpr std::array entities{"&amp;", "&lt;", "&gt;", "&quot;", "&#39;"};
  std::string result;
  for (const char c : text) {
    if (const std::size_t place = special.find(c); place != std::string_view::npos) {
      result += entities[place];
    } else {  // HTML permits no other control characters
      result += static_cast<unsigned char>(c) < ' ' && c != '\n' && c != '\t' ? ' ' : c;
    }
  }
  return result;
}

std::string number(double value) {
  if (std::isnan(value)) return "not a number";
  if (std::isinf(value)) return value < 0 ? "−∞" : "∞";
  std::string text = value == std::floor(value) && std::abs(value) < 1e9
                         ? fmt::format("{:.0f}", value)
                         : fmt::format("{:.5g}", value);
  if (text == "-0") text = "0";
  if (text.starts_with('-')) text.replace(0, 1, "−");
  return text;
}

std::string badge(Verdict verdict) {
  constexpr std::array texts{"passed", "FAILED", "for information"};
  return fmt::format("<span class=\"v {}\">{}</span>", word_of(verdict),
                     texts[static_cast<std::size_t>(verdict)]);
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string result;
  result.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      result += k <= count ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return result;
}

/// Builds the page part by part.
class Page {
 public:
  std::string of(const Report& report) {
    add("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
        "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<h1>{}</h1>\n",
        escaped(report.title), style, escaped(report.title));
    add_facts(report);
    add_summary(report);
    for (std::size_t i = 0; i < report.sections.size(); ++i) add_section(report.sections[i], i);
    add("</body>\n</html>\n");
    return std::move(html_);
  }

 private:
  template <typename... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(html_), format, std::forward<Args>(args)...);
  }

  void add_facts(const Report& report) {
    if (report.facts.empty()) return;
    add("<table class=\"facts\">\n");
    for (const auto& fact : report.facts)
      add("<tr><th>{}</th><td>{}</td></tr>\n", escaped(fact.first), escaped(fact.second));
    add("</table>\n");
  }

  void add_summary(const Report& report) {
    if (report.sections.empty()) return;
    add("<table>\n<thead><tr><th>what</th><th>verdict</th><th>figures within their limits</th>"
        "</tr></thead>\n<tbody>\n");
    for (std::size_t i = 0; i < report.sections.size(); ++i) {
      const Section& section = report.sections[i];
      const auto count = [&](Verdict verdict) {
        return std::ranges::count(section.measures, verdict, &Measure::verdict);
      };
      const auto passed = count(Verdict::Passed), failed = count(Verdict::Failed);
      add("<tr><td><a href=\"#s{}\">{}</a></td><td>{}</td><td class=\"n\">{}</td></tr>\n", i + 1,
          escaped(section.title), badge(section.verdict),
          passed + failed > 0 ? fmt::format("{} of {}", passed, passed + failed) : "");
    }
    add("</tbody>\n</table>\n");
  }

  void add_section(const Section& section, std::size_t index) {
    add("<section id=\"s{}\">\n<h2>{} {}</h2>\n", index + 1, escaped(section.title),
        badge(section.verdict));
    if (!section.text.empty()) add("<p class=\"text\">{}</p>\n", escaped(section.text));
    add_measures(section);
    for (const Table& table : section.tables) add_table(table);
    add_figures(section);
    add("</section>\n");
  }

  /// Adds figures with a limit or verdict in one table, the others in small tables by the prefix of
  /// their names.
  void add_measures(const Section& section) {
    const auto is_held = [](const Measure& measure) {
      return measure.limit || measure.verdict != Verdict::Told;
    };
    if (std::ranges::any_of(section.measures, is_held)) {
      add("<table>\n<thead><tr><th>figure</th><th class=\"n\">value</th><th></th>"
          "<th class=\"n\">at most</th><th>verdict</th><th>where the limit comes from</th></tr>"
          "</thead>\n<tbody>\n");
      for (const Measure& measure : section.measures) {
        if (is_held(measure)) add_held(measure);
      }
      add("</tbody>\n</table>\n");
    }
    std::vector<Measure> told;
    std::ranges::remove_copy_if(section.measures, std::back_inserter(told), is_held);
    add_told(told);
  }

  void add_held(const Measure& measure) {
    add("<tr><td>{}</td><td class=\"n\">{}</td><td>{}</td><td class=\"n\">{}</td><td>{}</td>"
        "<td class=\"why\">{}</td></tr>\n",
        escaped(measure.name), number(measure.value), escaped(measure.unit),
        measure.limit ? number(*measure.limit) : "", badge(measure.verdict),
        escaped(measure.because));
  }

  void add_told(const std::vector<Measure>& told) {
    if (told.empty()) return;
    add("<div class=\"row\">\n");
    std::optional<std::string> subject;
    for (const Measure& measure : told) {
      const std::size_t end = measure.name.find(": ");
      const bool has_subject = end != std::string::npos;
      const std::string of = has_subject ? measure.name.substr(0, end) : "";
      if (of != subject) {
        if (subject) add("</tbody></table>\n");
        add("<table class=\"small\"><tbody>\n");
        if (has_subject) add("<tr><th colspan=\"3\">{}</th></tr>\n", escaped(of));
        subject = of;
      }
      add("<tr><td>{}</td><td class=\"n\">{}</td><td>{}</td></tr>\n",
          escaped(has_subject ? measure.name.substr(end + 2) : measure.name), number(measure.value),
          escaped(measure.unit));
    }
    add("</tbody></table>\n</div>\n");
  }

  void add_table(const Table& table) {
    add("<h3>{}</h3>\n<table>\n<thead><tr>", escaped(table.title));
    for (const std::string& column : table.columns) add("<th>{}</th>", escaped(column));
    add("</tr></thead>\n<tbody>\n");
    for (const auto& row : table.rows) {
      add("<tr>");
      for (std::size_t i = 0; i < row.size(); ++i)
        add("<td{}>{}</td>", i > 0 ? " class=\"n\"" : "", escaped(row[i]));
      add("</tr>\n");
    }
    add("</tbody>\n</table>\n");
  }

  void add_figures(const Section& section) {
    if (!section.pictures.empty()) {
      add("<div class=\"row\">\n");
      for (const Picture& picture : section.pictures) {
        add("<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"/>"
            "<figcaption>{0}</figcaption></figure>\n",
            escaped(picture.caption), base64(png_bytes(picture.image, picture.caption)));
      }
      add("</div>\n");
    }
    if (section.histograms.empty()) return;
    add("<div class=\"row\">\n");
    for (const Histogram& histogram : section.histograms) add_histogram(histogram);
    add("</div>\n");
  }

  void add_histogram(const Histogram& histogram) {
    constexpr double left = 52, top = 10, width = 420, height = 140;
    const auto& counts = histogram.counts;
    const std::uint64_t most = counts.empty() ? 0 : *std::ranges::max_element(counts);
    add("<figure><svg width=\"490\" height=\"190\" viewBox=\"0 0 490 190\" role=\"img\" "
        "xmlns=\"http://www.w3.org/2000/svg\">\n<title>{}</title>\n<path fill=\"#2f6f9f\" d=\"",
        escaped(histogram.title));
    const double step = width / static_cast<double>(std::max<std::size_t>(counts.size(), 1));
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (counts[i] == 0) continue;
      const double tall = height * static_cast<double>(counts[i]) / static_cast<double>(most);
      add("M{:.2f} {:.2f}v-{:.2f}h{:.2f}v{:.2f}z", left + step * static_cast<double>(i),
          top + height, tall, step * 0.92, tall);
    }
    add("\"/>\n<path stroke=\"#8c959f\" fill=\"none\" d=\"M{0} {1}v{2}h{3}\"/>\n", left, top,
        height, width);
    add_label(left - 5, top + 8, "end", fmt::format("{}", most));
    add_label(left - 5, top + height, "end", "0");
    const std::array<double, 3> marks{
        histogram.low, histogram.low + (histogram.high - histogram.low) / 2, histogram.high};
    constexpr std::array anchors{"start", "middle", "end"};
    for (std::size_t i = 0; i < marks.size(); ++i) {
      add_label(left + width * static_cast<double>(i) / 2, top + height + 15, anchors[i],
                number(marks[i]) + (histogram.unit.empty() ? "" : " " + histogram.unit));
    }
    if (histogram.below > 0)
      add_label(left, top + height + 31, "start", fmt::format("{} below", histogram.below));
    if (histogram.above > 0)
      add_label(left + width, top + height + 31, "end", fmt::format("{} above", histogram.above));
    add("</svg>\n<figcaption>{}</figcaption></figure>\n", escaped(histogram.title));
  }

  void add_label(double x, double y, std::string_view anchor, const std::string& text) {
    add("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"11\" fill=\"#57606a\" "
        "text-anchor=\"{}\">{}</text>\n",
        x, y, anchor, escaped(text));
  }

  std::string html_;
};

}  // namespace

void write_html(const std::filesystem::path& path, const Report& report) {
  write_text(path, Page().of(report));
}

}  // namespace groundray::golden
