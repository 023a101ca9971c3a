#define CL_TARGET_OPENCL_VERSION 300
#include <CL/cl.h>
#include <fmt/format.h>

#include <map>

#include "test/device/kernel_device.h"
#include "test/device/shared_library.h"

namespace groundray::testing {
namespace {

void check(cl_int status, std::string_view what) {
  if (status != CL_SUCCESS) throw std::runtime_error(fmt::format("OpenCL: {}: {}", what, status));
}

// OpenCL's functions that are used here.
#define GROUNDRAY_OPENCL(function)              \
  function(clBuildProgram);                     \
  function(clCreateBuffer);                     \
  function(clCreateCommandQueueWithProperties); \
  function(clCreateContext);                    \
  function(clCreateKernel);                     \
  function(clCreateProgramWithBinary);          \
  function(clCreateProgramWithIL);              \
  function(clEnqueueNDRangeKernel);             \
  function(clEnqueueReadBuffer);                \
  function(clEnqueueWriteBuffer);               \
  function(clGetDeviceIDs);                     \
  function(clGetDeviceInfo);                    \
  function(clGetEventProfilingInfo);            \
  function(clGetPlatformIDs);                   \
  function(clGetProgramBuildInfo);              \
  function(clReleaseCommandQueue);              \
  function(clReleaseContext);                   \
  function(clReleaseEvent);                     \
  function(clReleaseKernel);                    \
  function(clReleaseMemObject);                 \
  function(clReleaseProgram);                   \
  function(clSetKernelArg);                     \
  function(clWaitForEvents)

// The system's loader of OpenCL drivers.
struct OpenCl {
  // NOLINTBEGIN(bugprone-macro-parentheses,readability-identifier-naming): OpenCL's names
#define DECLARE(function) decltype(&::function) function = nullptr
  GROUNDRAY_OPENCL(DECLARE);
#undef DECLARE

  OpenCl() {
    const SharedLibrary library({"libOpenCL.so.1"});
#define FIND(function) library.find(function, #function)
    GROUNDRAY_OPENCL(FIND);
#undef FIND
  }
  // NOLINTEND(bugprone-macro-parentheses,readability-identifier-naming)

  // Returns the devices of a platform, or the platforms, by the function that lists them.
  template <typename Handle, typename List>
  static std::vector<Handle> all(const List& list) {
    cl_uint count = 0;
    if (list(0, nullptr, &count) != CL_SUCCESS) return {};
    std::vector<Handle> found(count);
    if (count > 0) check(list(count, found.data(), nullptr), "devices");
    return found;
  }

  // Returns a text that the function `get` has about a device or program.
  template <typename Get>
  static std::string text_of(const Get& get) {
    std::size_t size = 0;
    if (get(0, nullptr, &size) != CL_SUCCESS || size == 0) return "";
    std::string text(size, '\0');
    get(size, text.data(), nullptr);
    text.resize(text.find('\0'));
    return text;
  }

  std::string text_of(cl_device_id device, cl_device_info what) const {
    return text_of([&](std::size_t size, void* text, std::size_t* needed) {
      return clGetDeviceInfo(device, what, size, text, needed);
    });
  }

  bool takes_spirv(cl_device_id device) const {
    return text_of(device, CL_DEVICE_IL_VERSION).find("SPIR-V") == 0;
  }

  // Returns the first device with double precision that takes the kernels in either form.
  cl_device_id find_device() const {
    for (const auto platform : all<cl_platform_id>(clGetPlatformIDs)) {
      const auto list = [&](cl_uint count, cl_device_id* devices, cl_uint* found) {
        return clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, count, devices, found);
      };
      for (const auto device : all<cl_device_id>(list)) {
        cl_device_fp_config doubles = 0;
        clGetDeviceInfo(device, CL_DEVICE_DOUBLE_FP_CONFIG, sizeof doubles, &doubles, nullptr);
        const bool takes_spir =
            text_of(device, CL_DEVICE_EXTENSIONS).find("cl_khr_spir") != std::string::npos;
        if (doubles != 0 && (takes_spirv(device) || takes_spir)) return device;
      }
    }
    throw NoDevice("OpenCL finds no device with double precision that takes SPIR-V or SPIR");
  }
};

// The device and what it holds.
struct OpenClState : OpenCl {
  cl_device_id device = find_device();
  cl_context context = nullptr;
  cl_command_queue queue = nullptr;
  cl_program program = nullptr;
  cl_mem pass = nullptr, arrays = nullptr;
  std::map<std::string, cl_kernel, std::less<>> kernels;

  OpenClState() = default;
  OpenClState(const OpenClState&) = delete;
  OpenClState& operator=(const OpenClState&) = delete;
  ~OpenClState() {
    for (const auto& [name, kernel] : kernels) clReleaseKernel(kernel);
    if (arrays != nullptr) clReleaseMemObject(arrays);
    if (pass != nullptr) clReleaseMemObject(pass);
    if (program != nullptr) clReleaseProgram(program);
    if (queue != nullptr) clReleaseCommandQueue(queue);
    if (context != nullptr) clReleaseContext(context);
  }

  void build(const KernelCode& code) {
    cl_int status = CL_SUCCESS;
    const bool is_spirv = takes_spirv(device);
    const std::string& form = is_spirv ? code.spirv : code.spir;
    const std::size_t size = form.size();
    if (is_spirv) {
      program = clCreateProgramWithIL(context, form.data(), size, &status);
    } else {
      const auto* bytes = reinterpret_cast<const unsigned char*>(form.data());
      program = clCreateProgramWithBinary(context, 1, &device, &size, &bytes, nullptr, &status);
    }
    check(status, "the kernels");
    const char* const options = is_spirv ? "" : "-x spir -spir-std=1.2";
    if (clBuildProgram(program, 1, &device, options, nullptr, nullptr) == CL_SUCCESS) return;
    throw std::runtime_error(
        "OpenCL rejects the kernels: " +
        OpenCl::text_of([&](std::size_t room, void* text, std::size_t* needed) {
          return clGetProgramBuildInfo(program, device, CL_PROGRAM_BUILD_LOG, room, text, needed);
        }));
  }

  cl_kernel kernel(std::string_view name) {
    const auto found = kernels.find(name);
    if (found != kernels.end()) return found->second;
    cl_int status = CL_SUCCESS;
    const std::string key(name);
    const cl_kernel made = clCreateKernel(program, key.c_str(), &status);
    check(status, key);
    return kernels[key] = made;
  }
};

class OpenClDevice final : public KernelDevice {
 public:
  OpenClDevice(const KernelCode& code, HostArrays& arrays);

  std::string name() const override;

 private:
  void write(Memory to, std::span<const std::byte> bytes) override;
  void read(std::span<std::byte> bytes) override;
  double launch(const Launch& launch) override;

  OpenClState state_;
};

OpenClDevice::OpenClDevice(const KernelCode& code, HostArrays& arrays) : KernelDevice(arrays) {
  OpenClState& s = state_;
  cl_int status = CL_SUCCESS;
  s.context = s.clCreateContext(nullptr, 1, &s.device, nullptr, nullptr, &status);
  check(status, "context");
  const cl_queue_properties timed[] = {CL_QUEUE_PROPERTIES, CL_QUEUE_PROFILING_ENABLE, 0};
  s.queue = s.clCreateCommandQueueWithProperties(s.context, s.device, timed, &status);
  check(status, "queue");
  s.build(code);
  s.pass = s.clCreateBuffer(s.context, CL_MEM_READ_ONLY, most_of_a_pass, nullptr, &status);
  check(status, "memory of a pass");
  s.arrays = s.clCreateBuffer(s.context, CL_MEM_READ_WRITE, arrays.size(), nullptr, &status);
  check(status, "memory of the arrays");
}

std::string OpenClDevice::name() const {
  const OpenClState& s = state_;
  return s.text_of(s.device, CL_DEVICE_NAME) + ", " + s.text_of(s.device, CL_DEVICE_VERSION);
}

void OpenClDevice::write(Memory to, std::span<const std::byte> bytes) {
  OpenClState& s = state_;
  const bool is_pass = to == Memory::Pass;  // copied when the arrays, which come after it, are
  check(s.clEnqueueWriteBuffer(s.queue, is_pass ? s.pass : s.arrays, is_pass ? CL_FALSE : CL_TRUE,
                               0, bytes.size(), bytes.data(), 0, nullptr, nullptr),
        "copy to the device");
}

void OpenClDevice::read(std::span<std::byte> bytes) {
  OpenClState& s = state_;
  check(s.clEnqueueReadBuffer(s.queue, s.arrays, CL_TRUE, 0, bytes.size(), bytes.data(), 0, nullptr,
                              nullptr),
        "copy from the device");
}

double OpenClDevice::launch(const Launch& launch) {
  OpenClState& s = state_;
  const cl_kernel kernel = s.kernel(launch.kernel);
  cl_uint argument = 0;
  const auto set = [&]<typename Value>(const Value& value) {
    check(s.clSetKernelArg(kernel, argument, sizeof(Value), static_cast<const void*>(&value)),
          fmt::format("argument {}", argument));
    ++argument;
  };
  set(s.pass);
  set(launch.indices);
  set(s.arrays);
  set(launch.host);
  set(launch.size);
  constexpr std::size_t in_group = group;
  const std::size_t all = launch.groups * group;
  cl_event run = nullptr;
  check(s.clEnqueueNDRangeKernel(s.queue, kernel, 1, nullptr, &all, &in_group, 0, nullptr, &run),
        launch.kernel);
  const cl_int finished = s.clWaitForEvents(1, &run);
  cl_ulong begin_ns = 0, end_ns = 0;
  s.clGetEventProfilingInfo(run, CL_PROFILING_COMMAND_START, sizeof begin_ns, &begin_ns, nullptr);
  s.clGetEventProfilingInfo(run, CL_PROFILING_COMMAND_END, sizeof end_ns, &end_ns, nullptr);
  s.clReleaseEvent(run);
  check(finished, launch.kernel);
  return 1e-6 * static_cast<double>(end_ns - begin_ns);
}

}  // namespace

std::unique_ptr<KernelDevice> open_opencl(const KernelCode& code, HostArrays& arrays) {
  return std::make_unique<OpenClDevice>(code, arrays);
}

}  // namespace groundray::testing
