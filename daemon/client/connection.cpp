// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/client/connection.hpp"

#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "daemon/rpc/message.hpp"

namespace slsd {
namespace {

constexpr std::size_t kMaxLine = 1 << 24;
constexpr std::size_t kMaxBytes = 1 << 30;

tl::unexpected<Error> no_connection(int number, const std::filesystem::path& socket) {
  const std::string where = socket.string();
  if (number == ENOENT || number == ECONNREFUSED || number == ENOTDIR) {
    return fail(ErrorCode::kNotFound, "no daemon answers there: start slsd, or name its socket with --socket", where);
  }
  if (number == EACCES || number == EPERM) {
    return fail(ErrorCode::kPermissionDenied, "not allowed: join the group that owns the socket", where);
  }
  return fail(ErrorCode::kIo, std::strerror(number), where);
}

tl::unexpected<Error> no_answer() {
  return fail(ErrorCode::kTimeout, "the daemon does not answer: look at its log, or restart it");
}

// The bytes that follow a message, as it says itself.
std::size_t bytes_after(const nlohmann::json& message) {
  for (const char* part : {"result", "params"}) {
    const auto found = message.find(part);
    if (found == message.end() || !found->is_object()) continue;
    const auto bytes = found->find("bytes");
    if (bytes != found->end() && bytes->is_number_unsigned()) return bytes->get<std::size_t>();
  }
  return 0;
}

template <class T>
Result<GreyView> view_of(const std::string& bytes, int width_px, int height_px) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  if (width_px <= 0 || height_px <= 0 || bytes.size() != pixels * sizeof(T)) {
    return fail(ErrorCode::kMalformed, "the daemon's frame has not as many bytes as its size asks for");
  }
  return ImageView<T>{reinterpret_cast<const T*>(bytes.data()), width_px, height_px, width_px};
}

}  // namespace

Result<GreyView> Received::image(const nlohmann::json& about) const {
  const int width_px = about.value("width_px", 0);
  const int height_px = about.value("height_px", 0);
  if (about.value("bits", 8) == 16) return view_of<std::uint16_t>(bytes, width_px, height_px);
  return view_of<std::uint8_t>(bytes, width_px, height_px);
}

Result<Connection> Connection::open(const std::filesystem::path& path) {
  FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!socket) return no_connection(errno, path);
  sockaddr_un address{};
  if (path.string().size() >= sizeof address.sun_path) {
    return fail(ErrorCode::kInvalidArgument, "a socket's path has at most 107 bytes", path.string());
  }
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  if (::connect(socket.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return no_connection(errno, path);
  }
  return Connection(std::move(socket));
}

void Connection::set_patience(std::chrono::seconds patience) const {
  const timeval time{patience.count(), 0};
  for (const int direction : {SO_RCVTIMEO, SO_SNDTIMEO}) {
    ::setsockopt(socket_.number(), SOL_SOCKET, direction, &time, sizeof time);
  }
}

Result<> Connection::send(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    // What the daemon said before it hung up is worth more than that it did.
    if (sent < 0 && (errno == EPIPE || errno == ECONNRESET)) return {};
    if (sent < 0 && errno == EAGAIN) return no_answer();
    if (sent < 0) return fail(ErrorCode::kIo, std::string("cannot send: ") + std::strerror(errno));
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return {};
}

Result<> Connection::receive_more() {
  std::array<char, 65536> chunk;
  ssize_t size = 0;
  do {
    size = ::recv(socket_.number(), chunk.data(), chunk.size(), 0);
  } while (size < 0 && errno == EINTR);
  if (size < 0 && errno == EAGAIN) return no_answer();
  if (size <= 0) return fail(ErrorCode::kDisconnected, "the daemon hung up");
  buffer_.append(chunk.data(), static_cast<std::size_t>(size));
  return {};
}

Result<std::string> Connection::receive_line() {
  std::size_t searched = 0;
  std::size_t end = std::string::npos;
  while ((end = buffer_.find('\n', searched)) == std::string::npos) {
    if (buffer_.size() > kMaxLine) return fail(ErrorCode::kMalformed, "the answer is not slsd's: its line has no end");
    searched = buffer_.size();
    if (auto more = receive_more(); !more) return tl::unexpected(more.error());
  }
  std::string line = buffer_.substr(0, end);
  buffer_.erase(0, end + 1);
  return line;
}

Result<std::string> Connection::receive_bytes(std::size_t count) {
  if (count > kMaxBytes) return fail(ErrorCode::kMalformed, "the answer is not slsd's: it would be over 1 GiB");
  while (buffer_.size() < count) {
    if (auto more = receive_more(); !more) return tl::unexpected(more.error());
  }
  std::string bytes = buffer_.substr(0, count);
  buffer_.erase(0, count);
  return bytes;
}

Result<Received> Connection::receive() {
  const auto line = receive_line();
  if (!line) return tl::unexpected(line.error());
  nlohmann::json message = nlohmann::json::parse(*line, nullptr, /*allow_exceptions=*/false);
  if (!message.is_object()) return fail(ErrorCode::kMalformed, "the answer is not slsd's: no JSON object");
  auto bytes = receive_bytes(bytes_after(message));
  if (!bytes) return tl::unexpected(bytes.error());
  return Received{std::move(message), std::move(*bytes)};
}

Result<Answered> Connection::call(std::string_view method, nlohmann::json params) {
  if (auto sent = request(method, std::move(params)); !sent) return tl::unexpected(sent.error());
  return reply();
}

Result<> Connection::request(std::string_view method, nlohmann::json params) {
  return send(to_line(request_message(++last_id_, method, std::move(params))));
}

Result<Answered> Connection::reply() {
  std::vector<Received> events;
  while (true) {
    auto received = receive();
    if (!received) return tl::unexpected(received.error());
    if (!received->message.contains("method")) return Answered{std::move(*received), std::move(events)};
    events.push_back(std::move(*received));
  }
}

}  // namespace slsd
