#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "terrain/lod/pass.h"
#include "test/device/host_arrays.h"

namespace groundray::testing {

/// Runs passes as kernels of the first OpenCL device with double precision. Its memory is its own:
/// before each pass it gets a copy of the host's arrays, and afterwards the host gets one of its.
class OpenClDevice final : public PassDevice {
 public:
  /// Returns the name of the device that would be used; nothing if there is none.
  static std::optional<std::string> name();

  /// @param kernels  folder of passes.spv (SPIR-V) and passes.spir (SPIR, for drivers that take no
  ///                 SPIR-V).
  /// @throws std::runtime_error if the driver rejects the kernels.
  OpenClDevice(const std::filesystem::path& kernels, HostArrays& arrays);
  ~OpenClDevice() override;

  void run(std::string_view name, std::span<const std::byte> bytes, std::size_t count) override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace groundray::testing
