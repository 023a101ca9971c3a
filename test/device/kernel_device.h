#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/lod/pass.h"
#include "test/device/host_arrays.h"

namespace groundray::testing {

/// Absence of a driver or of a device.
struct NoDevice : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Kernels of the passes in the forms that drivers load; a form may be empty.
struct KernelCode {
  std::string spirv, spir, ptx;
  std::vector<std::string> code_objects;  ///< AMD's, one for each architecture
};

/// Reads the kernels of a folder: passes.spv, passes.spir, passes.ptx and *.hsaco.
KernelCode read_kernels(const std::filesystem::path& folder);

/// Runs passes as kernels of a device that has memory of its own: before each pass it gets a copy
/// of the host's arrays, and afterwards the host gets one of its. While a kernel runs, the arrays
/// of the host are unreachable. To be used on the thread that made it.
class KernelDevice : public PassDevice {
 public:
  /// Times of a pass, milliseconds: the kernel's by the device's clock, and all with the copies.
  struct Times {
    double kernel_ms = 0, all_ms = 0;
  };

  virtual std::string name() const = 0;
  void run(std::string_view pass, std::span<const std::byte> bytes, std::size_t count) final;
  /// Returns the times of the last pass that had an index.
  const Times& last_times() const noexcept { return last_; }

 protected:
  enum class Memory { Pass, Arrays };
  /// Run of a kernel. Its parameters are Memory::Pass, indices, Memory::Arrays, host, size; those
  /// in memory by address.
  struct Launch {
    std::string_view kernel;
    std::size_t groups = 0;            ///< of `group` indices
    std::uint64_t indices = 0;         ///< that are run
    std::uint64_t host = 0, size = 0;  ///< address and bytes of the host's arrays
  };
  static constexpr std::size_t group = 64, most_of_a_pass = 4096;

  explicit KernelDevice(HostArrays& arrays) : arrays_(arrays) {}
  std::size_t size_of_arrays() const noexcept { return arrays_.size(); }

  /// Copies to the beginning of the device's memory.
  virtual void write(Memory to, std::span<const std::byte> bytes) = 0;
  /// Copies from the beginning of the device's Memory::Arrays.
  virtual void read(std::span<std::byte> bytes) = 0;
  /// Runs a kernel to its end and returns its time, ms.
  virtual double launch(const Launch& launch) = 0;

 private:
  HostArrays& arrays_;
  Times last_;
};

/// Opens the first OpenCL device with double precision; it runs SPIR-V, or SPIR if its driver takes
/// no SPIR-V.
/// @throws NoDevice if there is no such device.
/// @throws std::runtime_error if the driver rejects the kernels, with its log.
std::unique_ptr<KernelDevice> open_opencl(const KernelCode& code, HostArrays& arrays);

/// Driver of NVIDIA's or AMD's GPUs.
enum class Gpu { Cuda, Hip };

/// Opens the first GPU of a driver, which is opened at run time. CUDA runs the PTX, HIP the first
/// of the code objects that it accepts.
/// @param library  file of the driver; empty for that of the system.
/// @throws NoDevice if there is no driver or GPU.
/// @throws std::runtime_error if the driver rejects the kernels, with its log.
std::unique_ptr<KernelDevice> open_gpu(Gpu gpu, const KernelCode& code, HostArrays& arrays,
                                       const std::string& library = "");

}  // namespace groundray::testing
