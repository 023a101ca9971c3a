#include "apps/dataset/file_sum.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <new>
#include <system_error>
#include <vector>

#include "core/error.h"
#include "core/io/open_file.h"

namespace groundray {
namespace {

namespace fs = std::filesystem;
using Context = std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)>;

Context make_context() {
  Context context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  if (!context) throw std::bad_alloc();
  return context;
}

void check_openssl(int is_done) {
  if (is_done != 1) throw Error("OpenSSL cannot compute SHA-256: check its configuration");
}

}  // namespace

Sha256::Sha256() : context_(make_context()) {
  check_openssl(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr));
}

void Sha256::add(std::string_view bytes) {
  check_openssl(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()));
}

std::string Sha256::digits() const {
  const Context copy = make_context();  // the original stays open for more bytes
  check_openssl(EVP_MD_CTX_copy_ex(copy.get(), context_.get()));
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  check_openssl(EVP_DigestFinal_ex(copy.get(), digest.data(), &size));
  std::string text;
  for (unsigned i = 0; i < size; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

std::string sha256_of(std::string_view bytes) {
  Sha256 sum;
  sum.add(bytes);
  return sum.digits();
}

FileSum sum_file(const fs::path& path) {
  constexpr std::size_t block_bytes = 256 << 10;
  const OwnedFile file = open_file(path);
  std::vector<char> block(block_bytes);
  Sha256 sum;
  FileSum result;
  while (std::feof(file.get()) == 0 && std::ferror(file.get()) == 0) {
    const std::size_t read = std::fread(block.data(), 1, block.size(), file.get());
    sum.add({block.data(), read});
    result.bytes += read;
  }
  if (std::ferror(file.get()) != 0) {
    throw Error("{}: cannot be read: {}; check the disk and the file's permissions", path.string(),
                std::generic_category().message(errno));
  }
  result.sha256 = sum.digits();
  return result;
}

std::optional<std::string> fault_of(const fs::path& file, const FileSum& as_written) {
  std::error_code fault;
  const fs::file_status status = fs::status(file, fault);
  if (status.type() == fs::file_type::not_found) return "missing";
  if (status.type() == fs::file_type::none) return "unreadable: " + fault.message();
  if (!fs::is_regular_file(status)) return "not a regular file";
  if (const auto bytes = fs::file_size(file, fault); !fault && bytes != as_written.bytes) {
    return fmt::format("has {} bytes instead of {}: {}", bytes, as_written.bytes,
                       bytes < as_written.bytes ? "truncated" : "data was appended");
  }
  try {
    if (sum_file(file) == as_written) return std::nullopt;
  } catch (const Error&) {
    return "unreadable";
  }
  return "changed: its SHA-256 differs";
}

}  // namespace groundray
