#include "test/device/opencl_device.h"

#define CL_TARGET_OPENCL_VERSION 300
#include <CL/cl.h>
#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <vector>

namespace groundray::testing {
namespace {

void check(cl_int status, std::string_view what) {
  if (status != CL_SUCCESS) throw std::runtime_error(fmt::format("OpenCL: {}: {}", what, status));
}

// Returns a text that OpenCL's function `get` has about a device or program.
template <typename Get>
std::string text_of(const Get& get) {
  std::size_t size = 0;
  if (get(0, nullptr, &size) != CL_SUCCESS || size == 0) return "";
  std::string text(size, '\0');
  get(size, text.data(), nullptr);
  text.resize(text.find('\0'));
  return text;
}

std::string text_of(cl_device_id device, cl_device_info what) {
  return text_of([&](std::size_t size, void* text, std::size_t* needed) {
    return clGetDeviceInfo(device, what, size, text, needed);
  });
}

// Returns the first device with double precision, or nullptr.
cl_device_id find_device() {
  cl_uint count = 0;
  if (clGetPlatformIDs(0, nullptr, &count) != CL_SUCCESS) return nullptr;
  std::vector<cl_platform_id> platforms(count);
  if (count > 0) check(clGetPlatformIDs(count, platforms.data(), nullptr), "platforms");
  for (const cl_platform_id platform : platforms) {
    cl_uint found = 0;
    if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &found) != CL_SUCCESS) continue;
    std::vector<cl_device_id> devices(found);
    check(clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, found, devices.data(), nullptr), "devices");
    for (const cl_device_id device : devices) {
      cl_device_fp_config doubles = 0;
      clGetDeviceInfo(device, CL_DEVICE_DOUBLE_FP_CONFIG, sizeof doubles, &doubles, nullptr);
      if (doubles != 0) return device;
    }
  }
  return nullptr;
}

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(fmt::format("{}: it cannot be read", file.string()));
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

struct OpenClDevice::State {
  HostArrays& arrays;
  cl_device_id device = nullptr;
  cl_context context = nullptr;
  cl_command_queue queue = nullptr;
  cl_program program = nullptr;
  cl_mem pass = nullptr;  // bytes of a pass
  cl_mem copy = nullptr;  // of the host's arrays
  std::map<std::string, cl_kernel, std::less<>> kernels;

  explicit State(HostArrays& of) : arrays(of) {}
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() {
    for (const auto& [name, kernel] : kernels) clReleaseKernel(kernel);
    if (copy != nullptr) clReleaseMemObject(copy);
    if (pass != nullptr) clReleaseMemObject(pass);
    if (program != nullptr) clReleaseProgram(program);
    if (queue != nullptr) clReleaseCommandQueue(queue);
    if (context != nullptr) clReleaseContext(context);
  }

  void build(const std::filesystem::path& folder) {
    cl_int status = CL_SUCCESS;
    const bool takes_spirv = text_of(device, CL_DEVICE_IL_VERSION).find("SPIR-V") == 0;
    const std::string code = read(folder / (takes_spirv ? "passes.spv" : "passes.spir"));
    const std::size_t size = code.size();
    if (takes_spirv) {
      program = clCreateProgramWithIL(context, code.data(), size, &status);
    } else {
      const auto* bytes = reinterpret_cast<const unsigned char*>(code.data());
      program = clCreateProgramWithBinary(context, 1, &device, &size, &bytes, nullptr, &status);
    }
    check(status, "the kernels");
    const char* const options = takes_spirv ? "" : "-x spir -spir-std=1.2";
    if (clBuildProgram(program, 1, &device, options, nullptr, nullptr) == CL_SUCCESS) return;
    throw std::runtime_error(
        "OpenCL: the kernels: " + text_of([&](std::size_t room, void* text, std::size_t* needed) {
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

std::optional<std::string> OpenClDevice::name() {
  const cl_device_id device = find_device();
  if (device == nullptr) return std::nullopt;
  return text_of(device, CL_DEVICE_NAME) + ", " + text_of(device, CL_DEVICE_VERSION);
}

OpenClDevice::OpenClDevice(const std::filesystem::path& kernels, HostArrays& arrays)
    : state_(std::make_unique<State>(arrays)) {
  constexpr std::size_t most_of_a_pass = 4096;
  State& s = *state_;
  cl_int status = CL_SUCCESS;
  s.device = find_device();
  s.context = clCreateContext(nullptr, 1, &s.device, nullptr, nullptr, &status);
  check(status, "context");
  s.queue = clCreateCommandQueueWithProperties(s.context, s.device, nullptr, &status);
  check(status, "queue");
  s.build(kernels);
  s.pass = clCreateBuffer(s.context, CL_MEM_READ_ONLY, most_of_a_pass, nullptr, &status);
  check(status, "memory of a pass");
  s.copy = clCreateBuffer(s.context, CL_MEM_READ_WRITE, arrays.size(), nullptr, &status);
  check(status, "memory of the arrays");
}

OpenClDevice::~OpenClDevice() = default;

void OpenClDevice::run(std::string_view name, std::span<const std::byte> bytes, std::size_t count) {
  if (count == 0) return;
  const HostArrays::Use elsewhere(nullptr);
  State& s = *state_;
  const cl_kernel kernel = s.kernel(name);
  // Whole words, as the kernel reads them.
  std::vector<std::byte> words(bytes.begin(), bytes.end());
  words.resize((words.size() + 7) / 8 * 8);
  const cl_ulong indices = count, host = reinterpret_cast<std::uintptr_t>(s.arrays.begin()),
                 size = s.arrays.size();
  cl_uint argument = 0;
  const auto set = [&]<typename Value>(const Value& value) {
    check(clSetKernelArg(kernel, argument, sizeof(Value), static_cast<const void*>(&value)),
          fmt::format("argument {}", argument));
    ++argument;
  };
  set(s.pass);
  set(indices);
  set(s.copy);
  set(host);
  set(size);
  const std::size_t used = s.arrays.used();
  check(clEnqueueWriteBuffer(s.queue, s.pass, CL_TRUE, 0, words.size(), words.data(), 0, nullptr,
                             nullptr),
        "copy to the device");
  check(clEnqueueWriteBuffer(s.queue, s.copy, CL_TRUE, 0, used, s.arrays.begin(), 0, nullptr,
                             nullptr),
        "copy to the device");
  constexpr std::size_t group = 64;
  const std::size_t all = (count + group - 1) / group * group;
  s.arrays.set_reachable(false);
  const cl_int status =
      clEnqueueNDRangeKernel(s.queue, kernel, 1, nullptr, &all, &group, 0, nullptr, nullptr);
  const cl_int finished = clFinish(s.queue);
  s.arrays.set_reachable(true);
  check(status, name);
  check(finished, name);
  check(
      clEnqueueReadBuffer(s.queue, s.copy, CL_TRUE, 0, used, s.arrays.begin(), 0, nullptr, nullptr),
      "copy from the device");
}

}  // namespace groundray::testing
