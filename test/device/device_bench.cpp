// Times of the terrain's passes on the host's threads and as kernels of a device. It is linked to
// no library but the system's, so that it can be carried to a machine that has only a driver.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <thread>

#include "test/device/embedded_kernels.h"
#include "test/support/terrain/pass_results.h"

namespace groundray::device_bench {
namespace {

using testing::HostArrays;
using testing::KernelDevice;
using Times = KernelDevice::Times;

constexpr int block_cells = 2, runs = 5;
constexpr double tolerance_m = 2;

// Reads a DEM of the format AAIGrid (Esri ASCII grid), with NaN for missing heights.
HeightGrid read_dem(const char* file) {
  std::map<std::string, double> header = {{"ncols", 0},     {"nrows", 0},         {"xllcorner", 0},
                                          {"yllcorner", 0}, {"cellsize", 0},      {"dx", 0},
                                          {"dy", 0},        {"NODATA_value", NAN}};
  std::vector<float> heights_m;
  std::ifstream in(file);
  for (std::string word; in >> word;) {
    const auto key = header.find(word);
    if (key != header.end()) {
      in >> word;
      key->second = std::strtod(word.c_str(), nullptr);
      continue;
    }
    const float height_m = std::strtof(word.c_str(), nullptr);
    const bool is_missing = height_m == static_cast<float>(header["NODATA_value"]);
    heights_m.push_back(is_missing ? std::numeric_limits<float>::quiet_NaN() : height_m);
  }
  const glm::ivec2 size(header["ncols"], header["nrows"]);
  if (size.x < 2 || size.y < 2 || heights_m.size() != std::size_t(size.x) * std::size_t(size.y))
    throw std::runtime_error(fmt::format("{}: it is no DEM of the format AAIGrid", file));
  const double cell_m = header["cellsize"];
  const glm::dvec2 step_m(cell_m > 0 ? cell_m : header["dx"], cell_m > 0 ? cell_m : header["dy"]);
  return {size, {0, 0}, {step_m.x, -step_m.y}, std::move(heights_m)};
}

// Run of a pass on the host (all_ms) or a device; those that are never a device's have no name.
struct Call {
  std::string name;
  Times times;
};

// Appends calls, without taking memory of the arrays.
class Calls {
 public:
  void add(std::string_view name, const Times& times) {
    const HostArrays::Use elsewhere(nullptr);
    all_.push_back({std::string(name), times});
  }
  const std::vector<Call>& all() const { return all_; }

 private:
  std::vector<Call> all_;
};

// Returns `host`, with its times as calls.
template <typename Host>
auto timed(Host host, Calls& calls) {
  return [host, &calls](std::size_t count, const PassRunner::Work& work) {
    const auto begin = std::chrono::steady_clock::now();
    host(count, work);
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
    calls.add("", {.kernel_ms = 0, .all_ms = time.count()});
  };
}

class TimedDevice final : public PassDevice {
 public:
  TimedDevice(KernelDevice& device, Calls& calls) : device_(device), calls_(calls) {}
  void run(std::string_view name, std::span<const std::byte> bytes, std::size_t count) override {
    device_.run(name, bytes, count);
    calls_.add(name, count > 0 ? device_.last_times() : Times{});
  }

 private:
  KernelDevice& device_;
  Calls& calls_;
};

// Returns the calls of several runs, with the shortest times of each.
template <typename Run>
std::vector<Call> best_calls(const Run& run) {
  std::vector<Call> best;
  for (int i = 0; i < runs; ++i) {
    Calls calls;
    run(calls);
    if (best.empty()) best = calls.all();
    for (std::size_t call = 0; call < best.size(); ++call) {
      Times& times = best[call].times;
      const Times& found = calls.all().at(call).times;
      times.kernel_ms = std::min(times.kernel_ms, found.kernel_ms);
      times.all_ms = std::min(times.all_ms, found.all_ms);
    }
  }
  return best;
}

// Times of all calls of a pass, ms.
struct Row {
  std::string name;
  int calls = 0;
  double one_thread_ms = 0, all_threads_ms = 0, kernel_ms = 0, device_ms = 0;

  void add(const Row& other) {
    calls += other.calls;
    one_thread_ms += other.one_thread_ms;
    all_threads_ms += other.all_threads_ms;
    kernel_ms += other.kernel_ms;
    device_ms += other.device_ms;
  }
  void print() const {
    fmt::print("{:<20}{:>6}{:>11.3f}{:>11.3f}{:>11.3f}{:>11.3f}{:>9.2f}\n", name, calls,
               one_thread_ms, all_threads_ms, kernel_ms, device_ms, all_threads_ms / kernel_ms);
  }
};

// The same calls in the same order, of which the device's have names.
std::vector<Row> rows_of(const std::vector<Call>& one_thread, const std::vector<Call>& all_threads,
                         const std::vector<Call>& device) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < device.size(); ++i) {
    const Call& call = device[i];
    if (call.name.empty()) continue;
    auto row = std::ranges::find(rows, call.name, &Row::name);
    if (row == rows.end()) row = rows.insert(row, {.name = call.name});
    row->add({.calls = 1,
              .one_thread_ms = one_thread.at(i).times.all_ms,
              .all_threads_ms = all_threads.at(i).times.all_ms,
              .kernel_ms = call.times.kernel_ms,
              .device_ms = call.times.all_ms});
  }
  return rows;
}

std::unique_ptr<KernelDevice> open_device(std::string_view backend, HostArrays& arrays) {
  const testing::KernelCode code = testing::embedded_kernels();
  if (backend == "--cuda") return testing::open_gpu(testing::Gpu::Cuda, code, arrays);
  if (backend == "--hip") return testing::open_gpu(testing::Gpu::Hip, code, arrays);
  return testing::open_opencl(code, arrays);
}

void measure(std::string_view backend, const char* file) {
  const HeightGrid dem = read_dem(file);
  const MeshBound bound{.tolerance_m = tolerance_m, .cell_m = glm::abs(dem.step_m())};
  std::size_t used = 0;
  testing::PassResults expected;
  {
    constexpr std::size_t address_space = std::size_t{1} << 36;
    HostArrays arrays(address_space);
    const HostArrays::Use use(&arrays);
    const HeightGrid grid = testing::deep_copy(dem);
    const testing::PassResults found = testing::results_of(grid, bound, block_cells, {});
    used = arrays.used();
    const HostArrays::Use elsewhere(nullptr);
    expected = found;
  }
  constexpr std::size_t reserve = std::size_t{16} << 20, most_bytes = std::size_t{1} << 31;
  if (used + reserve > most_bytes)
    throw std::runtime_error(fmt::format("{}: its arrays take {} MB of at most {}", file,
                                         used >> 20, (most_bytes - reserve) >> 20));
  HostArrays arrays(used + reserve);
  const std::unique_ptr<KernelDevice> device = open_device(backend, arrays);
  fmt::print("{}\n{}: {} x {} samples, bound {} m, blocks of {} cells\n", device->name(), file,
             dem.columns(), dem.rows(), tolerance_m, block_cells);

  const auto on_device = [&](const PassRunner& runner, const auto& act) {
    {
      const HostArrays::Use use(&arrays);
      const HeightGrid grid = testing::deep_copy(dem);
      act(grid, runner);
    }
    arrays.clear();
  };
  on_device(PassRunner(*device), [&](const HeightGrid& grid, const PassRunner& runner) {
    const testing::PassResults found = testing::results_of(grid, bound, block_cells, runner);
    const HostArrays::Use elsewhere(nullptr);
    const std::string difference = testing::difference(found, expected);
    if (!difference.empty()) throw std::runtime_error("the device's arrays differ: " + difference);
  });
  fmt::print("all arrays are the same bytes as the host's; {} triangles\n",
             expected.mesh.triangles.size());

  const auto mesh = [&](const HeightGrid& grid, const PassRunner& runner) {
    build_terrain_mesh(grid, bound, block_cells, runner);
  };
  const auto serial = [](std::size_t count, const PassRunner::Work& work) { work(0, count); };
  const auto one_thread = best_calls([&](Calls& calls) { mesh(dem, timed(serial, calls)); });
  const auto all_threads =
      best_calls([&](Calls& calls) { mesh(dem, timed(run_in_parallel, calls)); });
  const auto kernels = best_calls([&](Calls& calls) {
    TimedDevice timed_device(*device, calls);
    PassRunner runner(timed(run_in_parallel, calls));
    runner.device = &timed_device;
    on_device(runner, mesh);
  });

  fmt::print("\nms, the best of {} runs of each call; copies are of all arrays, {} MB\n", runs,
             used >> 20);
  fmt::print("{:<20}{:>6}{:>11}{:>11}{:>11}{:>11}{:>9}\n", "pass", "calls", "1 thread",
             fmt::format("{} threads", std::thread::hardware_concurrency()), "kernel", "+ copies",
             "ratio");
  Row sum{.name = "sum"};
  for (const Row& row : rows_of(one_thread, all_threads, kernels)) {
    row.print();
    sum.add(row);
  }
  sum.print();
  fmt::print("ratio: time of all threads / time of the kernel\n");
}

}  // namespace
}  // namespace groundray::device_bench

int main(int count, char** arguments) {
  const std::string_view backend = count > 1 ? arguments[1] : "";
  if (count != 3 || (backend != "--opencl" && backend != "--cuda" && backend != "--hip")) {
    fmt::print(stderr, "usage: device_bench --opencl|--cuda|--hip DEM.asc\n");
    return 2;
  }
  try {
    groundray::device_bench::measure(backend, arguments[2]);
  } catch (const std::exception& fault) {
    fmt::print(stderr, "device_bench: {}\n", fault.what());
    return 1;
  }
}
