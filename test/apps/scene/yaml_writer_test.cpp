// Texts that the YAML writer makes, read again.
#include "apps/scene/yaml_writer.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "apps/scene/yaml_reader.h"
#include "test/support/temporary_folder.h"

namespace groundray::yaml_writer_test {
namespace {

using groundray::testing::data_folder;
using yaml::Node;

// A plain text may be written with quotes, but a number, or what is empty, must stay what it is.
void expect_same(const Node& a, const Node& b) {
  const auto is_scalar = [](const Node& node) {
    return node.kind == Node::Kind::Plain || node.kind == Node::Kind::Quoted;
  };
  if (is_scalar(a) && is_scalar(b)) {
    EXPECT_EQ(a.text, b.text);
    const bool is_text = a.text.find_first_not_of("0123456789+-.eE") != std::string::npos;
    EXPECT_TRUE(is_text || a.kind == b.kind) << a.text;
    return;
  }
  EXPECT_EQ(a.kind, b.kind);
  ASSERT_EQ(a.items.size(), b.items.size());
  for (std::size_t i = 0; i < a.items.size(); ++i) expect_same(a.items[i], b.items[i]);
}

TEST(YamlWriter, AllFilesOfDataAreReadAgainAsTheyWere) {
  int files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(data_folder())) {
    if (entry.path().extension() != ".yaml") continue;
    const Node node = yaml::parse(yaml::read_file(entry.path()), entry.path());
    SCOPED_TRACE(entry.path().string());
    expect_same(node, yaml::parse(yaml::text_of(node), "text.yaml"));
    const std::string line = yaml::line_of(node);
    EXPECT_EQ(line.find('\n'), std::string::npos);
    expect_same(node, yaml::parse(line, "line.yaml"));
    ++files;
  }
  EXPECT_GT(files, 40);
}

TEST(YamlWriter, TextsThatLookLikeSomethingElseStayTexts) {
  const std::string text =
      "{a: \"10\", b: \"\", c: ~, d: \"a: b, c\", e: \"line\\nbreak\", f: \"true\", g: true, "
      "h: \"~\", i: [], j: {}, k: \"#5\", l: \"it's\", m: 'quo\"te', n: \"\\\\\", o: 1.0e-05}";
  const Node node = yaml::parse(text, "text.yaml");
  expect_same(node, yaml::parse(yaml::text_of(node), "text.yaml"));
  expect_same(node, yaml::parse(yaml::line_of(node), "line.yaml"));
}

}  // namespace
}  // namespace groundray::yaml_writer_test
