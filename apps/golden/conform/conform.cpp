#include "apps/golden/conform/conform.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "apps/golden/conform/judge_mesh.h"
#include "apps/golden/conform/judge_rays.h"
#include "apps/golden/conform/pass_folder.h"
#include "core/error.h"
#include "core/io/file_io.h"
#include "core/io/json_fault.h"

namespace groundray::golden {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uint64_t most_manifest_bytes = 1 << 16;
constexpr std::array<std::string_view, 4> known_classes = {"bytes", "mesh", "bound", "rays"};

// What the other implementation states about itself.
struct Claims {
  std::string implementation;
  std::vector<std::string> classes;
  RayBudget budget;
};

double budget_of(const Json& json, const char* key, double most) {
  const Json& value = json.at(key);
  if (!value.is_number() || !(value.get<double>() >= 0 && value.get<double>() <= most))
    throw Error("rays.{} must be a number from 0 to {:g}", key, most);
  return value.get<double>();
}

// @param limit_m  up to which silhouettes are known.
RayBudget budget_of(const Json& json, double limit_m) {
  constexpr double most_relative = 1e-3;
  const auto precision = json.at("precision").get<std::string>();
  if (precision != "double" && precision != "float")
    throw Error("rays.precision = {:?} must be \"double\" or \"float\"", precision);
  RayBudget budget;
  budget.delta_m = budget_of(json, "delta_m", limit_m);
  if (precision == "double") return budget;
  budget.relative = budget_of(json, "range_relative", most_relative);
  budget.absolute_m = budget_of(json, "range_absolute_m", limit_m);
  budget.moves_rays = true;
  return budget;
}

Claims read_claims(const ArrayFolder& theirs, double limit_m) {
  const fs::path path = theirs.file("manifest.json");
  try {
    if (fs::file_size(path) > most_manifest_bytes)
      throw Error("it is larger than {} bytes", most_manifest_bytes);
    const Json json = Json::parse(read_text(path));
    Claims claims;
    claims.implementation = json.at("implementation").get<std::string>().substr(0, 200);
    claims.classes = json.at("classes").get<std::vector<std::string>>();
    if (claims.classes.empty()) throw Error("classes is empty: what is claimed?");
    for (const std::string& each : claims.classes) {
      if (std::ranges::find(known_classes, each) == known_classes.end())
        throw Error("class {:?} is unknown; the classes are {}", each.substr(0, 40),
                    fmt::join(known_classes, ", "));
      if (each == "rays") claims.budget = budget_of(json.at("rays"), limit_m);
    }
    return claims;
  } catch (const nlohmann::json::exception& fault) {
    throw Error("{}: {} (see docs/guide/gpu.md)", (theirs.path() / "manifest.json").string(),
                fault_in_words(fault));
  } catch (const Error& rule) {
    throw Error("{}: {}", (theirs.path() / "manifest.json").string(), rule.what());
  }
}

Section judge(std::string_view name, const PassFolder& ours, const ArrayFolder& theirs,
              const Claims& claims) {
  if (name == "bytes") return judge_bytes(ours, theirs);
  if (name == "mesh") return judge_mesh(ours, theirs);
  if (name == "bound") return judge_bound(ours, theirs);
  return judge_rays(ours, theirs, claims.budget);
}

}  // namespace

Report judge_conformity(const fs::path& passes, const fs::path& theirs_path) {
  const PassFolder ours = read_pass_folder(passes);
  const ArrayFolder theirs(theirs_path);
  const Claims claims = read_claims(theirs, ours.silhouette_limit_m);
  Report report{.title = "Conformity of a mesher and tracer, judged by groundray",
                .facts = {{"version", GROUNDRAY_VERSION},
                          {"passes", passes.string()},
                          {"judged", theirs_path.string()},
                          {"implementation", claims.implementation},
                          {"classes", fmt::format("{}", fmt::join(claims.classes, ", "))}},
                .sections = {}};
  for (const std::string_view name : known_classes) {
    if (std::ranges::find(claims.classes, name) == claims.classes.end()) continue;
    report.sections.push_back(judge(name, ours, theirs, claims));
    report.sections.back().verdict = verdict_of(report.sections.back().measures);
  }
  return report;
}

}  // namespace groundray::golden
