#include <benchmark/benchmark.h>
#include <malloc.h>

int main(int argc, char** argv) {
  // As in the applications: freed memory of one scan is kept for the next, not returned to the
  // system.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
