// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/tar.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <set>

#include "core/printable.hpp"

namespace slsd {
namespace {

constexpr std::size_t kBlock = 512;
constexpr char kRegular = '0';

/// POSIX.1-1988, "ustar": texts end in a zero byte, numbers are octal.
struct Header {
  std::array<char, 100> name;
  std::array<char, 8> mode, user, group;
  std::array<char, 12> size, time;
  std::array<char, 8> sum;
  char type;
  std::array<char, 100> link;
  std::array<char, 8> magic;  // includes the version, without a zero in between
  std::array<char, 32> user_name, group_name;
  std::array<char, 8> device_major, device_minor;
  std::array<char, 155> prefix;
  std::array<char, 12> rest;
};
static_assert(sizeof(Header) == kBlock);

template <std::size_t N>
void put(std::array<char, N>& field, unsigned long long value) {
  std::array<char, 24> digits;
  std::snprintf(digits.data(), digits.size(), "%0*llo", static_cast<int>(N - 1), value);
  std::copy_n(digits.begin(), N - 1, field.begin());
}

// A file beyond 8 GB would need another dialect.
template <std::size_t N>
std::optional<std::uint64_t> octal(const std::array<char, N>& field) {
  std::uint64_t value = 0;
  std::size_t i = 0;
  for (; i < N && field[i] >= '0' && field[i] <= '7'; ++i)
    value = 8 * value + static_cast<std::uint64_t>(field[i] - '0');
  const bool ended = std::all_of(field.begin() + i, field.end(), [](char c) { return c == '\0' || c == ' '; });
  return i > 0 && ended ? std::optional(value) : std::nullopt;
}

// The sum of all bytes; the sum's own bytes count as blanks.
unsigned long long sum_of(Header header) {
  header.sum.fill(' ');
  unsigned long long sum = 0;
  for (const unsigned char byte : std::string_view(reinterpret_cast<const char*>(&header), kBlock)) sum += byte;
  return sum;
}

std::size_t padded(std::size_t bytes) {
  return (bytes + kBlock - 1) / kBlock * kBlock;
}

tl::unexpected<Error> fail_cut() {
  return fail(ErrorCode::kMalformed, "is cut off: it has no end");
}

// Returns the name if TarWriter could have written the header.
Result<std::string> name_in(const Header& header) {
  if (octal(header.sum) != sum_of(header)) return fail(ErrorCode::kMalformed, "is damaged, or not a tar archive");
  if (std::memcmp(header.magic.data(), "ustar\00000", 8) != 0)
    return fail(ErrorCode::kUnsupported, "is a tar archive in another format");
  const std::string name(header.name.data(), ::strnlen(header.name.data(), header.name.size()));
  const std::string quoted = "\"" + printable(name) + "\"";
  if (header.type != kRegular)
    return fail(ErrorCode::kUnsupported, quoted + " is not a regular file but a link, a folder or a device");
  const auto zero = [](char c) { return c == '\0'; };
  if (!plain_tar_name(name) || !std::ranges::all_of(header.prefix, zero) || !std::ranges::all_of(header.link, zero))
    return fail(ErrorCode::kUnsupported, quoted + " is a name that might lead outside the archive");
  return name;
}

}  // namespace

bool plain_tar_name(std::string_view name) {
  if (name.empty() || name.size() > kTarNameBytesMax || name.back() == '/') return false;
  if (name.front() == '-') return false;  // tar would take it for an option when unpacked by hand
  bool begins = true;                     // at the start of a part
  for (const char c : name) {
    const bool letter =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
    if (begins ? !letter : !(letter || c == '.' || c == '/')) return false;
    begins = c == '/';
  }
  return true;
}

void TarWriter::add(std::string_view name, std::string_view bytes) {
  Header header{};
  std::copy_n(name.begin(), std::min(name.size(), kTarNameBytesMax), header.name.begin());
  put(header.mode, 0644);
  put(header.user, 0), put(header.group, 0);
  put(header.size, bytes.size());
  put(header.time, static_cast<unsigned long long>(std::chrono::system_clock::to_time_t(time_)));
  header.type = kRegular;
  std::memcpy(header.magic.data(), "ustar\00000", 8);
  put(header.device_major, 0), put(header.device_minor, 0);
  put(header.sum, sum_of(header));
  archive_.append(reinterpret_cast<const char*>(&header), kBlock).append(bytes);
  archive_.append(padded(bytes.size()) - bytes.size(), '\0');
}

std::string TarWriter::finish() && {
  archive_.append(2 * kBlock, '\0');
  return std::move(archive_);
}

Result<std::vector<TarFile>> read_tar(std::string_view archive) {
  std::vector<TarFile> files;
  std::set<std::string> names;
  for (std::size_t at = 0; archive.size() - at >= kBlock;) {
    if (archive[at] == '\0') {
      const std::string_view end = archive.substr(at);
      if (end.size() < 2 * kBlock) return fail_cut();
      if (end.find_first_not_of('\0') != std::string_view::npos)
        return fail(ErrorCode::kMalformed, "continues after its end");
      return files;
    }
    Header header;
    std::memcpy(&header, archive.data() + at, kBlock);
    auto name = name_in(header);
    if (!name) return tl::unexpected(name.error());
    const auto size = octal(header.size);
    if (!size) return fail(ErrorCode::kMalformed, "does not say how long \"" + *name + "\" is");
    at += kBlock;
    if (*size > archive.size() - at || padded(*size) > archive.size() - at) return fail_cut();
    if (!names.insert(*name).second) return fail(ErrorCode::kUnsupported, "has \"" + *name + "\" twice");
    if (files.size() == kTarFilesMax)
      return fail(ErrorCode::kUnsupported, "has more than " + std::to_string(kTarFilesMax) + " files");
    files.push_back({std::move(*name), archive.substr(at, *size)});
    at += padded(*size);
  }
  return fail_cut();
}

}  // namespace slsd
