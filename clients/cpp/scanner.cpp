// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "slsd/scanner.hpp"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <utility>

#include <nlohmann/json.hpp>

namespace slsd::client {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr auto kGrace = std::chrono::seconds(5);  // added to the timeout that the service itself keeps
constexpr auto kReloadMax = std::chrono::seconds(60);

[[noreturn]] void throw_answered(const json& error) {
  const json none = json::object();
  const json& told = error.is_object() ? error : none;
  const auto text = [](const json& object, const char* key, const char* otherwise) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : std::string(otherwise);
  };
  const json& data = told.contains("data") && told["data"].is_object() ? told["data"] : none;
  const std::string message = text(told, "message", "the service gave no reason"), name = text(data, "name", ""),
                    where = text(data, "where", "");
  const int code = told.contains("code") && told["code"].is_number_integer() ? told["code"].get<int>() : 0;
  const auto is = [&](auto... names) { return (... || (name == names)); };
  if (is("parse_error", "invalid_request", "method_not_found", "invalid_params", "invalid_argument"))
    throw InvalidRequest(message, name, where, code);
  if (is("not_found")) throw NotFound(message, name, where, code);
  if (is("permission_denied")) throw PermissionDenied(message, name, where, code);
  if (is("busy")) throw Busy(message, name, where, code);
  if (is("timeout")) throw TimedOut(message, name, where, code);
  if (is("cancelled")) throw Cancelled(message, name, where, code);
  if (is("disconnected", "mismatch", "io")) throw DeviceError(message, name, where, code);
  if (is("frame_dropped", "frame_torn", "frame_stale", "frame_late", "frame_skewed"))
    throw FrameError(message, name, where, code);
  throw ScannerError(message, name, where, code);
}

[[noreturn]] void not_slsd(const std::string& what) {
  throw ProtocolError("not a valid answer of slsd: " + what, "malformed");
}

// Invalid UTF-8 (a camera's name may be any bytes) becomes replacement characters.
std::string text_of(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

struct Answer {
  json result;
  Bytes bytes;
  std::vector<Message> events;
};

Answer ask(Connection& connection, const std::string& method, const std::string& params, milliseconds timeout) {
  const auto deadline = Clock::now() + timeout + kGrace;
  const std::int64_t id = connection.send(method, params, deadline);
  Answer answer;
  while (true) {
    Message message = connection.receive(deadline);
    json read = json::parse(message.json);
    if (read.contains("method")) {
      answer.events.push_back(std::move(message));
      continue;
    }
    if (!read.contains("error") && (read.value("id", json()) != id || !read.value("result", json()).is_object())) {
      not_slsd("it does not answer " + method);
    }
    answer.result = std::move(read);
    answer.bytes = std::move(message.bytes);
    return answer;
  }
}

Frame frame_of(const json& about, Bytes pixels) {
  const auto number = [&](const char* key) {
    if (!about.contains(key) || !about[key].is_number_unsigned() || about[key].get<std::uint64_t>() > 1 << 20)
      not_slsd("a frame lacks its size");
    return about[key].get<int>();
  };
  Frame frame{number("width_px"), number("height_px"), number("bits"), std::move(pixels), text_of(about)};
  const std::size_t needed =
      static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px) * (frame.bits > 8 ? 2 : 1);
  if (needed == 0 || needed != frame.pixels.size()) not_slsd("a frame has the wrong number of bytes for its size");
  return frame;
}

Bytes needed(Bytes bytes, const char* what) {
  if (bytes.empty()) not_slsd(std::string(what) + " is missing");
  return bytes;
}

json camera_params(const std::string& camera, milliseconds timeout) {
  json params{{"timeout_ms", timeout.count()}};
  if (!camera.empty()) params["camera"] = camera;
  return params;
}

}  // namespace

namespace {

// The state of one process: no lock that a thread of the parent may hold, and no connection of another process.
struct Own {
  pid_t process = ::getpid();
  std::mutex mutex;
  std::optional<Connection> connection;
};

// Frees a child's copy of its parent's state. If a thread of the parent was using it, its state is unknown, so it
// stays.
void leave(Own* inherited) {
  if (!inherited || !inherited->mutex.try_lock()) return;
  inherited->mutex.unlock();
  delete inherited;
}

}  // namespace

struct Scanner::State {
  explicit State(std::string socket) : path(std::move(socket)) {}
  ~State() {
    Own* const last = own.load();
    last->process == ::getpid() ? delete last : leave(last);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  std::string path;
  std::atomic<Own*> own{new Own};

  Own& here() {
    Own* known = own.load();
    if (known->process == ::getpid()) return *known;
    auto made = std::make_unique<Own>();
    if (!own.compare_exchange_strong(known, made.get())) return *known;  // another thread of the child was first
    leave(known);
    return *made.release();
  }

  void connect() {
    Own& mine = here();
    const std::lock_guard lock(mine.mutex);
    if (!mine.connection) mine.connection.emplace(path);
  }

  Answer call(const std::string& method, const std::string& params, milliseconds timeout) {
    Own& mine = here();
    const std::lock_guard lock(mine.mutex);
    if (!mine.connection) mine.connection.emplace(path);
    Answer answer;
    try {
      answer = ask(*mine.connection, method, params, timeout);
    } catch (...) {
      mine.connection.reset();
      throw;
    }
    if (answer.result.contains("error")) throw_answered(answer.result["error"]);
    answer.result = json(std::move(answer.result["result"]));
    return answer;
  }
};

Scanner::Scanner(std::string socket)
    : state_(std::make_unique<State>(socket.empty() ? default_socket() : std::move(socket))) {
  state_->connect();
}

Scanner::~Scanner() = default;
Scanner::Scanner(Scanner&&) noexcept = default;
Scanner& Scanner::operator=(Scanner&&) noexcept = default;

Cloud Scanner::scan(const ScanOptions& options) {
  json params{{"format", "ply"}, {"transport", "memfd"}, {"timeout_ms", options.timeout.count()}};
  if (!options.density.empty()) params["density"] = options.density;
  if (options.normals) params["normals"] = true;
  if (options.colour) params["colour"] = true;
  if (options.texture) params["texture"] = true;
  if (options.ambient) params["ambient"] = true;
  if (!options.preset.empty()) params["preset"] = options.preset;
  if (!options.coordinate_frame.empty()) params["coordinate_frame"] = options.coordinate_frame;
  if (!options.robot_pose.empty()) params["robot_pose"] = options.robot_pose;
  if (!options.poses.empty()) params["poses"] = options.poses;
  if (!options.box.empty()) params["box"] = options.box;
  if (!options.plane.empty()) params["plane"] = options.plane;
  if (!options.box_frame.empty()) params["box_frame"] = options.box_frame;
  if (options.voxel_mm) params["voxel_mm"] = *options.voxel_mm;
  if (options.stride) params["stride"] = *options.stride;
  if (options.picture) params["picture"] = true;
  if (options.why) params["why"] = true;
  if (options.frames) params["frames"] = "raw";
  Answer answer = state_->call("scan", text_of(params), options.timeout);
  Cloud cloud = Cloud::read_ply(needed(std::move(answer.bytes), "the cloud"), text_of(answer.result));
  for (Message& event : answer.events) {
    const json read = json::parse(event.json);
    if (read["method"] == "picture") cloud.picture = std::move(event.bytes);
    if (read["method"] == "frame") cloud.frames.push_back(frame_of(read.value("params", json::object()), event.bytes));
  }
  return cloud;
}

Stream Scanner::stream(const StreamOptions& options) const {
  return {state_->path, options};
}

Stream::Stream(std::string socket, const StreamOptions& options)
    : socket_(std::move(socket)), connection_(socket_), idle_(options.idle) {
  json params{{"format", "ply"}};
  if (options.rate_hz) params["rate_hz"] = *options.rate_hz;
  if (!options.density.empty()) params["density"] = options.density;
  if (options.normals) params["normals"] = true;
  if (options.shared) params["transport"] = "memfd";
  params_ = text_of(params);
  subscribe();
}

void Stream::subscribe() {
  id_ = connection_.send("subscribe", params_, Clock::now() + kGrace);
  answered_ = false;
}

Cloud Stream::next() {
  if (!connection_.is_own()) {
    connection_ = Connection(socket_);
    subscribe();
  }
  Connection::Deadline deadline;
  if (idle_ || !answered_) deadline = Clock::now() + idle_.value_or(2 * kGrace);
  while (true) {
    Message message = connection_.receive(deadline);
    const json read = json::parse(message.json);
    if (read.value("method", json()) == "cloud") {
      return Cloud::read_ply(needed(std::move(message.bytes), "the cloud"),
                             text_of(read.value("params", json::object())));
    }
    if (read.contains("error")) throw_answered(read["error"]);
    if (!read.contains("method") && read.value("id", json()) == id_) {
      answered_ = true;
      if (!idle_) deadline.reset();
    }
  }
}

Frame Scanner::frame(const std::string& camera, bool as_shown, milliseconds timeout) {
  json params = camera_params(camera, timeout);
  params["format"] = "raw";
  params["as_shown"] = as_shown;
  Answer answer = state_->call("frame", text_of(params), timeout);
  return frame_of(answer.result, std::move(answer.bytes));
}

Bytes Scanner::preview(const std::string& camera, milliseconds timeout) {
  return needed(state_->call("preview", text_of(camera_params(camera, timeout)), timeout).bytes, "the picture");
}

Bytes Scanner::pattern() {
  return needed(state_->call("pattern", "{}", kGrace).bytes, "the pattern");
}

void Scanner::project(const std::string& picture, milliseconds timeout) {
  (void)state_->call("project", text_of(json{{"picture", picture}, {"timeout_ms", timeout.count()}}), timeout);
}

std::string Scanner::status() {
  return text_of(state_->call("status", "{}", kGrace).result);
}

std::string Scanner::settings() {
  return text_of(state_->call("settings", "{}", kGrace).result);
}

std::string Scanner::role() {
  const json role = state_->call("status", "{}", kGrace).result.value("role", json());
  if (!role.is_string()) not_slsd("it has no role: the service is older than this library");
  return role;
}

std::vector<std::string> Scanner::reload() {
  const json result = state_->call("reload", "{}", kReloadMax).result;
  std::vector<std::string> tables;
  for (const json& table : result.value("needs_restart", json::array())) {
    if (table.is_string()) tables.push_back(table);
  }
  return tables;
}

Message Scanner::call(const std::string& method, const std::string& params, milliseconds timeout) {
  Answer answer = state_->call(method, params, timeout);
  return {text_of(answer.result), std::move(answer.bytes)};
}

}  // namespace slsd::client
