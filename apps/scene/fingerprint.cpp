#include "apps/scene/fingerprint.h"

#include <variant>

namespace groundray {
namespace {

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

}  // namespace

std::uint64_t fingerprint_of(const Material& material) {
  Fingerprint print;
  print.add(std::span<const char>(material.name));
  print.add_all(material.reflection.index());
  std::visit([&](const auto& kind) { add(kind, print); }, material.reflection);
  print.add_all(material.emitted.r, material.emitted.g, material.emitted.b);
  return print.value();
}

}  // namespace groundray
