#include "core/appearance/materials.h"

#include <map>
#include <mutex>
#include <optional>
#include <utility>

namespace groundray {

struct Materials::Impl {
  std::vector<Material> all;
  mutable std::mutex mutex;
  mutable std::map<double, std::vector<RetroBrdf>> by_wavelength_nm;
  mutable std::optional<InColour> in_colour;
};

Materials::Materials(std::initializer_list<Material> all) : Materials(std::vector(all)) {}

Materials::Materials(std::vector<Material> all) {
  auto impl = std::make_shared<Impl>();
  impl->all = std::move(all);
  impl_ = std::move(impl);
}

std::span<const Material> Materials::all() const noexcept {
  if (impl_ == nullptr) return {};
  return impl_->all;
}

std::span<const RetroBrdf> Materials::retro_brdfs(double wavelength_nm) const {
  if (impl_ == nullptr) return {};
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->by_wavelength_nm.find(wavelength_nm);
  if (found != impl_->by_wavelength_nm.end()) return found->second;
  std::vector<RetroBrdf> brdfs;
  for (const Material& material : impl_->all) brdfs.push_back(retro_brdf(material, wavelength_nm));
  return impl_->by_wavelength_nm.emplace(wavelength_nm, std::move(brdfs)).first->second;
}

const Materials::InColour& Materials::in_colour() const {
  static const InColour none;
  if (impl_ == nullptr) return none;
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->in_colour) {
    InColour made;
    for (const Material& material : impl_->all) {
      made.bsdfs.push_back(bsdf_in_colour(material));
      made.albedos.emplace_back(made.bsdfs.back().albedo());
    }
    impl_->in_colour = std::move(made);
  }
  return *impl_->in_colour;
}

}  // namespace groundray
