// Kernels of the passes of meshing and tracing: the same headers that the CPU runs, compiled for a device.
#define __device__ __attribute__((device))
#define __global__ __attribute__((global))
#define __host__ __attribute__((host))
#pragma clang force_cuda_host_device begin
#include "core/tracing/passes/trace_level.h"
#include "terrain/lod/passes/deviation.h"
#include "terrain/lod/passes/emission.h"
#include "terrain/lod/passes/leaf_list.h"
#include "terrain/lod/passes/prefix_sum.h"
#include "terrain/lod/passes/selection.h"
#pragma clang force_cuda_host_device end

using Word [[gnu::may_alias]] = unsigned long;  // of any type's bytes

#if defined(__NVPTX__)
static __device__ Word global_index() {
  return static_cast<Word>(__nvvm_read_ptx_sreg_ctaid_x()) * __nvvm_read_ptx_sreg_ntid_x() +
         __nvvm_read_ptx_sreg_tid_x();
}
#elif defined(__AMDGCN__)
static __device__ Word global_index() {
  return static_cast<Word>(__builtin_amdgcn_workgroup_id_x()) * __builtin_amdgcn_workgroup_size_x() +
         __builtin_amdgcn_workitem_id_x();
}
#else
extern "C" __device__ Word _Z13get_global_idj(unsigned);  // OpenCL's get_global_id
static __device__ Word global_index() { return _Z13get_global_idj(0); }
#endif

// Runs one index of a pass. Its bytes hold addresses of the host: those in [host, host + size) are replaced by addresses in
// `arrays`, the device's copy of that memory. Both are aligned to 256 bytes: so a `bool` beside padding, which may look like
// an address, stays as it is.
template <typename Pass>
static __device__ void run(const Word* bytes, Word count, char* arrays, Word host, Word size) {
  constexpr unsigned words = (sizeof(Pass) + sizeof(Word) - 1) / sizeof(Word);
  union Copy {
    Pass pass;
    Word all[words];
    __device__ Copy() {}
  } copy;
  for (unsigned i = 0; i < words; ++i) {
    const Word word = bytes[i];
    copy.all[i] = word - host < size ? word - host + reinterpret_cast<Word>(arrays) : word;
  }
  const Word index = global_index();
  if (index < count) copy.pass(index);
}

#define KERNEL(Pass)                                                                           \
  extern "C" __global__ void Pass(const Word* bytes, Word count, char* arrays, Word host, Word size) { \
    run<groundray::passes::Pass>(bytes, count, arrays, host, size);                            \
  }
KERNEL(DeviationPass)
KERNEL(JoinPartsPass)
KERNEL(SaturatePass)
KERNEL(SplitPass)
KERNEL(LeafPass)
KERNEL(CountLeavesPass)
KERNEL(ListLeavesPass)
KERNEL(SumCountsPass)
KERNEL(ReplaceCountsPass)
KERNEL(SumSumsPass)
KERNEL(ReplaceSumsPass)
KERNEL(NumberLeavesPass)
KERNEL(CountMarkedPass)
KERNEL(ListMarkedPass)
KERNEL(MarkVerticesPass)
KERNEL(CountMeshPass)
KERNEL(EmitVerticesPass)
KERNEL(EmitTrianglesPass)
KERNEL(HighPointPass)
KERNEL(TraceLevelPass)
