#include "apps/dataset/file_sum.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <new>
#include <system_error>
#include <vector>

#include "apps/dataset/owned_file.h"
#include "core/error.h"

namespace groundray {
namespace {

using Context = std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)>;

Context make_context() {
  Context context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  if (!context) throw std::bad_alloc();
  return context;
}

void check(int is_done) {
  if (is_done != 1) throw Error("OpenSSL cannot compute SHA-256: check its configuration");
}

}  // namespace

struct Sha256::State {
  Context context = make_context();
};

Sha256::Sha256() : state_(std::make_unique<State>()) {
  check(EVP_DigestInit_ex(state_->context.get(), EVP_sha256(), nullptr));
}

Sha256::~Sha256() = default;

void Sha256::add(std::string_view bytes) {
  check(EVP_DigestUpdate(state_->context.get(), bytes.data(), bytes.size()));
}

std::string Sha256::digits() const {
  const Context copy = make_context();  // the original stays open for more bytes
  check(EVP_MD_CTX_copy_ex(copy.get(), state_->context.get()));
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  check(EVP_DigestFinal_ex(copy.get(), digest.data(), &size));
  std::string text;
  for (unsigned i = 0; i < size; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

std::string sha256_of(std::string_view bytes) {
  Sha256 sum;
  sum.add(bytes);
  return sum.digits();
}

FileSum sum_file(const std::filesystem::path& path) {
  constexpr std::size_t block_bytes = 256 << 10;
  const OwnedFile file(std::fopen(path.c_str(), "rb"));
  std::vector<char> block(block_bytes);
  Sha256 sum;
  FileSum result;
  while (file && std::feof(file.get()) == 0 && std::ferror(file.get()) == 0) {
    const std::size_t read = std::fread(block.data(), 1, block.size(), file.get());
    sum.add({block.data(), read});
    result.bytes += read;
  }
  if (!file || std::ferror(file.get()) != 0) {
    throw Error("{}: cannot be read: {}; check the disk and the file's permissions", path.string(),
                std::generic_category().message(errno));
  }
  result.sha256 = sum.digits();
  return result;
}

}  // namespace groundray
