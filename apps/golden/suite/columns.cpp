#include "apps/golden/suite/columns.h"

#include <muParser.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "apps/golden/compare/images/image_file.h"
#include "core/error.h"
#include "core/image/exr_io.h"
#include "core/io/file_io.h"
#include "core/io/npy_io.h"
#include "core/io/ply_io.h"
#include "core/io/tum_io.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

// Returns a name that formulas can use.
std::string plain(std::string name) {
  std::ranges::replace_if(
      name, [](char c) { return c == '.' || c == '-'; }, '_');
  if (name.empty() || (name.front() >= '0' && name.front() <= '9')) name.insert(0, "v");
  return name;
}

template <typename T>
constexpr Stored stored_as() {
  if (std::is_same_v<T, double>) return Stored::Double;
  return std::is_same_v<T, float> ? Stored::Float : Stored::Whole;
}

template <typename Values>
Columns::Column column_of(std::string name, const Values& values) {
  using T = std::remove_cvref_t<decltype(*values.begin())>;
  return {plain(std::move(name)), std::vector<double>(values.begin(), values.end()),
          stored_as<T>()};
}

Columns columns_of(const PointCloud& cloud) {
  Columns columns{.rows = cloud.rows(), .all = {}};
  for (const PointCloud::Column& column : cloud.columns()) {
    std::visit([&](const auto& values) { columns.all.push_back(column_of(column.name, values)); },
               column.values);
  }
  return columns;
}

std::size_t pixels_of(glm::ivec2 size_px) {
  return static_cast<std::size_t>(size_px.x) * static_cast<std::size_t>(size_px.y);
}

Columns read_exr_columns(const std::filesystem::path& file) {
  const ExrFile exr = read_exr(file);
  const glm::ivec2 size_px(exr.width, exr.height);
  Columns columns{.rows = pixels_of(size_px), .all = {}, .size_px = size_px};
  for (const ExrChannel& channel : exr.channels) {
    std::visit(
        [&](const auto& image) { columns.all.push_back(column_of(channel.name, image.values())); },
        channel.image);
  }
  return columns;
}

Columns read_png_columns(const std::filesystem::path& file) {
  const Image<double> image = png_numbers(read_text(file), file.string()).values;
  const glm::ivec2 size_px(image.width(), image.height());
  Columns columns{.rows = pixels_of(size_px), .all = {}, .size_px = size_px};
  const auto channels = static_cast<std::size_t>(image.channels());
  for (std::size_t k = 0; k < channels; ++k) {
    std::vector<double> values(columns.rows);
    for (std::size_t i = 0; i < columns.rows; ++i) values[i] = image.values()[i * channels + k];
    columns.all.push_back({"v" + std::to_string(k), std::move(values), Stored::Whole});
  }
  return columns;
}

Columns read_pose_columns(const std::filesystem::path& file) {
  const Trajectory path = read_tum(file);
  Columns columns{.rows = path.samples().size(), .all = {}};
  using Sample = Trajectory::Sample;
  const auto add = [&](const char* name, const auto& value_of) {
    std::vector<double> values;
    for (const Sample& pose : path.samples()) values.push_back(value_of(pose));
    columns.all.push_back({name, std::move(values), Stored::Double});
  };
  add("time", [](const Sample& p) { return std::chrono::duration<double>(p.time).count(); });
  add("x", [](const Sample& p) { return p.pose.translation_m.x; });
  add("y", [](const Sample& p) { return p.pose.translation_m.y; });
  add("z", [](const Sample& p) { return p.pose.translation_m.z; });
  add("qx", [](const Sample& p) { return p.pose.rotation.x; });
  add("qy", [](const Sample& p) { return p.pose.rotation.y; });
  add("qz", [](const Sample& p) { return p.pose.rotation.z; });
  add("qw", [](const Sample& p) { return p.pose.rotation.w; });
  return columns;
}

double floor_of(double value) { return std::floor(value); }
double cbrt_of(double value) { return math::cbrt(value); }
double erf_of(double value) { return math::erf(value); }
double mod_of(double x, double y) { return x - y * std::floor(x / y); }
double hypot_of(double x, double y) { return math::hypot(x, y); }

// muParser takes pointers to variables that it could modify.
void define(mu::Parser& parser, const std::string& name, const std::vector<double>& values) {
  parser.DefineVar(name, const_cast<double*>(values.data()));
}

// muParser would read `=` as an assignment, and evaluate `a, b` to the last value.
void check_spelling(const std::string& formula) {
  int depth = 0;
  for (std::size_t i = 0; i < formula.size(); ++i) {
    const char c = formula[i];
    if (c == '(') ++depth;
    if (c == ')') --depth;
    if (c == ',' && depth <= 0) throw Error("formula '{}': has a comma between values", formula);
    if (c != '=') continue;
    const bool ends = i > 0 && std::string_view("=<>!").find(formula[i - 1]) != std::string::npos;
    const bool begins = i + 1 < formula.size() && formula[i + 1] == '=';
    if (!ends && !begins) throw Error("formula '{}': has '=': equality is '=='", formula);
  }
}

}  // namespace

const Columns::Column* Columns::find(std::string_view name) const {
  const auto found = std::ranges::find(all, name, &Column::name);
  return found == all.end() ? nullptr : &*found;
}

Columns read_columns(const std::filesystem::path& file) {
  const std::string kind = file.extension().string();
  if (kind == ".ply") return columns_of(read_ply(file).cloud);
  if (kind == ".exr") return read_exr_columns(file);
  if (kind == ".png") return read_png_columns(file);
  if (kind == ".npy") return columns_of(read_npy(file).cloud);
  if (kind == ".tum") return read_pose_columns(file);
  throw Error("{}: must be .ply, .exr, .png, .npy or .tum", file.string());
}

std::vector<double> evaluate(const std::string& formula, const Columns& columns) {
  std::vector<double> values(columns.rows);
  check_spelling(formula);
  if (columns.rows == 0) return values;
  try {
    mu::Parser parser;
    parser.DefineFun("floor", floor_of);
    parser.DefineFun("cbrt", cbrt_of);
    parser.DefineFun("erf", erf_of);
    parser.DefineFun("hypot", hypot_of);
    parser.DefineFun("mod", mod_of);
    parser.DefineConst("pi", std::numbers::pi);
    for (const Columns::Column& column : columns.all) define(parser, column.name, column.values);
    parser.SetExpr(formula);
    parser.Eval(values.data(), static_cast<int>(values.size()));
  } catch (const mu::Parser::exception_type& fault) {
    throw Error("formula '{}': {}", formula, fault.GetMsg());
  }
  return values;
}

}  // namespace groundray::golden
