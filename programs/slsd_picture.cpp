// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// Decodes the untrusted PNG file of a client into the pixels for a projector: `slsd-picture WIDTH HEIGHT`. Reads the
// file from its input, and writes the answer of picture_process.hpp to its output.
#include <unistd.h>

#include <charconv>
#include <optional>
#include <string>
#include <string_view>

#include "core/image_size.hpp"
#include "drivers/confine/confine.hpp"
#include "drivers/files/picture_process.hpp"

namespace {

constexpr std::size_t kFileBytesMax = 32 << 20;

std::optional<int> side_of(std::string_view text) {
  int side = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), side);
  if (error != std::errc() || end != text.data() + text.size() || side < 1 || side > slsd::kMaxImageSidePx)
    return std::nullopt;
  return side;
}

std::string read_all() {
  std::string file;
  while (file.size() < kFileBytesMax) {
    const std::size_t before = file.size();
    file.resize(before + (64 << 10));
    const ssize_t count = ::read(STDIN_FILENO, file.data() + before, file.size() - before);
    file.resize(before + static_cast<std::size_t>(count > 0 ? count : 0));
    if (count <= 0) break;
  }
  return file;
}

void write_all(std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(STDOUT_FILENO, text.data(), text.size());
    if (count <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
}

slsd::Result<slsd::Grey8> decode(int width_px, int height_px) {
  auto confined = slsd::confine();
  if (!confined) return tl::unexpected(confined.error());
  return slsd::decode_projected(read_all(), width_px, height_px);
}

}  // namespace

int main(int argc, char** argv) {
  const auto width_px = argc == 3 ? side_of(argv[1]) : std::nullopt;
  const auto height_px = argc == 3 ? side_of(argv[2]) : std::nullopt;
  if (!width_px || !height_px) {
    constexpr std::string_view kUsage = "slsd-picture: only slsd starts this program, to decode a client's picture\n";
    return ::write(STDERR_FILENO, kUsage.data(), kUsage.size()) > 0 ? 2 : 1;
  }
  write_all(slsd::answer_text(decode(*width_px, *height_px)));
  ::_exit(0);  // system calls of a normal exit are no longer allowed
}
