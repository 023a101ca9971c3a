#include "apps/scan/word_option.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace groundray::word_option_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

enum class Fruit { Apple = 7, Pear = -2, Quince = 0 };
const Words<Fruit> fruits{
    {"pear", Fruit::Pear}, {"apple", Fruit::Apple}, {"quince", Fruit::Quince}};

// Returns the error message for a command line; empty if there is none.
std::string fault_of(CLI::App& app, const std::string& line) {
  try {
    app.parse(line);
  } catch (const CLI::Error& error) {
    return error.what();
  }
  return "";
}

TEST(WordOption, MapsWordsToValues) {
  for (const auto& [word, value] : fruits) {
    CLI::App app;
    Fruit fruit = Fruit::Quince;
    std::optional<Fruit> other;
    add_words(&app, "--fruit", fruit, "Of a tree", fruits);
    add_words(&app, "--other", other, "Or none", fruits);
    EXPECT_EQ(fault_of(app, "--fruit " + word), "");
    EXPECT_EQ(fruit, value);
    EXPECT_FALSE(other);
    EXPECT_EQ(fault_of(app, "--other " + word), "");
    EXPECT_EQ(other, value);
  }
}

TEST(WordOption, ListsTheAcceptedWords) {
  CLI::App app;
  Fruit fruit = Fruit::Apple;
  add_words(&app, "--fruit", fruit, "Of a tree", fruits);
  EXPECT_THAT(fault_of(app, "--fruit plum"),
              AllOf(HasSubstr("--fruit"), HasSubstr("'plum' must be pear, apple or quince")));
  EXPECT_NE(fault_of(app, "--fruit 7"), "");  // the number of an enumerator is not accepted
  EXPECT_NE(fault_of(app, "--fruit Apple"), "");
  EXPECT_EQ(fruit, Fruit::Apple);
  EXPECT_THAT(app.help(), AllOf(HasSubstr("--fruit pear|apple|quince"), Not(HasSubstr("7"))));
}

}  // namespace
}  // namespace groundray::word_option_test
