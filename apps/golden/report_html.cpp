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

#include "apps/golden/chart.h"
#include "apps/golden/html_text.h"
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
td.long { overflow-wrap: anywhere; min-width: 9rem; }
td.n { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
td.why, figcaption, .facts th { color: #57606a; }
.text { white-space: pre-line; max-width: 60rem; }
.v { white-space: nowrap; font-weight: 600; font-size: .85em; border-radius: .6em; padding: .05em .6em; }
.passed { color: #10602a; background: #d7f5df; } .failed { color: #9b1420; background: #ffdcdc; }
.told { color: #57606a; background: #eaeef2; }
.row { display: flex; flex-wrap: wrap; gap: .6rem 2.4rem; align-items: flex-start; }
.small { max-width: 24rem; }
.scroll { overflow-x: auto; max-width: 100%; }
.headline { font-size: 1.15rem; max-width: 60rem; }
.cards { display: flex; flex-wrap: wrap; gap: .7rem; margin: 1rem 0; }
.card { border: 1px solid #d0d7de; border-radius: .5rem; padding: .5rem .9rem; max-width: 15rem; }
.card b { display: block; font-size: 1.35rem; font-variant-numeric: tabular-nums; }
.card.failed { border-color: #9b1420; }
.card span { color: #57606a; font-size: .87em; }
.card.failed span { color: inherit; }
details { margin: .8rem 0; } summary { cursor: pointer; font-weight: 600; }
figure { margin: .6rem 0; max-width: 100%; }
figure img { max-width: 100%; min-width: 15rem; border: 1px solid #d0d7de; image-rendering: pixelated; }
figcaption { font-size: .87em; max-width: 34rem; }
svg { max-width: 100%; height: auto; } svg image { image-rendering: pixelated; } svg text { font-family: system-ui, sans-serif; }
@media print { body { margin: 0; max-width: none; font-size: 10pt; }
  figure, tr, svg, .small, .card { break-inside: avoid; } h2, h3 { break-after: avoid; }
  .v { border: 1px solid currentColor; } }
)";

std::string badge(Verdict verdict) {
  constexpr std::array texts{"passed", "FAILED", "for information"};
  return fmt::format("<span class=\"v {}\">{}</span>", word_of(verdict),
                     texts[static_cast<std::size_t>(verdict)]);
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
    add("<div class=\"scroll\"><table class=\"facts\">\n");
    for (const auto& fact : report.facts)
      add("<tr><th>{}</th><td class=\"long\">{}</td></tr>\n", escaped(fact.first),
          escaped(fact.second));
    add("</table></div>\n");
  }

  void add_summary(const Report& report) {
    if (report.sections.size() < 2) return;
    add("<div class=\"scroll\"><table>\n<thead><tr><th>what</th><th>verdict</th><th>figures within "
        "their limits</th>"
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
    add("</tbody>\n</table></div>\n");
  }

  void add_section(const Section& section, std::size_t index) {
    add("<section id=\"s{}\">\n<h2>{} {}</h2>\n", index + 1, escaped(section.title),
        badge(section.verdict));
    if (!section.headline.empty()) {
      add("<p class=\"headline\">{}</p>\n", escaped(first_words(section)));
    }
    section.main.empty() ? add_all(section) : add_by_weight(section);
    add("</section>\n");
  }

  void add_all(const Section& section) {
    add_text(section);
    add_held(section);
    add_told(section);
    for (const Table& table : section.tables) add_table(table);
    add_pictures(section, {Shown::Errors, Shown::Data});
    add_histograms(section);
  }

  /// Adds what matters most first, and the rest collapsed.
  void add_by_weight(const Section& section) {
    add_main(section);
    add_held(section);
    add_text(section);
    add_pictures(section, {Shown::Errors});
    add_histograms(section);
    begin_details("Figures");
    add_told(section);
    end_details();
    if (!section.tables.empty()) {
      begin_details("Tables");
      for (const Table& table : section.tables) add_table(table);
      end_details();
    }
    if (std::ranges::find(section.pictures, Shown::Data, &Picture::shown) == section.pictures.end())
      return;
    begin_details("Pictures of the data");
    add_pictures(section, {Shown::Data});
    end_details();
  }

  void begin_details(std::string_view summary) {
    add("<details>\n<summary>{}</summary>\n", summary);
  }

  void end_details() { add("</details>\n"); }

  void add_text(const Section& section) {
    if (!section.text.empty()) add("<p class=\"text\">{}</p>\n", escaped(section.text));
  }

  void add_main(const Section& section) {
    add("<div class=\"cards\">\n");
    for (const Measure& measure : main_measures(section)) {
      add("<div class=\"card{}\"><b>{}{}{}</b><span>{}</span></div>\n",
          measure.verdict == Verdict::Failed ? " failed" : "", number_text(measure.value),
          measure.unit.empty() ? "" : " ", escaped(measure.unit), escaped(measure.name));
    }
    add("</div>\n");
  }

  static bool is_held(const Measure& measure) {
    return measure.limit || measure.verdict != Verdict::Told;
  }

  /// Adds a table of the figures with a limit or verdict.
  void add_held(const Section& section) {
    if (std::ranges::none_of(section.measures, is_held)) return;
    add("<div class=\"scroll\"><table>\n<thead><tr><th>figure</th><th class=\"n\">value</th>"
        "<th></th><th class=\"n\">at most</th><th>verdict</th><th>where the limit comes from</th>"
        "</tr></thead>\n<tbody>\n");
    for (const Measure& measure : section.measures) {
      if (is_held(measure)) add_held(measure);
    }
    add("</tbody>\n</table></div>\n");
  }

  void add_held(const Measure& measure) {
    add("<tr><td>{}</td><td class=\"n\">{}</td><td>{}</td><td class=\"n\">{}</td><td>{}</td>"
        "<td class=\"why\">{}</td></tr>\n",
        escaped(measure.name), number_text(measure.value), escaped(measure.unit),
        measure.limit ? number_text(*measure.limit) : "", badge(measure.verdict),
        escaped(measure.because));
  }

  /// Adds the other figures in small tables by the prefix of their names.
  void add_told(const Section& section) {
    std::vector<Measure> told;
    std::ranges::remove_copy_if(section.measures, std::back_inserter(told), is_held);
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
          escaped(has_subject ? measure.name.substr(end + 2) : measure.name),
          number_text(measure.value), escaped(measure.unit));
    }
    add("</tbody></table>\n</div>\n");
  }

  void add_table(const Table& table) {
    add("<h3>{}</h3>\n<div class=\"scroll\"><table>\n<thead><tr>", escaped(table.title));
    for (const std::string& column : table.columns) add("<th>{}</th>", escaped(column));
    add("</tr></thead>\n<tbody>\n");
    for (const auto& row : table.rows) {
      add("<tr>");
      for (std::size_t i = 0; i < row.size(); ++i)
        add("<td{}>{}</td>", i > 0 ? class_of(row[i]) : "", escaped(row[i]));
      add("</tr>\n");
    }
    add("</tbody>\n</table></div>\n");
  }

  /// Returns the class of a cell: numbers are aligned at the right and kept in one line, long texts
  /// such as paths are broken anywhere.
  static std::string_view class_of(std::string_view cell) {
    constexpr std::size_t long_text = 24;
    if (cell.size() > long_text) return " class=\"long\"";
    const bool is_number = cell.empty() || cell.find_first_of("0123456789") <= 1 ||
                           cell.starts_with("nan") || cell.starts_with("inf");
    return is_number ? " class=\"n\"" : "";
  }

  void add_pictures(const Section& section, std::initializer_list<Shown> kinds) {
    add("<div class=\"row\">\n");
    for (const Shown kind : kinds) {
      for (const Picture& picture : section.pictures) {
        if (picture.shown == kind) add_picture(picture);
      }
    }
    add("</div>\n");
  }

  void add_picture(const Picture& picture) {
    const std::string caption = escaped(picture.caption);
    if (picture.across || picture.up || picture.bar) {
      add("<figure>{}<figcaption>{}</figcaption></figure>\n", picture_svg(picture), caption);
      return;
    }
    add("<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"/>"
        "<figcaption>{0}</figcaption></figure>\n",
        caption, base64(png_bytes(picture.image, picture.caption)));
  }

  void add_histograms(const Section& section) {
    if (section.histograms.empty()) return;
    add("<div class=\"row\">\n");
    for (const Histogram& histogram : section.histograms)
      add("<figure>{}</figure>\n", histogram_svg(histogram));
    add("</div>\n");
  }

  std::string html_;
};

}  // namespace

void write_html(const std::filesystem::path& path, const Report& report) {
  write_text(path, Page().of(report));
}

}  // namespace groundray::golden
