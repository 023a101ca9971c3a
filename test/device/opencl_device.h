#pragma once

#include <memory>
#include <string>

#include "test/device/kernel_device.h"

namespace groundray::testing {

/// Runs passes as kernels of the first OpenCL device with double precision.
class OpenClDevice final : public KernelDevice {
 public:
  /// @param code  SPIR-V, and SPIR for drivers that take no SPIR-V.
  /// @throws NoDevice if there is no such device.
  /// @throws std::runtime_error if the driver rejects the kernels, with its log.
  OpenClDevice(const KernelCode& code, HostArrays& arrays);
  ~OpenClDevice() override;

  std::string name() const override;

 private:
  void write(Memory to, std::span<const std::byte> bytes) override;
  void read(std::span<std::byte> bytes) override;
  double launch(const Launch& launch) override;

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace groundray::testing
