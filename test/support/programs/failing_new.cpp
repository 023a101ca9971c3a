// Library for LD_PRELOAD that lets one call of `operator new` fail, for allocation_test.py. A
// call is identified by its call stack, which is the same in every run, unlike its number.
//
//   NEW_CALLS=FILE  appends a line for each new call stack: its name, and the file of the program
//   or
//                   library that calls
//   NEW_FAILS=NAME  lets the first call with this stack throw std::bad_alloc, and writes the stack
//                   to standard error if NEW_SHOWN is set
//
// Only calls between the start and the end of main() count: nothing can catch an exception earlier
// or later.
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <unistd.h>
#include <unwind.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

namespace {

constexpr int most_frames = 8;
constexpr std::size_t slots = 1 << 20;

std::atomic<bool> is_in_main{false};
int calls = -1;                         // NEW_CALLS
std::atomic<std::uint64_t> failing{0};  // NEW_FAILS
std::array<std::atomic<std::uint64_t>, slots> known;

struct Stack {
  std::uint64_t name = 0xcbf29ce484222325;
  int frames = -2;  // of these functions
  const char* caller = nullptr;
};

// Returns whether an object is not libstdc++, which calls `operator new` for all others.
bool can_call(const char* file) { return std::strstr(file, "libstdc++") == nullptr; }

_Unwind_Reason_Code add_frame(_Unwind_Context* context, void* to) {
  auto& stack = *static_cast<Stack*>(to);
  if (++stack.frames <= 0) return _URC_NO_REASON;
  // NOLINTNEXTLINE(performance-no-int-to-ptr): the unwinder gives integers
  auto* const place = reinterpret_cast<char*>(_Unwind_GetIP(context));
  dl_find_object object{};
  const bool is_known = _dl_find_object(place, &object) == 0;
  const auto offset =
      static_cast<std::uint64_t>(is_known ? place - static_cast<char*>(object.dlfo_map_start) : 0);
  if (is_known && stack.caller == nullptr && can_call(object.dlfo_link_map->l_name))
    stack.caller = object.dlfo_link_map->l_name;
  stack.name = (stack.name ^ offset) * 0x100000001b3;
  stack.name ^= stack.name >> 29;
  return stack.frames < most_frames ? _URC_NO_REASON : _URC_END_OF_STACK;
}

bool is_new(std::uint64_t name) {
  for (std::size_t i = name % slots;; i = (i + 1) % slots) {
    std::uint64_t empty = 0;
    if (known[i].compare_exchange_strong(empty, name)) return true;
    if (empty == name) return false;
  }
}

// Returns whether this call must fail.
[[gnu::noinline]] bool fails() {
  if (!is_in_main) return false;
  thread_local bool is_within = false;  // the unwinder may allocate
  if (is_within) return false;
  is_within = true;
  Stack stack;
  _Unwind_Backtrace(add_frame, &stack);
  bool result = false;
  if (calls >= 0 && is_new(stack.name)) {
    std::array<char, 512> line{};
    const int length = std::snprintf(line.data(), line.size(), "%016lx %s\n", stack.name,
                                     stack.caller == nullptr ? "" : stack.caller);
    static_cast<void>(!write(calls, line.data(), static_cast<std::size_t>(length)));
  }
  std::uint64_t wanted = stack.name;
  if (calls < 0 && failing.compare_exchange_strong(wanted, 0)) {
    result = true;
    if (std::getenv("NEW_SHOWN") != nullptr) {
      std::array<void*, 40> places{};
      backtrace_symbols_fd(places.data(), backtrace(places.data(), 40), STDERR_FILENO);
    }
  }
  is_within = false;
  return result;
}

void* allocated(std::size_t size, std::size_t alignment) {
  if (fails()) throw std::bad_alloc();
  void* const memory =
      alignment == 0
          ? std::malloc(size == 0 ? 1 : size)
          : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

int (*true_main)(int, char**, char**);

int counted_main(int count, char** arguments, char** environment) {
  if (const char* file = std::getenv("NEW_CALLS"))
    calls = open(file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (const char* name = std::getenv("NEW_FAILS")) failing = std::strtoull(name, nullptr, 16);
  is_in_main = true;
  const int code = true_main(count, arguments, environment);
  is_in_main = false;
  return code;
}

}  // namespace

void* operator new(std::size_t size) { return allocated(size, 0); }
void* operator new[](std::size_t size) { return allocated(size, 0); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocated(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return allocated(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming): glibc's
extern "C" int __libc_start_main(int (*main)(int, char**, char**), int count, char** arguments,
                                 void (*init)(), void (*fini)(), void (*rtld_fini)(), void* end) {
  using Start =
      int (*)(int (*)(int, char**, char**), int, char**, void (*)(), void (*)(), void (*)(), void*);
  true_main = main;
  const auto start = reinterpret_cast<Start>(dlsym(RTLD_NEXT, "__libc_start_main"));
  return start(counted_main, count, arguments, init, fini, rtld_fini, end);
}
