#include "terrain/dem/local_files.h"

#include <cpl_vsi_virtual.h>
#include <sys/stat.h>

#include <cerrno>

namespace groundray {
namespace {

// GDAL's own file system, restricted to regular files.
class RegularFiles final : public VSIFilesystemHandler {
 public:
  explicit RegularFiles(VSIFilesystemHandler& all) : all_(all) {}

  VSIVirtualHandle* Open(const char* name, const char* access, bool sets_error,
                         CSLConstList options) override {
    struct stat status {};
    if (stat(name, &status) == 0 && !S_ISREG(status.st_mode)) {
      errno = ESPIPE;
      return nullptr;
    }
    return all_.Open(name, access, sets_error, options);
  }
  int Stat(const char* name, VSIStatBufL* status, int flags) override {
    return all_.Stat(name, status, flags);
  }
  int Unlink(const char* name) override { return all_.Unlink(name); }
  int Rename(const char* from, const char* to) override { return all_.Rename(from, to); }
  int Mkdir(const char* name, long mode) override { return all_.Mkdir(name, mode); }
  int Rmdir(const char* name) override { return all_.Rmdir(name); }
  char** ReadDirEx(const char* name, int most) override { return all_.ReadDirEx(name, most); }
  VSIDIR* OpenDir(const char* name, int depth, const char* const* options) override {
    return all_.OpenDir(name, depth, options);
  }
  GIntBig GetDiskFreeSpace(const char* name) override { return all_.GetDiskFreeSpace(name); }
  int SupportsSparseFiles(const char* name) override { return all_.SupportsSparseFiles(name); }
  bool IsLocal(const char* name) override { return all_.IsLocal(name); }

 private:
  VSIFilesystemHandler& all_;
};

}  // namespace

void refuse_pipes_to_gdal() {
  // GDAL forgets the handler that it replaces and deletes its successor at the process's end.
  static auto& all = *VSIFileManager::GetHandler("");
  VSIFileManager::InstallHandler("", new RegularFiles(all));
}

}  // namespace groundray
