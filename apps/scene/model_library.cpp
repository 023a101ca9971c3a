#include "apps/scene/model_library.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>

#include "apps/scene/readers/scene_reader.h"
#include "apps/scene/simulation.h"
#include "core/appearance/bsdf.h"
#include "core/error.h"
#include "core/image/image_io.h"
#include "core/io/file_io.h"
#include "core/model/displacement.h"
#include "core/model/model_io.h"
#include "terrain/assets/asset.h"
#include "terrain/assets/asset_defaults.h"
#include "terrain/assets/figure.h"

namespace groundray {
namespace {

// Returns all members of a source, for comparison. If a member is added, this does not compile.
auto parts(const AssetSpec& spec) {
  const auto& [kind, size_m, width_m, sag_m, per_m2, square_m, leaf_area_index, leaves, health,
               seed, detail] = spec;
  return std::tuple(kind, size_m, width_m, sag_m, per_m2, square_m, leaf_area_index, leaves, health,
                    seed.value, detail);
}
auto parts(const ModelSource& source) {
  const auto& [file, options, displacement] = source;
  const auto& [metres_per_unit, up, broken] = options;
  const auto& [image, amplitude_m, middle, cell_m] = displacement.value_or(DisplacementSource{});
  return std::tuple(file, metres_per_unit, up, broken, image, amplitude_m, middle, cell_m);
}

auto parts(const GivenModel& given) { return std::tuple(given.model); }

auto parts(const AssetPart& part) {
  return std::tuple_cat(parts(part.asset), std::tuple(part.part));
}

bool are_equal(const ModelSpec::Source& a, const ModelSpec::Source& b) {
  const auto equals_b = [&]<typename T>(const T& source) {
    const T* const other = std::get_if<T>(&b);
    return other != nullptr && parts(source) == parts(*other);
  };
  return std::visit(equals_b, a);
}

Model make(const AssetSpec& asset) { return make_asset(asset); }

Model make(const ModelSource& source) {
  const auto& [file, options, displacement] = source;
  Model model = read_model(file, options).model;
  if (!displacement) return model;
  const auto& [image, amplitude_m, middle, cell_m] = *displacement;
  try {
    return displaced(model, {read_heights(image), amplitude_m, middle, cell_m});
  } catch (const Error& fault) {
    throw Error("{}: {}", file.string(), fault.what());
  }
}

Model make(const GivenModel& given) { return *given.model; }

Model make(const AssetPart& part) { return make_figure_part(part.asset, part.part); }

// Checks that the surfaces to which materials are assigned exist in one of the models.
void check_names(const ModelSpec& spec, std::span<const ModelScene> models) {
  std::vector<std::string_view> names;
  for (const ModelScene& scene : models) {
    for (const ModelSurface& surface : scene.model().surfaces) {
      if (std::ranges::count(names, surface.name) == 0) names.push_back(surface.name);
    }
  }
  for (const auto& [name, material] : spec.materials) {
    if (std::ranges::count(names, name) > 0) continue;
    throw Error("materials has the surface '{}', but the model has {}", name,
                fmt::join(names, ", "));
  }
}

void add_model(const Model& model, Fingerprint& print) {
  print.add(std::span(model.mesh.vertices_m));
  print.add(std::span(model.mesh.triangles));
  print.add(std::span(model.uv));
  print.add(std::span(model.surface_of));
  for (const ModelSurface& surface : model.surfaces) {
    print.add_all(surface.least_alpha);
    for (const ModelImage* image : {&surface.albedo, &surface.opacity}) {
      print.add(image->pixels.values());
      if (!image->file.empty()) print.add(std::span<const char>(read_text(image->file)));
    }
  }
}

std::size_t bytes_of(const Model& model) {
  const auto bytes = [](const auto& values) { return std::span(values).size_bytes(); };
  std::size_t sum = bytes(model.mesh.vertices_m) + bytes(model.mesh.triangles) + bytes(model.uv) +
                    bytes(model.normals) + bytes(model.surface_of);
  for (const ModelSurface& surface : model.surfaces) {
    for (const ModelImage* image : {&surface.albedo, &surface.normal, &surface.opacity})
      sum += bytes(image->pixels.values());
  }
  return sum;
}

void add(const Lambertian& matt, Fingerprint& print) {
  print.add(std::span<const SpectrumSample>(matt.spectrum));
}
void add(const RoughDiffuse& rough, Fingerprint& print) {
  print.add(std::span<const SpectrumSample>(rough.spectrum));
  print.add_all(rough.roughness);
}
void add(const Coated& coated, Fingerprint& print) {
  print.add(std::span<const SpectrumSample>(coated.spectrum));
  print.add_all(coated.refractive_index, coated.alpha);
}
void add(const Conductor& metal, Fingerprint& print) {
  print.add(std::span<const SpectrumSample>(metal.refractive_index));
  print.add(std::span<const SpectrumSample>(metal.extinction_coefficient));
  print.add_all(metal.alpha);
}
void add(const PlantLeaf& leaf, Fingerprint& print) {
  print.add(std::span<const SpectrumSample>(leaf.reflectance));
  print.add(std::span<const SpectrumSample>(leaf.transmittance));
}
void add(const RetroReflector& retro, Fingerprint& print) {
  print.add_all(retro.coefficient_cd_lx_m2);
}

// Returns a material whose spectrum is multiplied such that its colour is about `color` under
// equal energy, by a factor that is interpolated between the middles of the three bands and is 1
// from 720 nm on: lasers and the near infrared see the material itself.
Material tinted(Material material, const glm::vec3& color) {
  auto* const matt = std::get_if<Lambertian>(&material.reflection);
  if (matt == nullptr) return material;
  constexpr std::array<double, 3> middles_nm = {610, 545, 460};
  std::array<double, 3> gains{};
  for (std::size_t i = 0; i < 3; ++i)
    gains[i] = color[static_cast<int>(i)] / value_at(matt->spectrum, middles_nm[i]).value_or(0.2);
  for (SpectrumSample& sample : matt->spectrum) {
    const double nm = sample.wavelength_nm;
    const auto between = [&](double from_nm, double to_nm, double from, double to) {
      return from + (to - from) * std::clamp((nm - from_nm) / (to_nm - from_nm), 0.0, 1.0);
    };
    const double gain = nm < middles_nm[1]   ? between(460, 545, gains[2], gains[1])
                        : nm < middles_nm[0] ? between(545, 610, gains[1], gains[0])
                                             : between(670, 720, gains[0], 1);
    sample.value = std::min(sample.value * gain, 1.0);
  }
  material.name += fmt::format(" of colour ({:.3f}, {:.3f}, {:.3f})", color.r, color.g, color.b);
  return material;
}

// Returns a matt material under a clear coat of index 1.5; nothing changes if `alpha` is 0. The
// base is brightened such that coat and base together reflect as much light, beside the gloss, as
// the material did, by Saunderson's equation (J. Opt. Soc. Am. 32, 1942) with his reflectances of
// the surface from outside, 0.092, and from inside, 0.596.
Material coated(Material material, double alpha) {
  auto* const matt = std::get_if<Lambertian>(&material.reflection);
  if (matt == nullptr || alpha == 0) return material;
  for (SpectrumSample& sample : matt->spectrum) {
    constexpr double passes = (1 - 0.092) * (1 - 0.596), returned = 0.596;
    sample.value = std::min(sample.value / (passes + returned * sample.value), 1.0);
  }
  material.reflection = Coated{.spectrum = std::move(matt->spectrum), .alpha = alpha};
  material.name += " under a clear coat";
  return material;
}

void check_colours(const Material& material) {
  try {
    bsdf_in_colour(material);
  } catch (const Error& fault) {
    throw Error("its material cannot be used with cameras: {}", fault.what());
  }
}

}  // namespace

std::uint64_t fingerprint_of(const Material& material) {
  Fingerprint print;
  print.add(std::span<const char>(material.name));
  print.add_all(material.reflection.index());
  std::visit([&](const auto& kind) { add(kind, print); }, material.reflection);
  print.add_all(material.emitted.r, material.emitted.g, material.emitted.b);
  return print.value();
}

Palette::Palette(const SceneSpec& spec) {
  for (const MountedLidar& mounted : spec.lidars) {
    if (mounted.lidar.light) wavelengths_nm_.push_back(mounted.lidar.light->wavelength_nm);
  }
  are_colours_seen_ = !spec.cameras.empty();
  if (spec.terrain.material) add(*spec.terrain.material);
}

std::uint16_t Palette::index_of(const ModelSpec& model, const ModelSurface& worn) {
  if (!is_asked_for()) return 0;
  const std::string& surface = worn.name;
  if (const auto found = model.materials.find(surface); found != model.materials.end())
    return add(found->second);
  if (model.material) return add(*model.material);
  const bool is_asset = std::holds_alternative<AssetSpec>(model.source);
  if (const auto stand_in = asset_stand_in(surface); is_asset && !stand_in.empty()) {
    const Material matt =
        load_material(data_folder() / "materials" / fmt::format("{}.yaml", stand_in));
    return add(coated(tinted(matt, worn.color), asset_coat_alpha(surface)));
  }
  const std::filesystem::path built_in = data_folder() / "materials" / (surface + ".yaml");
  if (!surface.empty() && std::filesystem::exists(built_in)) return add(load_material(built_in));
  throw Error(
      "its surface '{}' has no material, which lasers and cameras need: add material: NAME, or "
      "materials: {{{}: NAME}}, to the entry",
      surface, surface);
}

std::uint16_t Palette::index_of(const std::optional<Material>& material) {
  return !is_asked_for() || !material ? std::uint16_t{0} : add(*material);
}

std::uint16_t Palette::add(const Material& material) {
  const std::uint64_t print = fingerprint_of(material);
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (fingerprint_of(all_[i]) == print) return static_cast<std::uint16_t>(i);
  }
  for (const double wavelength_nm : wavelengths_nm_) retro_brdf(material, wavelength_nm);  // throws
  if (are_colours_seen_) check_colours(material);
  all_.push_back(material);
  return static_cast<std::uint16_t>(all_.size() - 1);
}

ModelLibrary::ModelLibrary(RayDevice device, Tracing tracing)
    : device_(std::move(device)), tracing_(tracing) {}

std::uint32_t ModelLibrary::load(const Source& source) {
  const auto found = std::ranges::find_if(
      sources_, [&](const Source& loaded) { return are_equal(loaded, source); });
  if (found == sources_.end()) {
    Model model = std::visit([](const auto& of_kind) { return make(of_kind); }, source);
    shapes_.emplace_back(device_, std::move(model), tracing_);
    sources_.push_back(source);
    return static_cast<std::uint32_t>(shapes_.size() - 1);
  }
  return static_cast<std::uint32_t>(found - sources_.begin());
}

std::uint32_t ModelLibrary::add(const ModelSpec& spec, std::uint16_t label, Palette& palette) {
  return add_all(spec, {&spec.source, 1}, label, palette);
}

std::uint32_t ModelLibrary::add_parts(const ModelSpec& spec, std::uint16_t label,
                                      Palette& palette) {
  const auto& asset = std::get<AssetSpec>(spec.source);
  std::vector<Source> sources;
  for (std::size_t part = 0; part < figure_parts(asset.kind); ++part)
    sources.emplace_back(AssetPart{asset, part});
  return add_all(spec, sources, label, palette);
}

std::uint32_t ModelLibrary::add_all(const ModelSpec& spec, std::span<const Source> sources,
                                    std::uint16_t label, Palette& palette) {
  const std::uint32_t first = size();
  std::vector<ModelScene> added;
  for (const Source& source : sources) {
    shape_of_.push_back(load(source));
    added.push_back(shapes_[shape_of_.back()]);
  }
  check_names(spec, added);
  for (const ModelScene& shape : added) {
    ModelTruth truth{label, {}};
    for (const ModelSurface& surface : shape.model().surfaces)
      truth.materials.push_back(palette.index_of(spec, surface));
    truths_.push_back(std::move(truth));
  }
  return first;
}

std::vector<ModelScene> ModelLibrary::models() const {
  std::vector<ModelScene> models;
  models.reserve(shape_of_.size());
  for (const std::uint32_t shape : shape_of_) models.push_back(shapes_[shape]);
  return models;
}

void ModelLibrary::add_to(Fingerprint& print) const {
  for (const ModelScene& shape : shapes_) add_model(shape.model(), print);
  print.add(std::span(shape_of_));
  for (const ModelTruth& truth : truths_) print.add(std::span(truth.materials));
}

std::size_t ModelLibrary::memory_bytes() const {
  std::size_t sum = 0;
  for (const ModelScene& shape : shapes_) sum += bytes_of(shape.model()) + shape.texture_bytes();
  return sum;
}

}  // namespace groundray
