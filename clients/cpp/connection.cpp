// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "slsd/connection.hpp"

#include <fcntl.h>
#include <grp.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <nlohmann/json.hpp>

#include "slsd/errors.hpp"

namespace slsd::client {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxLine = 1 << 24;
constexpr std::size_t kMaxBytes = std::size_t{1} << 32;
constexpr std::size_t kMaxDescriptors = 16;
constexpr int kMaxDepth = 64;
constexpr std::chrono::seconds kConnectMax{5};

// Explains how the user gets access: through the group of the socket, or of the folder that hides it.
std::string way_in(std::string path) {
  struct stat about {};
  while (::stat(path.c_str(), &about) != 0 && path.find('/', 1) != std::string::npos) path.erase(path.rfind('/'));
  const group* owner = ::getgrgid(about.st_gid);
  const std::string name = owner ? owner->gr_name : std::to_string(about.st_gid);
  return "join its group (sudo usermod -aG " + name + " $USER), then log in again";
}

[[noreturn]] void no_connection(int number, const std::string& path) {
  if (number == ENOENT || number == ECONNREFUSED || number == ENOTDIR) {
    throw NoService("no service answers there: start slsd (systemctl start slsd), or set SLSD_SOCKET to its socket",
                    "not_found", path);
  }
  if (number == EACCES || number == EPERM) {
    throw PermissionDenied("you may not use this socket: " + way_in(path), "permission_denied", path);
  }
  if (number == EAGAIN)
    throw TimedOut("the service does not accept connections: check its log, or restart it", "timeout", path);
  throw ConnectionLost(std::strerror(number), "io", path);
}

[[noreturn]] void hung_up(const std::string& path, const char* when = "") {
  throw ConnectionLost(std::string("the service closed the connection") + when, "disconnected", path);
}

std::size_t size_of(const json& value) {
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > kMaxBytes) {
    throw ProtocolError("not a valid answer of slsd: it announces " + value.dump().substr(0, 40) + " bytes",
                        "malformed");
  }
  return value.get<std::size_t>();
}

// The part of a message that describes the bytes after it.
const json* described(const json& message) {
  const auto found = message.find(message.contains("method") ? "params" : "result");
  return found != message.end() && found->is_object() ? &*found : nullptr;
}

}  // namespace

Bytes::Bytes(std::string own) {
  auto kept = std::make_shared<const std::string>(std::move(own));
  view_ = *kept;
  memory_ = std::move(kept);
}

std::string default_socket() {
  const char* named = std::getenv("SLSD_SOCKET");
  return named && *named ? named : "/run/slsd/slsd.sock";
}

Connection::Connection(const std::string& socket) : path_(socket), process_(::getpid()) {
  sockaddr_un address{};
  if (path_.size() >= sizeof address.sun_path) {
    throw ConnectionLost("the socket's path is longer than 107 bytes: choose a shorter one", "invalid_argument", path_);
  }
  socket_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket_ < 0) no_connection(errno, path_);
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, path_.size());
  // A service that no longer accepts clients fills its queue, and connecting would then wait for ever.
  const timeval timeout{kConnectMax.count(), 0};
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int number = errno;
    close();
    no_connection(number, path_);
  }
}

Connection::~Connection() {
  close();
}

Connection::Connection(Connection&& other) noexcept
    : path_(std::move(other.path_)),
      socket_(std::exchange(other.socket_, -1)),
      buffer_(std::move(other.buffer_)),
      descriptors_(std::exchange(other.descriptors_, {})),
      last_id_(other.last_id_),
      process_(other.process_) {}

Connection& Connection::operator=(Connection&& other) noexcept {
  if (this == &other) return *this;
  close();
  path_ = std::move(other.path_);
  socket_ = std::exchange(other.socket_, -1);
  buffer_ = std::move(other.buffer_);
  descriptors_ = std::exchange(other.descriptors_, {});
  last_id_ = other.last_id_;
  process_ = other.process_;
  return *this;
}

void Connection::close() noexcept {
  for (const int descriptor : descriptors_) ::close(descriptor);
  descriptors_.clear();
  if (socket_ < 0) return;
  if (is_own()) ::shutdown(socket_, SHUT_RDWR);  // a forked child may hold a copy
  ::close(std::exchange(socket_, -1));
}

bool Connection::is_own() const {
  return process_ == ::getpid();
}

void Connection::refuse_others() const {
  if (socket_ < 0) hung_up(path_);
  if (!is_own()) {
    throw ConnectionLost("this connection belongs to the parent process: open one in this process", "disconnected",
                         path_);
  }
}

bool Connection::ready(short events, const Deadline& deadline) const {
  while (true) {
    int left_ms = -1;
    if (deadline) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(*deadline - std::chrono::steady_clock::now());
      left_ms = static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, 1'000'000'000));
    }
    pollfd asked{socket_, events, 0};
    const int polled = ::poll(&asked, 1, left_ms);
    if (polled >= 0) return polled > 0;
    if (errno != EINTR) throw ConnectionLost(std::strerror(errno), "io", path_);
  }
}

void Connection::wait(short events, const Deadline& deadline) const {
  if (!ready(events, deadline))
    throw TimedOut("the service does not answer: check its log, or restart it", "timeout", path_);
}

bool Connection::answers(Deadline deadline) const {
  return !buffer_.empty() || socket_ < 0 || ready(POLLIN, deadline);
}

std::int64_t Connection::send(std::string_view method, std::string_view params, Deadline deadline) {
  refuse_others();
  const std::string line = "{\"jsonrpc\":\"2.0\",\"id\":" + std::to_string(++last_id_) +
                           ",\"method\":" + json(method).dump(-1, ' ', false, json::error_handler_t::replace) +
                           ",\"params\":" + std::string(params) + "}\n";
  std::string_view left = line;
  while (!left.empty()) {
    wait(POLLOUT, deadline);
    const ssize_t sent = ::send(socket_, left.data(), left.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    // A last message of the daemon says more than the fact that it hung up.
    if (sent < 0 && (errno == EPIPE || errno == ECONNRESET)) break;
    if (sent < 0) throw ConnectionLost(std::string("cannot send: ") + std::strerror(errno), "io", path_);
    left.remove_prefix(static_cast<std::size_t>(sent));
  }
  return last_id_;
}

void Connection::receive_more(const Deadline& deadline) {
  std::array<char, 65536> chunk;
  alignas(cmsghdr) std::array<char, CMSG_SPACE(4 * sizeof(int))> control;
  iovec space{chunk.data(), chunk.size()};
  msghdr header{};
  header.msg_iov = &space;
  header.msg_iovlen = 1;
  ssize_t size = 0;
  do {
    wait(POLLIN, deadline);
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    size = ::recvmsg(socket_, &header, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
  } while (size < 0 && (errno == EINTR || errno == EAGAIN));
  if (size <= 0) hung_up(path_);
  for (const cmsghdr* part = CMSG_FIRSTHDR(&header); part; part = CMSG_NXTHDR(&header, const_cast<cmsghdr*>(part))) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    for (std::size_t at = 0; at + sizeof(int) <= part->cmsg_len - CMSG_LEN(0); at += sizeof(int)) {
      int descriptor;
      std::memcpy(&descriptor, CMSG_DATA(part) + at, sizeof descriptor);
      descriptors_.push_back(descriptor);
    }
  }
  if (descriptors_.size() > kMaxDescriptors) {
    throw ProtocolError("not a valid answer of slsd: it has unexpected descriptors", "malformed", path_);
  }
  buffer_.append(chunk.data(), static_cast<std::size_t>(size));
}

std::string Connection::receive_line(const Deadline& deadline) {
  std::size_t searched = 0;
  std::size_t end = std::string::npos;
  while ((end = buffer_.find('\n', searched)) == std::string::npos) {
    if (buffer_.size() > kMaxLine) {
      throw ProtocolError("not a valid answer of slsd: its line does not end", "malformed", path_);
    }
    searched = buffer_.size();
    receive_more(deadline);
  }
  std::string line = buffer_.substr(0, end);
  buffer_.erase(0, end + 1);
  return line;
}

// Memory grows only with received bytes, so a false size costs nothing.
Bytes Connection::receive_bytes(std::size_t count, const Deadline& deadline) {
  while (buffer_.size() < count) receive_more(deadline);
  if (buffer_.size() == count) return Bytes(std::exchange(buffer_, {}));
  std::string bytes = buffer_.substr(0, count);
  buffer_.erase(0, count);
  return Bytes(std::move(bytes));
}

Bytes Connection::map_descriptor(std::size_t size) {
  if (descriptors_.empty()) {
    throw ProtocolError("the service announced a cloud as a memfd, but sent no descriptor", "malformed", path_);
  }
  const int descriptor = descriptors_.front();
  descriptors_.erase(descriptors_.begin());
  // A memfd that may still shrink or change could later crash this process, or give it wrong points.
  constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_WRITE;
  struct stat about {};
  const bool whole = ::fstat(descriptor, &about) == 0 && about.st_size == static_cast<off_t>(size) && size > 0;
  const bool sealed = (::fcntl(descriptor, F_GET_SEALS) & kSeals) == kSeals;
  void* memory = whole && sealed ? ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, 0) : MAP_FAILED;
  ::close(descriptor);
  if (!whole) throw ProtocolError("the memfd does not have the announced size", "malformed", path_);
  if (!sealed) throw ProtocolError("the memfd is not sealed", "malformed", path_);
  if (memory == MAP_FAILED) throw ScannerError("no address space is left for the cloud", "no_space", path_);
  std::shared_ptr<const void> kept(memory, [size](const void* mapped) { ::munmap(const_cast<void*>(mapped), size); });
  return {std::move(kept), {static_cast<const char*>(memory), size}};
}

Message Connection::receive(Deadline deadline) {
  refuse_others();
  Message message{receive_line(deadline), {}};
  bool deep = false;
  const auto shallow = [&](int depth, json::parse_event_t, const json&) {
    deep = deep || depth > kMaxDepth;
    return depth <= kMaxDepth;
  };
  const json read = json::parse(message.json, shallow, /*allow_exceptions=*/false);
  if (deep || !read.is_object() || read.value("jsonrpc", json()) != "2.0") {
    throw ProtocolError("not a valid answer of slsd: it is not JSON-RPC 2.0", "malformed", path_);
  }
  const json* about = described(read);
  if (about && about->contains("memfd_bytes")) {
    message.bytes = map_descriptor(size_of((*about)["memfd_bytes"]));
  } else if (about && about->contains("bytes")) {
    message.bytes = receive_bytes(size_of((*about)["bytes"]), deadline);
  }
  return message;
}

}  // namespace slsd::client
