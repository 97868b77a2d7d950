// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/announcement.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "drivers/files/file.hpp"

namespace slsd::web {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "address-";
constexpr std::size_t kAddressBytesMax = 4096;

// systemd's folder for the unit, or for the user who started it.
std::optional<fs::path> own_folder() {
  if (const char* folder = std::getenv("RUNTIME_DIRECTORY"); folder != nullptr && *folder == '/')
    return fs::path(folder);
  if (const char* folder = std::getenv("XDG_RUNTIME_DIR"); folder != nullptr && *folder == '/')
    return fs::path(folder) / "slsd-web";
  return std::nullopt;
}

bool is_of_a_running_program(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool left = ::flock(descriptor, LOCK_SH | LOCK_NB) == 0;
  ::close(descriptor);
  return !left;
}

std::string line_of(const fs::path& file) {
  const auto text = read_file(file, kAddressBytesMax);
  return text ? text->substr(0, text->find('\n')) : std::string();
}

}  // namespace

Announcement::Announcement(Announcement&& other) noexcept
    : file_(std::move(other.file_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

Result<Announcement> Announcement::write(int port, const std::string& address) {
  const auto folder = own_folder();
  if (!folder) return Announcement({}, -1);
  std::error_code error;
  fs::create_directory(*folder, error);
  const fs::path file = *folder / (std::string(kPrefix) + std::to_string(port));
  fs::remove(file, error);
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (descriptor < 0)
    return fail(ErrorCode::kIo, "cannot save the address for --address: " + std::generic_category().message(errno),
                file.string());
  Announcement made(file, descriptor);
  const std::string line = address + "\n";
  const bool written = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 &&
                       ::write(descriptor, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  if (!written) return fail(ErrorCode::kIo, "cannot save the address for --address", file.string());
  return made;
}

void Announcement::remove() {
  if (descriptor_ < 0) return;
  std::error_code gone;
  fs::remove(file_, gone);
  ::close(std::exchange(descriptor_, -1));
}

Result<std::vector<std::string>> announced_addresses() {
  std::vector<std::string> addresses;
  std::vector<fs::path> folders{"/run/slsd-web"};
  if (const auto own = own_folder(); own && *own != folders.front()) folders.push_back(*own);
  bool forbidden = false;
  for (const fs::path& folder : folders) {
    std::error_code error;
    for (fs::directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
      const fs::path file = each->path();
      if (!file.filename().string().starts_with(kPrefix) || !is_of_a_running_program(file)) continue;
      if (std::string line = line_of(file); !line.empty()) addresses.push_back(std::move(line));
    }
    forbidden = forbidden || error == std::errc::permission_denied;
  }
  if (!addresses.empty()) return addresses;
  return fail(ErrorCode::kNotFound,
              forbidden
                  ? "only an administrator of this machine may read the page's address: run sudo slsd-web --address"
                  : "no slsd-web is running: start it with \"sudo systemctl start slsd-web\", or run slsd-web");
}

}  // namespace slsd::web
