#include "apps/golden/suite/stored.h"

#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "apps/golden/suite/checks.h"
#include "apps/golden/suite/columns.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/io/file_io.h"

namespace groundray::golden {
namespace {

// Base of the seeds of the runs for moments. Scenes do not use these seeds: otherwise the tested
// run would be one of the stored ones.
constexpr std::uint64_t first_seed = 0x676f6c64656e0000;

// Copies a file atomically: an existing one remains if this fails.
void copy_whole(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::filesystem::create_directories(to.parent_path());
  write_text(to, read_text(from));
}

void write_columns(const std::filesystem::path& file, const Columns& columns) {
  std::vector<ImageF> images;
  images.reserve(columns.all.size());  // keeps the layers' pointers valid
  std::vector<ExrLayer> layers;
  for (const Columns::Column& column : columns.all) {
    ImageF& image = images.emplace_back(columns.size_px.x, columns.size_px.y, 1);
    for (std::size_t i = 0; i < columns.rows; ++i)
      image.values()[i] = static_cast<float>(column.values[i]);
    layers.push_back({{column.name}, &image});
  }
  std::filesystem::create_directories(file.parent_path());
  write_exr(file, layers);
}

// Returns the checks of a kind, each with its product.
template <typename Kind>
std::vector<std::pair<std::string, Kind>> checks_of(const GoldenCase& golden) {
  std::vector<std::pair<std::string, Kind>> found;
  for (const ProductChecks& product : golden.products) {
    for (const Check& check : product.checks) {
      if (const auto* kind = std::get_if<Kind>(&check.what))
        found.emplace_back(product.product, *kind);
    }
  }
  return found;
}

}  // namespace

std::filesystem::path stored_file(const GoldenCase& golden, const std::string& product) {
  return golden.expected() / product;
}

std::filesystem::path stored_moments(const GoldenCase& golden, const std::string& product) {
  return (golden.expected() / product).replace_extension(".moments.exr");
}

void store(const GoldenCase& golden,
           const std::function<std::filesystem::path(std::uint64_t seed)>& run) {
  const auto exact = checks_of<ExactCheck>(golden);
  const auto statistical = checks_of<StatisticalCheck>(golden);
  if (exact.empty() && statistical.empty()) {
    throw Error("{}: has only closed-form checks; there is nothing to store",
                (golden.folder / "case.yaml").string());
  }
  if (!exact.empty()) {
    const std::filesystem::path dataset = run(0);
    for (const auto& check : exact)
      copy_whole(dataset / check.first, stored_file(golden, check.first));
  }
  if (statistical.empty()) return;
  std::vector<Moments> moments;
  for (const auto& check : statistical) moments.emplace_back(check.second.columns);
  for (int k = 1; k <= statistical_runs; ++k) {
    const std::filesystem::path dataset = run(first_seed + static_cast<std::uint64_t>(k));
    for (std::size_t i = 0; i < statistical.size(); ++i)
      moments[i].add(read_columns(dataset / statistical[i].first));
  }
  for (std::size_t i = 0; i < statistical.size(); ++i)
    write_columns(stored_moments(golden, statistical[i].first), moments[i].columns());
}

}  // namespace groundray::golden
