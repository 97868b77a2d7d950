// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/connection/connection.hpp"

#include <type_traits>

#include <slsd/errors.hpp>

namespace slsd {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kSilence = 10s;         // silence after which the service is asked whether it is alive
constexpr auto kProbeTimeout = 10s;    // for that answer: the service answers between scans and during decoding
constexpr auto kSendTimeout = 60s;     // to send a request
constexpr auto kBetweenCalls = 200ms;  // interval of calls while an answer is awaited

// The only place that turns the library's exceptions into values.
template <class Function>
Result<std::invoke_result_t<Function>> without_throwing(const Function& function) {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Function>>) {
      function();
      return {};
    } else {
      return function();
    }
  } catch (const client::NoService& error) {
    return fail(ErrorCode::kNotFound, error.what(), error.where());
  } catch (const client::PermissionDenied& error) {
    return fail(ErrorCode::kPermissionDenied, error.what(), error.where());
  } catch (const client::TimedOut& error) {
    return fail(ErrorCode::kTimeout, error.what(), error.where());
  } catch (const client::ProtocolError& error) {
    return fail(ErrorCode::kMalformed, error.what());
  } catch (const client::ScannerError& error) {
    const ErrorCode code = error.name() == "disconnected" ? ErrorCode::kDisconnected : ErrorCode::kIo;
    return fail(code, error.what(), error.where());
  }
}

template <class T>
Result<GreyView> view_of(std::string_view bytes, int width_px, int height_px) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  if (width_px <= 0 || height_px <= 0 || bytes.size() != pixels * sizeof(T)) {
    return fail(ErrorCode::kMalformed, "the frame from the service has the wrong number of bytes for its size");
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

Result<Connection> Connection::open(const std::filesystem::path& socket) {
  return without_throwing([&] { return Connection(client::Connection(socket.string()), socket); });
}

client::Connection::Deadline Connection::deadline() const {
  if (!timeout_) return {};
  return Clock::now() + *timeout_;
}

namespace {

// Only silence shows that the service hangs: one that refuses or is busy is alive.
Result<> check_alive(const std::filesystem::path& socket) {
  auto probe = Connection::open(socket);
  if (probe) {
    probe->set_timeout(kProbeTimeout);
    const auto answered = probe->call("status", nlohmann::json::object());
    if (!answered && answered.error().code == ErrorCode::kTimeout) return tl::unexpected(answered.error());
  } else if (probe.error().code == ErrorCode::kTimeout) {
    return tl::unexpected(probe.error());
  }
  return {};
}

}  // namespace

Result<> Connection::await_answer() const {
  const auto begin = Clock::now();
  auto probe_at = begin + kSilence;
  while (true) {
    const auto until = waiting_ ? std::min(probe_at, Clock::now() + kBetweenCalls) : probe_at;
    const auto answers = without_throwing([&] { return socket_.answers(until); });
    if (!answers) return tl::unexpected(answers.error());
    if (*answers) return {};
    if (waiting_) waiting_(Clock::now() - begin);
    if (Clock::now() < probe_at) continue;
    if (auto alive = check_alive(path_); !alive) return alive;
    probe_at = Clock::now() + kSilence;
  }
}

Result<Answered> Connection::call(std::string_view method, const nlohmann::json& params) {
  if (auto sent = request(method, params); !sent) return tl::unexpected(sent.error());
  return reply();
}

Result<> Connection::request(std::string_view method, const nlohmann::json& params) {
  const auto text = params.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  const auto until = timeout_ ? deadline() : Clock::now() + kSendTimeout;
  return without_throwing([&] { socket_.send(method, text, until); });
}

Result<Received> Connection::receive() {
  if (!timeout_) {
    if (auto awaited = await_answer(); !awaited) return tl::unexpected(awaited.error());
  }
  return without_throwing([&] {
    client::Message message = socket_.receive(deadline());
    return Received{nlohmann::json::parse(message.json), std::move(message.bytes)};
  });
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
