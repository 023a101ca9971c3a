// Driver of a GPU that is not there, with the functions of CUDA and HIP that driver_device.cpp
// calls: kernels are passes.hip compiled for the CPU, memory is apart from the host's, and every
// address, size and handle is checked.
#include <dlfcn.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string_view>

#include "test/device/passes.hip"

namespace {

constexpr int success = 0, invalid_value = 1, invalid_image = 200, not_found = 500;
using Kernel = void(const Word* bytes, Word count, char* arrays, Word host, Word size);

int context = 0, code = 0;                     // their addresses are handles
std::map<std::uintptr_t, std::size_t> memory;  // bytes of each block, by its address
Word index_of_kernel = 0;

bool is_allocated(std::uintptr_t address, std::size_t bytes) {
  auto above = memory.upper_bound(address);
  if (above == memory.begin()) return false;
  const auto [begin, size] = *--above;
  return address - begin + bytes <= size;
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming,bugprone-*,performance-no-int-to-ptr): CUDA's names
extern "C" {

Word _Z13get_global_idj(unsigned) { return index_of_kernel; }

int cuInit(unsigned flags) { return flags == 0 ? success : invalid_value; }

int cuDeviceGetCount(int* count) {
  *count = 1;
  return success;
}

int cuDeviceGet(int* device, int ordinal) {
  *device = 7;
  return ordinal == 0 ? success : invalid_value;
}

int cuDeviceGetName(char* name, int room, int device) {
  std::snprintf(name, static_cast<std::size_t>(room), "the CPU behind a fake driver");
  return device == 7 ? success : invalid_value;
}

int cuDevicePrimaryCtxRetain(void** made, int device) {
  *made = &context;
  return device == 7 ? success : invalid_value;
}

int cuDevicePrimaryCtxRelease_v2(int device) { return device == 7 ? success : invalid_value; }
int cuCtxSetCurrent(void* current) { return current == &context ? success : invalid_value; }
int cuCtxSynchronize() { return success; }

// Takes PTX by its .entry, and ELF files as AMD's code objects.
int cuModuleLoadDataEx(void** module, const void* image, unsigned count, const int* options,
                       void** values) {
  const char* const text = static_cast<const char*>(image);
  *module = &code;
  if (std::strncmp(text, "\177ELF", 4) == 0 || std::strstr(text, ".entry ") != nullptr)
    return success;
  for (unsigned i = 0; i < count; ++i) {
    if (options[i] == 5) std::strcpy(static_cast<char*>(values[i]), "no entry of a kernel");
  }
  return invalid_image;
}

int cuModuleUnload(void* module) { return module == &code ? success : invalid_value; }

int cuModuleGetFunction(void** function, void* module, const char* name) {
  *function = dlsym(RTLD_DEFAULT, name);
  return module == &code && *function != nullptr ? success : not_found;
}

int cuMemAlloc_v2(Word* address, std::size_t bytes) {
  constexpr std::size_t alignment = 256;  // as CUDA promises
  *address = reinterpret_cast<Word>(std::aligned_alloc(alignment, bytes));
  memory[*address] = bytes;
  return success;
}

int cuMemFree_v2(Word address) {
  std::free(reinterpret_cast<void*>(address));
  return memory.erase(address) == 1 ? success : invalid_value;
}

int cuMemcpyHtoD_v2(Word to, const void* from, std::size_t bytes) {
  if (!is_allocated(to, bytes)) return invalid_value;
  std::memcpy(reinterpret_cast<char*>(to), from, bytes);
  return success;
}

int cuMemcpyDtoH_v2(void* to, Word from, std::size_t bytes) {
  if (!is_allocated(from, bytes)) return invalid_value;
  std::memcpy(to, reinterpret_cast<const char*>(from), bytes);
  return success;
}

int cuLaunchKernel(void* function, unsigned groups, unsigned groups_y, unsigned groups_z,
                   unsigned group, unsigned group_y, unsigned group_z, unsigned shared_bytes,
                   void* stream, void** parameters, void** extra) {
  const auto word = [&](int i) { return *static_cast<Word*>(parameters[i]); };
  const bool is_simple = groups_y == 1 && groups_z == 1 && group_y == 1 && group_z == 1 &&
                         shared_bytes == 0 && stream == nullptr && extra == nullptr;
  if (!is_simple || !is_allocated(word(0), 1) || !is_allocated(word(2), word(4)))
    return invalid_value;
  for (index_of_kernel = 0; index_of_kernel < Word{groups} * group; ++index_of_kernel) {
    reinterpret_cast<Kernel*>(function)(reinterpret_cast<const Word*>(word(0)), word(1),
                                        reinterpret_cast<char*>(word(2)), word(3), word(4));
  }
  return success;
}

int cuEventCreate(void** event, unsigned flags) {
  *event = &code;
  return flags == 0 ? success : invalid_value;
}

int cuEventRecord(void* event, void* stream) {
  return event == &code && stream == nullptr ? success : invalid_value;
}

int cuEventElapsedTime(float* ms, void* begin, void* end) {
  *ms = 0;
  return begin == &code && end == &code ? success : invalid_value;
}

int cuEventDestroy_v2(void* event) { return event == &code ? success : invalid_value; }

// HIP's names for the same.
#define ALIAS(hip, cuda) decltype(cuda) hip __attribute__((alias(#cuda)))
ALIAS(hipInit, cuInit);
ALIAS(hipGetDeviceCount, cuDeviceGetCount);
ALIAS(hipDeviceGet, cuDeviceGet);
ALIAS(hipDeviceGetName, cuDeviceGetName);
ALIAS(hipDeviceSynchronize, cuCtxSynchronize);
ALIAS(hipModuleLoadDataEx, cuModuleLoadDataEx);
ALIAS(hipModuleUnload, cuModuleUnload);
ALIAS(hipModuleGetFunction, cuModuleGetFunction);
ALIAS(hipMalloc, cuMemAlloc_v2);
ALIAS(hipFree, cuMemFree_v2);
ALIAS(hipMemcpyHtoD, cuMemcpyHtoD_v2);
ALIAS(hipMemcpyDtoH, cuMemcpyDtoH_v2);
ALIAS(hipModuleLaunchKernel, cuLaunchKernel);
ALIAS(hipEventCreateWithFlags, cuEventCreate);
ALIAS(hipEventRecord, cuEventRecord);
ALIAS(hipEventElapsedTime, cuEventElapsedTime);
ALIAS(hipEventDestroy, cuEventDestroy_v2);

}  // extern "C"
// NOLINTEND(readability-identifier-naming,bugprone-*,performance-no-int-to-ptr)
