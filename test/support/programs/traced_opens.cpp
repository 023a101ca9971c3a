// Library for LD_PRELOAD that lists the files which a program opens to write them, for
// written_files_test.py: a line for each in the file $OPENS, with a word and the name.
//
//   new     it is created, and nothing of its name was there, nor a link: O_CREAT and O_EXCL
//   other   it may have been there
#include <dlfcn.h>
#include <fcntl.h>
#include <unistd.h>

#include <climits>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

// Returns the list's descriptor; -1 without one.
int list() {
  static const int file = [] {
    const char* const name = std::getenv("OPENS");
    const auto real = reinterpret_cast<int (*)(const char*, int, ...)>(dlsym(RTLD_NEXT, "open"));
    return name == nullptr ? -1 : real(name, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  }();
  return file;
}

void note(const char* name, bool is_new) {
  char folder[PATH_MAX] = "";
  char line[2 * PATH_MAX];
  const bool is_relative = name[0] != '/' && getcwd(folder, sizeof folder) != nullptr;
  const int size = std::snprintf(line, sizeof line, "%s %s%s%s\n", is_new ? "new" : "other", folder,
                                 is_relative ? "/" : "", name);
  if (list() >= 0 && size > 0) (void)!write(list(), line, static_cast<std::size_t>(size));
}

void note_flags(const char* name, int flags) {
  constexpr int all = O_CREAT | O_EXCL;
  if ((flags & O_ACCMODE) != O_RDONLY) note(name, (flags & all) == all);
}

template <typename Function>
Function real(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

mode_t mode_of(int flags, va_list more) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
}

}  // namespace

#define OPEN(function)                                                         \
  extern "C" int function(const char* name, int flags, ...) {                  \
    va_list more;                                                              \
    va_start(more, flags);                                                     \
    const mode_t mode = mode_of(flags, more);                                  \
    va_end(more);                                                              \
    note_flags(name, flags);                                                   \
    return real<int (*)(const char*, int, ...)>(#function)(name, flags, mode); \
  }
OPEN(open)
OPEN(open64)

#define OPENAT(function)                                                                    \
  extern "C" int function(int folder, const char* name, int flags, ...) {                   \
    va_list more;                                                                           \
    va_start(more, flags);                                                                  \
    const mode_t mode = mode_of(flags, more);                                               \
    va_end(more);                                                                           \
    note_flags(name, flags);                                                                \
    return real<int (*)(int, const char*, int, ...)>(#function)(folder, name, flags, mode); \
  }
OPENAT(openat)
OPENAT(openat64)

#define CREAT(function)                                               \
  extern "C" int function(const char* name, mode_t mode) {            \
    note(name, false);                                                \
    return real<int (*)(const char*, mode_t)>(#function)(name, mode); \
  }
CREAT(creat)
CREAT(creat64)

#define FOPEN(function)                                                           \
  extern "C" std::FILE* function(const char* name, const char* mode) {            \
    if (std::strpbrk(mode, "wa+") != nullptr) note(name, false);                  \
    return real<std::FILE* (*)(const char*, const char*)>(#function)(name, mode); \
  }
FOPEN(fopen)
FOPEN(fopen64)
