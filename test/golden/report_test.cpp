#include "apps/golden/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <string_view>
#include <tuple>

#include "apps/golden/chart.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"
#include "test/support/temporary_folder.h"

namespace groundray::golden::report_test {
namespace {

using groundray::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Measure measure(Verdict verdict) { return {.name = "a", .verdict = verdict}; }

TEST(Report, OneFailedMeasureFailsTheSection) {
  const Measure passed = measure(Verdict::Passed), failed = measure(Verdict::Failed),
                told = measure(Verdict::Told);
  EXPECT_EQ(verdict_of({}), Verdict::Told);
  EXPECT_EQ(verdict_of({told, told}), Verdict::Told);
  EXPECT_EQ(verdict_of({told, passed}), Verdict::Passed);
  EXPECT_EQ(verdict_of({passed, failed, told}), Verdict::Failed);
}

TEST(Report, VerdictsNameTheFirstFailure) {
  Section section{.headline = "They differ."};
  tell(section, "bias", 1, "m");
  EXPECT_EQ(first_words(section), "They differ. No limit was given, so there is no verdict.");
  hold(section, "RMS", 0.5, "m", 1, "given");
  EXPECT_EQ(first_words(section), "Passed: the limit is met. They differ.");
  hold(section, "largest", 0.75, "m", 1, "given");
  EXPECT_EQ(first_words(section), "Passed: all 2 limits are met. They differ.");
  hold(section, "missing", 0.125, "", 0.1, "given");
  EXPECT_EQ(first_words(section), "Failed: missing is 0.125, but may be at most 0.1. They differ.");
  hold(section, "extra", 0.125, "", 0.1, "given");
  EXPECT_EQ(first_words(section),
            "Failed: missing is 0.125, but may be at most 0.1; 2 of 4 checks failed. They differ.");
  Section single;
  fail(single, "pairs", 0, "", "nothing is compared");
  EXPECT_EQ(first_words(single), "Failed: pairs is 0 (nothing is compared).");
}

TEST(Report, MainFiguresKeepTheirOrder) {
  Section section{.main = {"b", "none", "a"}};
  tell(section, "a", 1);
  tell(section, "b", 2);
  const std::vector<Measure> found = main_measures(section);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].name, "b");
  EXPECT_EQ(found[1].name, "a");
}

// Multiples of the step within the range, both ends included, as few as requested.
TEST(Chart, TicksAreRoundNumbersWithinTheRange) {
  EXPECT_THAT(ticks_between(0, 10, 6).values, ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(ticks_between(10, 0, 3).values, ElementsAre(0, 5, 10));
  EXPECT_THAT(ticks_between(435'012, 435'987, 4).values,
              ElementsAre(435'200, 435'400, 435'600, 435'800));
  EXPECT_THAT(ticks_between(-0.03, 0.03, 5).values, SizeIs(3));
  EXPECT_THAT(ticks_between(1, 1, 5).values, IsEmpty());
  EXPECT_THAT(ticks_between(0, infinity, 5).values, IsEmpty());
  for (int i = 1; i < 400; ++i) {
    const double low = std::sin(i) * std::pow(10, i % 13 - 6), high = low + std::pow(1.3, i % 60);
    const std::vector<double> ticks = ticks_between(low, high, 7).values;
    EXPECT_GE(ticks.size(), 2u) << low << " " << high;
    EXPECT_LE(ticks.size(), 7u) << low << " " << high;
    EXPECT_GE(ticks.front(), low - 1e-9 * (high - low));
    EXPECT_LE(ticks.back(), high + 1e-9 * (high - low));
  }
}

// The step gives the decimals of a single tick.
TEST(Chart, SingleTicksHaveAStepThatTellsThemApart) {
  for (const auto& [low, high, text] :
       {std::tuple(1234.3, 1234.9, "1234.5"), std::tuple(0.45, 0.55, "0.5")}) {
    const Ticks ticks = ticks_between(low, high, 2);
    ASSERT_EQ(ticks.values.size(), 1u);
    EXPECT_EQ(tick_text(ticks.values[0], ticks.step), text);
  }
}

TEST(Chart, TickTextsHaveTheDecimalsOfTheirStep) {
  EXPECT_EQ(tick_text(0.30000000000000004, 0.1), "0.3");
  EXPECT_EQ(tick_text(435'200, 200), "435200");
  EXPECT_EQ(tick_text(-0.02, 0.01), "−0.02");
  EXPECT_EQ(tick_text(-1e-18, 0.01), "0.00");
  EXPECT_EQ(tick_text(2e-7, 1e-7), "2e-07");
}

TEST(Report, HistogramsOfEmptyRangesCountValuesOutside) {
  for (const double high : {infinity, 0.0, nan}) {
    const Histogram histogram = histogram_of("", "", {1, 2, nan}, -high, high, 4);
    EXPECT_EQ(histogram.below + histogram.above, 2U) << high;
  }
}

TEST(Report, HistogramsCountEachFiniteValueOnce) {
  const Histogram histogram = histogram_of(
      "t", "m", {-1.001, -1, -0.51, -0.5, 0, 0.999, 1, 1.001, 7, nan, infinity, -infinity}, -1, 1,
      4);
  EXPECT_THAT(histogram.counts, ElementsAre(2u, 1u, 1u, 2u));
  EXPECT_EQ(histogram.below, 1u);
  EXPECT_EQ(histogram.above, 2u);
  EXPECT_EQ(histogram_of("t", "", {3, 3}, 3, 3).above + histogram_of("t", "", {3}, 3, 3).below, 2u);
}

Report sample() {
  Section range{
      .title = "ranges <0> & \"more\"",
      .verdict = Verdict::Failed,
      .text = "first line\nit's <b>not</b> bold \x01",
      .measures = {{"largest error", 0.00123456, "m", 0.001, "1e-9 range & 1 mm", Verdict::Failed},
                   {"bias", -2e-7, "m", 1e-6, "rounding", Verdict::Passed},
                   {"lost", nan, "", {}, "", Verdict::Told},
                   {"ratio", -infinity, "", {}, "", Verdict::Told}},
      .tables = {{"by class", {"label", "n"}, {{"<grass>", "12"}, {"rock", "3"}}}},
      .histograms = {histogram_of("error <mm>", "mm", {1, 2, 2, 3, 9}, 0, 4, 4)},
      .pictures = {{"difference > 0", Image8(3, 2, 3)}}};
  range.pictures[0].image.at(2, 1)[1] = 200;
  return {.title = "a < b",
          .facts = {{"file", "a&b.ply"}, {"file", "c'd.ply"}},
          .sections = {range, {.title = "nothing"}}};
}

// Collects the contents of an XML tree.
struct Gatherer : tinyxml2::XMLVisitor {
  std::set<std::string> ids, links, elements;
  std::string text, source;

  bool VisitEnter(const tinyxml2::XMLElement& element, const tinyxml2::XMLAttribute*) override {
    elements.insert(element.Name());
    if (const char* id = element.Attribute("id")) ids.insert(id);
    if (const char* link = element.Attribute("href")) links.insert(link);
    if (const char* from = element.Attribute("src")) source = from;
    return true;
  }
  bool Visit(const tinyxml2::XMLText& words) override {
    text += words.Value();
    text += '\n';
    return true;
  }
};

std::string decoded(std::string_view base64) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0, count = 0;
  for (const char c : base64.substr(0, base64.find('='))) {
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255u);
  }
  return bytes;
}

// A strict XML parser reads the page and finds all texts unchanged.
TEST(Report, PageIsWellFormedAndEscapesTexts) {
  const TemporaryFolder folder;
  write_html(folder / "a.html", sample());
  const std::string html = read_text(folder / "a.html");
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(html.c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  Gatherer page;
  document.Accept(&page);
  EXPECT_THAT(page.links, ElementsAre("#s1", "#s2"));
  EXPECT_THAT(page.ids, ElementsAre("s1", "s2"));
  for (const char* text :
       {"a < b", "a&b.ply", "c'd.ply", "ranges <0> & \"more\"", "it's <b>not</b> bold", "FAILED",
        "0.0012346", "0.001", "1e-9 range & 1 mm", "−2e-07", "not a number", "−∞", "<grass>",
        "error <mm>", "difference > 0", "1 of 2", "1 above"})
    EXPECT_THAT(page.text, HasSubstr(text));
  EXPECT_EQ(page.elements.count("script") + page.elements.count("b"), 0u);
  EXPECT_THAT(html, Not(HasSubstr("\x01")));
}

TEST(Report, PageIsSelfContained) {
  const TemporaryFolder folder;
  write_html(folder / "a.html", sample());
  const std::string html = read_text(folder / "a.html");
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(html.c_str()), tinyxml2::XML_SUCCESS);
  Gatherer page;
  document.Accept(&page);
  constexpr std::string_view prefix = "data:image/png;base64,";
  ASSERT_TRUE(page.source.starts_with(prefix));
  const Image8 picture =
      parse_image8(decoded(std::string_view(page.source).substr(prefix.size())), "picture");
  EXPECT_EQ(picture.width(), 3);
  EXPECT_THAT(picture.at(2, 1), ElementsAre(0, 200, 0));
  // The name of SVG's namespace is the only address.
  EXPECT_EQ(std::regex_replace(html, std::regex("http://www.w3.org/2000/svg"), "").find("//"),
            std::string::npos);
}

// A compared section: the headline, the main figures and the picture of the errors come first, and
// the other figures, the tables and the pictures of the data are collapsed.
TEST(Report, MainFiguresAndErrorsComeBeforeTheRest) {
  const TemporaryFolder folder;
  Report report = sample();
  report.sections.resize(1);
  Section& section = report.sections[0];
  section.headline = "They differ by 1.2 mm.";
  section.main = {"largest error"};
  section.pictures.push_back(
      {.caption = "where they differ",
       .image = Image8(3, 2, 3),
       .shown = Shown::Errors,
       .across = Axis{"east, m", 0, 30},
       .up = Axis{"north, m", 0, 20},
       .bar = ColourBar{"error, m", {Colour(0), Colour(1)}, {{0.5, "7.5"}}}});
  write_html(folder / "a.html", report);
  const std::string html = read_text(folder / "a.html");
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(html.c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  std::vector<std::size_t> places;
  for (const char* part :
       {"Failed: largest error is 0.001235 m, but may be at most 0.001 m", "They differ by 1.2 mm.",
        "class=\"card failed\"", "where they differ", "east, m", ">20<", "north, m", ">7.5<",
        "error, m", "error &lt;mm&gt;", "it&#39;s &lt;b&gt;", "<details>", "ratio", "by class",
        "difference &gt; 0"}) {
    places.push_back(html.find(part));
    EXPECT_NE(places.back(), std::string::npos) << part;
  }
  EXPECT_EQ(places[0] < places[1] && places[1] < places[2] && places[2] < places[3], true);
  EXPECT_LT(places[3], places[11]);
  for (const std::size_t late : {places[12], places[13], html.rfind("difference &gt; 0")})
    EXPECT_GT(late, places[11]);
  EXPECT_EQ(html.find("<script"), std::string::npos);
}

// The counts 1, 2, 1 and 0 give bars with heights of 1 : 2 : 1.
TEST(Report, BarHeightsMatchCounts) {
  const TemporaryFolder folder;
  Report report = sample();
  report.sections[0].histograms = {histogram_of("h", "", {0.5, 1.5, 1.6, 2.5}, 0, 4, 4)};
  write_html(folder / "a.html", report);
  const std::string html = read_text(folder / "a.html");
  const std::regex bar("M([0-9.]+) ([0-9.]+)v-([0-9.]+)h");
  std::vector<double> heights;
  for (std::sregex_iterator each(html.begin(), html.end(), bar), end; each != end; ++each)
    heights.push_back(std::stod((*each)[3]));
  EXPECT_THAT(heights, ElementsAre(70, 140, 70));
}

TEST(Report, JsonContainsAllMeasures) {
  const TemporaryFolder folder;
  Report report = sample();
  report.facts.emplace_back("file", "no UTF-8: \xff");
  write_json(folder / "a.json", report);
  write_json(folder / "b.json", report);
  EXPECT_EQ(read_text(folder / "a.json"), read_text(folder / "b.json"));
  const auto json = nlohmann::json::parse(read_text(folder / "a.json"));
  EXPECT_EQ(json["title"], "a < b");
  EXPECT_EQ(json["facts"][1]["value"], "c'd.ply");
  const auto& section = json["sections"][0];
  EXPECT_EQ(section["verdict"], "failed");
  EXPECT_EQ(json["sections"][1]["verdict"], "told");
  EXPECT_EQ(section["measures"][0]["value"], 0.00123456);
  EXPECT_EQ(section["measures"][0]["limit"], 0.001);
  EXPECT_EQ(section["measures"][0]["because"], "1e-9 range & 1 mm");
  EXPECT_TRUE(section["measures"][2]["value"].is_null());
  EXPECT_TRUE(section["measures"][2]["limit"].is_null());
  EXPECT_TRUE(section["measures"][3]["value"].is_null());
  EXPECT_EQ(section["tables"][0]["rows"][0][0], "<grass>");
  EXPECT_EQ(section["histograms"][0]["counts"], (std::vector<int>{0, 1, 2, 1}));
  EXPECT_EQ(section["histograms"][0]["above"], 1);
  EXPECT_EQ(section["histograms"][0]["counted"], "count");
  EXPECT_EQ(section["headline"], "");
  EXPECT_TRUE(section["main"].is_array());
  EXPECT_TRUE(json["sections"][1]["measures"].is_array());
}

TEST(Report, RejectsUnwritableFiles) {
  EXPECT_THROW(write_html("/nowhere/a.html", sample()), Error);
  EXPECT_THROW(write_json("/nowhere/a.json", sample()), Error);
}

}  // namespace
}  // namespace groundray::golden::report_test
