#include <benchmark/benchmark.h>
#include <malloc.h>

int main(int argc, char** argv) {
  // As the program does: memory of one scan serves the next, instead of going back to the system.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
