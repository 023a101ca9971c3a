#pragma once

#include <memory>
#include <string>

#include "test/device/kernel_device.h"

namespace groundray::testing {

/// Runs passes as kernels of the first GPU by the driver of NVIDIA (CUDA) or AMD (HIP), which is
/// opened at run time. HIP's functions for modules have the parameters of CUDA's driver.
class DriverDevice final : public KernelDevice {
 public:
  enum class Api { Cuda, Hip };

  /// @param code     passes.ptx for CUDA; code objects for HIP, of which the first is taken that
  ///                 the GPU runs.
  /// @param library  file of the driver; empty for that of the system.
  /// @throws NoDevice if there is no driver or GPU.
  /// @throws std::runtime_error if the driver rejects the kernels, with its log.
  DriverDevice(Api api, const KernelCode& code, HostArrays& arrays,
               const std::string& library = "");
  ~DriverDevice() override;

  std::string name() const override;

 private:
  void write(Memory to, std::span<const std::byte> bytes) override;
  void read(std::span<std::byte> bytes) override;
  double launch(const Launch& launch) override;

  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace groundray::testing
