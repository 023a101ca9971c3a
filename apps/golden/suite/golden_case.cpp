#include "apps/golden/suite/golden_case.h"

#include <algorithm>
#include <array>
#include <optional>

#include "apps/scene/yaml_reader.h"
#include "core/error.h"
#include "core/folder_names.h"

namespace groundray::golden {
namespace {

using yaml::Faults;
using yaml::Map;
using yaml::Need;

constexpr yaml::Rule a_share{[](double value) { return value > 0 && value <= 1; },
                             "must be in (0, 1]"};

template <typename Formulas>
void read_formulas(Map& map, Formulas& check) {
  map.read_text("is", Need::Required, check.is);
  map.read_text("within", Need::Required, check.within);
}

std::vector<std::string> read_names(Map& map, const char* key, Faults& faults) {
  std::vector<std::string> names;
  for (const yaml::Node& item : map.list(key, Need::Required)) {
    if (yaml::is_text(item, key, faults)) names.push_back(item.text);
  }
  return names;
}

std::optional<FigureCheck> read_figure(Map& map) {
  using Kind = FigureCheck::Kind;
  constexpr std::array<std::pair<const char*, Kind>, 4> kinds = {{{"mean", Kind::Mean},
                                                                  {"deviation", Kind::Deviation},
                                                                  {"smallest", Kind::Smallest},
                                                                  {"largest", Kind::Largest}}};
  FigureCheck check;
  if (map.find("count", Need::Optional) != nullptr) {
    map.read_text("count", Need::Required, check.is);
    check.kind = Kind::Count;
    check.within = "0";
    map.read_text("within", Need::Optional, check.within);
    return check;
  }
  for (const auto& entry : kinds) {
    if (map.read_text(entry.first, Need::Optional, check.value) == nullptr) continue;
    check.kind = entry.second;
    read_formulas(map, check);
    return check;
  }
  return std::nullopt;
}

void read_check(const yaml::Node& node, ProductChecks& product, Faults& faults) {
  Map map(node, "checks", faults);
  Check check{.what = {}, .because = {}, .line = node.line};
  std::string whole;
  if (RowsCheck rows; map.read_text("each", Need::Optional, rows.value) != nullptr) {
    read_formulas(map, rows);
    map.read_number("share", Need::Optional, rows.share, a_share);
    check.what = rows;
  } else if (map.read_text("exact", Need::Optional, whole) != nullptr) {
    if (whole != "all") faults.add(node, "exact", "must be 'all'");
    check.what = ExactCheck{};
  } else if (map.find("statistical", Need::Optional) != nullptr) {
    StatisticalCheck statistical{.columns = read_names(map, "statistical", faults)};
    if (statistical.columns.empty()) faults.add(node, "statistical", "must name a column");
    map.read_number("share", Need::Optional, statistical.share, a_share);
    check.what = statistical;
  } else if (const auto figure = read_figure(map)) {
    check.what = *figure;
  } else {
    faults.add(node, "checks",
               "must have one of each, count, mean, deviation, smallest, largest, exact and "
               "statistical");
  }
  map.read_text("because", Need::Required, check.because);
  map.close();
  product.checks.push_back(std::move(check));
}

bool sees_all_rows(const ProductChecks& product) {
  return std::ranges::any_of(product.checks, [](const Check& check) {
    const auto* figure = std::get_if<FigureCheck>(&check.what);
    return std::holds_alternative<ExactCheck>(check.what) ||
           std::holds_alternative<StatisticalCheck>(check.what) ||
           (figure != nullptr && figure->kind == FigureCheck::Kind::Count);
  });
}

void read_product(const yaml::Node& node, GoldenCase& into, Faults& faults) {
  Map map(node, "products", faults);
  ProductChecks product;
  map.read_text("file", Need::Required, product.product);
  map.read_text("rows", Need::Optional, product.rows);
  for (const yaml::Node& item : map.list("let", Need::Optional)) {
    if (item.kind != yaml::Node::Kind::Map || item.items.size() != 2 ||
        !yaml::is_text(item.items[1], "let", faults)) {
      faults.add(item, "let", "must be a list of `name: formula`");
      continue;
    }
    product.names.emplace_back(item.items[0].text, item.items[1].text);
  }
  for (const yaml::Node& item : map.list("checks", Need::Required))
    read_check(item, product, faults);
  if (!sees_all_rows(product)) {
    faults.add(
        node, "checks",
        "must have a count, exact or statistical check: the others pass if rows are missing");
  }
  map.close();
  into.products.push_back(std::move(product));
}

bool is_wanted(const std::string& name, const std::vector<std::string>& filters) {
  return filters.empty() || std::ranges::any_of(filters, [&](const std::string& filter) {
           return name.find(filter) != std::string::npos;
         });
}

}  // namespace

GoldenCase read_case(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "case.yaml";
  GoldenCase into{
      .name = folder.filename().string(), .folder = folder, .title = {}, .products = {}};
  const yaml::Node root = yaml::parse(yaml::read_file(file), file);
  Faults faults(file);
  Map map(root, "", faults);
  yaml::check_version(map, "groundray_golden", faults);
  map.read_text("title", Need::Required, into.title);
  for (const yaml::Node& item : map.list("products", Need::Required))
    read_product(item, into, faults);
  if (into.products.empty() && faults.count() == 0)
    faults.add(root, "products", "must have at least one");
  map.close();
  faults.throw_if_any();
  return into;
}

std::vector<GoldenCase> read_cases(const std::filesystem::path& folder,
                                   const std::vector<std::string>& filters) {
  if (!std::filesystem::is_directory(folder)) {
    throw Error("{}: the folder of cases does not exist; give one with --cases", folder.string());
  }
  std::vector<std::filesystem::path> folders;
  std::error_code fault;
  for (const std::string& name : names_in(folder, fault)) {
    if (std::filesystem::exists(folder / name / "case.yaml") && is_wanted(name, filters))
      folders.push_back(folder / name);
  }
  if (fault) throw Error("{}: cannot be read: {}", folder.string(), fault.message());
  for (const std::string& filter : filters) {
    if (std::ranges::none_of(folders, [&](const auto& each) {
          return each.filename().string().find(filter) != std::string::npos;
        }))
      throw Error("{}: contains no case with '{}' in its name", folder.string(), filter);
  }
  if (folders.empty()) throw Error("{}: contains no case", folder.string());
  std::vector<GoldenCase> cases;
  for (const auto& each : folders) cases.push_back(read_case(each));
  return cases;
}

}  // namespace groundray::golden
