// Types are those of cuda.h and hip_runtime_api.h: handles are pointers, addresses of the device
// are 64 bits wide (CUdeviceptr, hipDeviceptr_t), and results are int, 0 for success. HIP's
// functions for modules have the parameters of CUDA's driver.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <map>

#include "test/device/kernel_device.h"
#include "test/device/shared_library.h"

namespace groundray::testing {
namespace {

using Address = std::uint64_t;
using Handle = void*;

SharedLibrary open_driver(Gpu api, const std::string& library) {
  if (!library.empty()) return SharedLibrary({library});
  if (api == Gpu::Cuda) return SharedLibrary({"libcuda.so.1"});
  return SharedLibrary(
      {"libamdhip64.so.7", "libamdhip64.so.6", "libamdhip64.so.5", "libamdhip64.so"});
}

// Functions of a driver, under CUDA's names; those of contexts are CUDA's alone.
struct Driver {
  Gpu api;
  int (*init)(unsigned flags) = nullptr;
  int (*device_count)(int* count) = nullptr;
  int (*device_get)(int* device, int ordinal) = nullptr;
  int (*device_name)(char* name, int room, int device) = nullptr;
  int (*context_retain)(Handle* context, int device) = nullptr;
  int (*context_release)(int device) = nullptr;
  int (*context_set)(Handle context) = nullptr;
  int (*synchronize)() = nullptr;
  int (*module_load)(Handle* module, const void* image, unsigned count, int* options,
                     void** values) = nullptr;
  int (*module_unload)(Handle module) = nullptr;
  int (*module_function)(Handle* function, Handle module, const char* name) = nullptr;
  int (*allocate)(Address* address, std::size_t bytes) = nullptr;
  int (*free)(Address address) = nullptr;
  int (*copy_to)(Address to, const void* from, std::size_t bytes) = nullptr;
  int (*copy_from)(void* to, Address from, std::size_t bytes) = nullptr;
  int (*launch)(Handle function, unsigned groups_x, unsigned groups_y, unsigned groups_z,
                unsigned group_x, unsigned group_y, unsigned group_z, unsigned shared_bytes,
                Handle stream, void** parameters, void** extra) = nullptr;
  int (*event_create)(Handle* event, unsigned flags) = nullptr;
  int (*event_record)(Handle event, Handle stream) = nullptr;
  int (*event_elapsed)(float* ms, Handle begin, Handle end) = nullptr;
  int (*event_destroy)(Handle event) = nullptr;

  Driver(Gpu of, const std::string& file) : api(of) {
    const SharedLibrary library = open_driver(of, file);
    const auto find = [&](auto*& function, const char* of_cuda, const char* of_hip) {
      library.find(function, is_cuda() ? of_cuda : of_hip);
    };
    find(init, "cuInit", "hipInit");
    find(device_count, "cuDeviceGetCount", "hipGetDeviceCount");
    find(device_get, "cuDeviceGet", "hipDeviceGet");
    find(device_name, "cuDeviceGetName", "hipDeviceGetName");
    find(synchronize, "cuCtxSynchronize", "hipDeviceSynchronize");
    find(module_load, "cuModuleLoadDataEx", "hipModuleLoadDataEx");
    find(module_unload, "cuModuleUnload", "hipModuleUnload");
    find(module_function, "cuModuleGetFunction", "hipModuleGetFunction");
    find(allocate, "cuMemAlloc_v2", "hipMalloc");
    find(free, "cuMemFree_v2", "hipFree");
    find(copy_to, "cuMemcpyHtoD_v2", "hipMemcpyHtoD");
    find(copy_from, "cuMemcpyDtoH_v2", "hipMemcpyDtoH");
    find(launch, "cuLaunchKernel", "hipModuleLaunchKernel");
    find(event_create, "cuEventCreate", "hipEventCreateWithFlags");
    find(event_record, "cuEventRecord", "hipEventRecord");
    find(event_elapsed, "cuEventElapsedTime", "hipEventElapsedTime");
    find(event_destroy, "cuEventDestroy_v2", "hipEventDestroy");
    if (!is_cuda()) return;
    library.find(context_retain, "cuDevicePrimaryCtxRetain");
    library.find(context_release, "cuDevicePrimaryCtxRelease_v2");
    library.find(context_set, "cuCtxSetCurrent");
  }

  bool is_cuda() const { return api == Gpu::Cuda; }
  const char* name() const { return is_cuda() ? "CUDA" : "HIP"; }

  void check(int status, std::string_view what) const {
    if (status != 0)
      throw std::runtime_error(fmt::format("{}: {}: error {}", name(), what, status));
  }
};

// The GPU and what it holds.
struct DriverState {
  Driver driver;
  int device = 0;
  Handle context = nullptr, module = nullptr, begin = nullptr, end = nullptr;
  Address pass = 0, arrays = 0;
  std::map<std::string, Handle, std::less<>> kernels;

  DriverState(Gpu api, const std::string& library) : driver(api, library) {
    int count = 0;
    int status = driver.init(0);
    if (status == 0) status = driver.device_count(&count);
    if (count == 0)
      throw NoDevice(fmt::format("{} finds no device: error {}", driver.name(), status));
    driver.check(driver.device_get(&device, 0), "the device");
    if (!driver.is_cuda()) return;  // HIP uses the first device by itself
    driver.check(driver.context_retain(&context, device), "context");
    driver.check(driver.context_set(context), "context");
  }
  DriverState(const DriverState&) = delete;
  DriverState& operator=(const DriverState&) = delete;
  ~DriverState() {
    if (begin != nullptr) driver.event_destroy(begin);
    if (end != nullptr) driver.event_destroy(end);
    if (arrays != 0) driver.free(arrays);
    if (pass != 0) driver.free(pass);
    if (module != nullptr) driver.module_unload(module);
    if (context != nullptr) driver.context_release(device);
  }

  // Loads a module; returns why it cannot be loaded, or nothing.
  std::string load(const std::string& image) {
    constexpr int error_log_buffer = 5, error_log_buffer_size_bytes = 6;  // CUjit_option
    std::string log(16384, '\0');
    std::array options{error_log_buffer, error_log_buffer_size_bytes};
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the driver takes numbers as pointers
    std::array<void*, 2> values{log.data(), reinterpret_cast<void*>(log.size())};
    const unsigned count = driver.is_cuda() ? 2 : 0;
    const int status =
        driver.module_load(&module, image.c_str(), count, options.data(), values.data());
    if (status == 0) return "";
    module = nullptr;
    return fmt::format("error {} {}", status, log.c_str());
  }

  void load_first(std::span<const std::string> images) {
    std::vector<std::string> faults;
    for (const std::string& image : images) {
      faults.push_back(load(image));
      if (module != nullptr) return;
    }
    throw std::runtime_error(
        fmt::format("{} rejects the kernels: {}", driver.name(), fmt::join(faults, "; ")));
  }

  Handle kernel(std::string_view name) {
    const auto found = kernels.find(name);
    if (found != kernels.end()) return found->second;
    const std::string key(name);
    driver.check(driver.module_function(&kernels[key], module, key.c_str()), key);
    return kernels[key];
  }
};

class DriverDevice final : public KernelDevice {
 public:
  DriverDevice(Gpu api, const KernelCode& code, HostArrays& arrays, const std::string& library);

  std::string name() const override;

 private:
  void write(Memory to, std::span<const std::byte> bytes) override;
  void read(std::span<std::byte> bytes) override;
  double launch(const Launch& launch) override;

  DriverState state_;
};

DriverDevice::DriverDevice(Gpu api, const KernelCode& code, HostArrays& arrays,
                           const std::string& library)
    : KernelDevice(arrays), state_(api, library) {
  DriverState& s = state_;
  if (api == Gpu::Cuda)
    s.load_first(std::span(&code.ptx, 1));
  else
    s.load_first(code.code_objects);
  s.driver.check(s.driver.allocate(&s.pass, most_of_a_pass), "memory of a pass");
  s.driver.check(s.driver.allocate(&s.arrays, arrays.size()), "memory of the arrays");
  s.driver.check(s.driver.event_create(&s.begin, 0), "event");
  s.driver.check(s.driver.event_create(&s.end, 0), "event");
}

std::string DriverDevice::name() const {
  std::array<char, 256> text{};
  const Driver& driver = state_.driver;
  driver.check(driver.device_name(text.data(), static_cast<int>(text.size()), state_.device),
               "name");
  return text.data();
}

void DriverDevice::write(Memory to, std::span<const std::byte> bytes) {
  const Address address = to == Memory::Pass ? state_.pass : state_.arrays;
  state_.driver.check(state_.driver.copy_to(address, bytes.data(), bytes.size()),
                      "copy to the device");
}

void DriverDevice::read(std::span<std::byte> bytes) {
  state_.driver.check(state_.driver.copy_from(bytes.data(), state_.arrays, bytes.size()),
                      "copy from the device");
}

double DriverDevice::launch(const Launch& launch) {
  DriverState& s = state_;
  const Driver& driver = s.driver;
  Launch own = launch;
  std::array<void*, 5> parameters{&s.pass, &own.indices, &s.arrays, &own.host, &own.size};
  const Handle kernel = s.kernel(launch.kernel);
  driver.check(driver.event_record(s.begin, nullptr), "event");
  driver.check(driver.launch(kernel, static_cast<unsigned>(launch.groups), 1, 1, group, 1, 1, 0,
                             nullptr, parameters.data(), nullptr),
               launch.kernel);
  driver.check(driver.event_record(s.end, nullptr), "event");
  driver.check(driver.synchronize(), launch.kernel);
  float ms = 0;
  driver.check(driver.event_elapsed(&ms, s.begin, s.end), "event");
  return ms;
}

}  // namespace

std::unique_ptr<KernelDevice> open_gpu(Gpu gpu, const KernelCode& code, HostArrays& arrays,
                                       const std::string& library) {
  return std::make_unique<DriverDevice>(gpu, code, arrays, library);
}

}  // namespace groundray::testing
