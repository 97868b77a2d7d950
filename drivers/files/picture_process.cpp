// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/picture_process.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "core/image_size.hpp"
#include "core/printable.hpp"
#include "drivers/files/image_formats.hpp"
#include "drivers/system/file_descriptor.hpp"
#include "drivers/system/own_program.hpp"
#include "drivers/system/system_error.hpp"

namespace slsd {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kDecodedBytesMax = 64 << 20;  // 3840x2160 with 48-bit colours
constexpr std::size_t kLineMax = 1000;
constexpr std::string_view kDone = "ok";
constexpr ErrorCode kAnswered[] = {ErrorCode::kMalformed, ErrorCode::kUnsupported, ErrorCode::kMismatch,
                                   ErrorCode::kInvalidArgument};

/// A child process, which ends with this object.
class Process {
 public:
  explicit Process(pid_t number) : number_(number) {}
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() { static_cast<void>(end()); }

  /// Kills the process, unless it has already ended. @return as of waitpid()
  int end() {
    int status = 0;
    const pid_t number = std::exchange(number_, 0);
    if (number == 0) return status;
    ::kill(number, SIGKILL);
    while (::waitpid(number, &status, 0) < 0 && errno == EINTR) {
    }
    return status;
  }

 private:
  pid_t number_;
};

/// Sends and receives at the same time, so that neither side blocks the other.
/// @return all output of the process, up to the limit
Result<std::string> exchange(int socket, std::string_view sent, std::size_t limit_bytes, Clock::time_point until) {
  std::string received;
  bool sending = true;
  while (true) {
    if (sending && sent.empty()) {
      ::shutdown(socket, SHUT_WR);
      sending = false;
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
    pollfd ready{socket, static_cast<short>(POLLIN | (sending ? POLLOUT : 0)), 0};
    const int count = left > 0 ? ::poll(&ready, 1, static_cast<int>(std::min<long>(left, 60'000))) : 0;
    if (count < 0 && errno != EINTR) return fail_system(errno, "cannot wait for the image decoder");
    if (left <= 0) return fail(ErrorCode::kTimeout, "the image was not decoded in time; save it again");
    if (count <= 0) continue;
    if ((ready.revents & POLLOUT) != 0) {
      const ssize_t taken = ::send(socket, sent.data(), sent.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (taken > 0) sent.remove_prefix(static_cast<std::size_t>(taken));
      if (taken < 0 && errno != EAGAIN && errno != EINTR) sent = {};  // it stopped reading, and may have answered
    }
    if ((ready.revents & (POLLIN | POLLHUP | POLLERR)) == 0) continue;
    const std::size_t before = received.size();
    received.resize(before + (64 << 10));
    const ssize_t came = ::recv(socket, received.data() + before, received.size() - before, MSG_DONTWAIT);
    received.resize(before + static_cast<std::size_t>(std::max<ssize_t>(came, 0)));
    const bool ended = came == 0 || (came < 0 && errno != EAGAIN && errno != EINTR);
    if (ended || received.size() > limit_bytes) return received;
  }
}

tl::unexpected<Error> fail_died(int status) {
  const std::string how = WIFSIGNALED(status) ? "killed by signal " + std::to_string(WTERMSIG(status))
                                              : "status " + std::to_string(WEXITSTATUS(status));
  return fail(ErrorCode::kMalformed,
              "the image cannot be decoded: the decoder ended early (" + how + "); save it again");
}

}  // namespace

Result<Grey8> decode_in_process(std::string_view png, int width_px, int height_px, Clock::time_point until,
                                const std::filesystem::path& program) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) return fail_system(errno, "no socket");
  const FileDescriptor here(ends[0]);
  FileDescriptor there(ends[1]);
  const auto started = start_own_program(program, {std::to_string(width_px), std::to_string(height_px)},
                                         {there.number(), there.number(), -1});
  if (!started) return tl::unexpected(started.error());
  Process process(*started);
  static_cast<void>(there.close());
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  const auto answer = exchange(here.number(), png, pixels + kLineMax, until);
  if (!answer) return tl::unexpected(answer.error());
  const int status = process.end();
  if (answer->empty() || WIFSIGNALED(status)) return fail_died(status);
  return read_answer(*answer, width_px, height_px);
}

Result<Grey8> decode_projected(std::string_view png, int width_px, int height_px) {
  constexpr std::string_view kBegin = "\x89PNG\r\n\x1a\n";
  if (!png.starts_with(kBegin)) return fail(ErrorCode::kUnsupported, "the image is not a PNG file; convert it to one");
  auto decoded = decode_png(png, kDecodedBytesMax, KeepColours::kNo);
  if (!decoded) return tl::unexpected(decoded.error());
  auto* grey = std::get_if<Grey8>(&decoded->grey);
  if (grey == nullptr)
    return fail(ErrorCode::kMismatch, "the image has 16 bits per pixel, but a projector takes 8: convert it");
  if (grey->width() == width_px && grey->height() == height_px) return std::move(*grey);
  return fail(ErrorCode::kMismatch, "the image is " + size_text(grey->width(), grey->height()) +
                                        " pixels, the projector " + size_text(width_px, height_px) +
                                        ": resize it to match, because slsd shows it pixel for pixel");
}

std::string answer_text(const Result<Grey8>& decoded) {
  if (!decoded) {
    const Error& error = decoded.error();
    return std::string(to_string(error.code)) + " " + printable(error.message, kLineMax / 2) + "\n";
  }
  std::string answer = std::string(kDone) + "\n";
  for (int y = 0; y < decoded->height(); ++y)
    answer.append(reinterpret_cast<const char*>(decoded->row(y)), static_cast<std::size_t>(decoded->width()));
  return answer;
}

Result<Grey8> read_answer(std::string_view answer, int width_px, int height_px) {
  const std::size_t end = answer.substr(0, kLineMax).find('\n');
  const auto row_bytes = static_cast<std::size_t>(width_px);
  if (end != answer.npos) {
    const std::string_view line = answer.substr(0, end), pixels = answer.substr(end + 1);
    if (line == kDone && pixels.size() == row_bytes * static_cast<std::size_t>(height_px)) {
      Grey8 grey(width_px, height_px);
      for (int y = 0; y < height_px; ++y)
        std::memcpy(grey.row(y), pixels.data() + static_cast<std::size_t>(y) * row_bytes, row_bytes);
      return grey;
    }
    for (const ErrorCode code : kAnswered) {
      const std::string_view name = to_string(code);
      if (line.starts_with(name) && line.size() > name.size() + 1 && line[name.size()] == ' ' && pixels.empty())
        return fail(code, printable(line.substr(name.size() + 1), kLineMax));
    }
  }
  return fail(ErrorCode::kMalformed, "the image cannot be decoded: the decoder's answer is incomplete; save it again");
}

}  // namespace slsd
