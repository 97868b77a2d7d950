// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/page_server.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <utility>

#include "clients/connection/connection.hpp"
#include "clients/slsctl/commands/client_commands.hpp"
#include "clients/web/away.hpp"
#include "clients/web/boards.hpp"
#include "core/base64.hpp"
#include "core/printable.hpp"
#include "core/utc_text.hpp"
#include "drivers/files/file.hpp"
#include "rpc/message.hpp"
#include "rpc/request.hpp"

namespace slsd::web {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr std::size_t kBodyMax = 16 << 10;
constexpr auto kWaitForCloud = 10s;
constexpr auto kTimeout = 90s;
constexpr auto kTimeoutOfStatus = 5s;  // the service answers at once, unless it hangs
constexpr double kSymbolsHz = 15.0, kPixelsHz = 5.0, kMapsHz = 3.0;
constexpr std::size_t kPastMax = 50;
constexpr std::size_t kPastBytesMax = 48 << 20;
constexpr std::size_t kScriptBytesMax = 4 << 20;
constexpr std::size_t kResultBytesMax = 1 << 20;

// What a page may ask of a scan.
constexpr std::array<std::string_view, 9> kScanKeys = {"density", "texture", "colour", "ambient",  "normals",
                                                       "preset",  "box",     "plane",  "box_frame"};

// No exceptions: no external or inline script, style or picture, and no frame around the page.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";

Answer refusal(int status, const std::string& name, const std::string& message) {
  return answer_of({status, name, message});
}

Answer json_answer(const json& value) {
  return {200, "application/json", client::Bytes(to_line(value)), {}, {}};
}

std::string parameter(const Request& request, const char* name) {
  const auto found = request.query.find(name);
  return found == request.query.end() ? "" : found->second;
}

/// Releases a memfd's pages in this process: the service still has them, and they can be read again.
void forget(const char* data, std::size_t size) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(data), first = (begin + page - 1) / page * page;
  const std::uintptr_t end = (begin + size) / page * page;
  if (first < end) ::madvise(reinterpret_cast<void*>(first), end - first, MADV_DONTNEED);
}

std::pair<std::string, std::string> header_about(const json& about) {
  return {"X-Slsd-About", about.dump(-1, ' ', true, json::error_handler_t::replace)};
}

// Clouds are memfds; only the parts being sent are resident here, however many clients read.
Answer cloud_answer(client::Bytes bytes, const json& about) {
  return {200, "application/octet-stream", std::move(bytes), {header_about(about)}, [](std::string_view sent) {
            forget(sent.data(), sent.size());
          }};
}

/// The part of a scan's description that the page shows.
json brief(const json& about) {
  json result = json::object();
  for (const char* key : {"scan", "time", "points", "density", "capture_ms", "decode_ms", "latency_ms", "lost", "tries",
                          "saturated", "sigma_calibration_mm", "width_px", "height_px", "empty", "preset"}) {
    if (about.contains(key)) result[key] = about[key];
  }
  return result;
}

Answer page_answer(const Page& page) {
  return {200, std::string(page.type), client::Bytes(nullptr, page.text), {}, {}};
}

std::pair<std::string, std::string> cookie_header(const Session& session, const Request& request) {
  return {"Set-Cookie", session.cookie + (request.by_https ? "; Secure" : "")};
}

/// The command that makes a service read its configuration again.
std::string reload_command(const std::filesystem::path& configuration, int process) {
  if (configuration.parent_path() != "/etc/slsd") return "sudo kill -HUP " + std::to_string(process);
  const std::string name = configuration.stem().string();
  return "sudo systemctl reload slsd" + (name == "slsd" ? "" : "@" + name);
}

bool is_density(const std::string& text) {
  return text == "symbols" || text == "pixels";
}

}  // namespace

bool is_loopback(const std::string& address) {
  return address.starts_with("127.") || address == "::1" || address == "localhost";
}

std::filesystem::path state_folder(const std::string& name) {
  const auto folder_in = [](const char* variable) {
    const char* const folder = std::getenv(variable);
    return folder != nullptr && *folder == '/' ? std::filesystem::path(folder) : std::filesystem::path();
  };
  if (const auto state = folder_in("STATE_DIRECTORY"); !state.empty()) return state / name;
  if (const auto state = folder_in("XDG_STATE_HOME"); !state.empty()) return state / "slsd-web" / name;
  if (const auto home = folder_in("HOME"); !home.empty()) return home / ".local/state/slsd-web" / name;
  return std::filesystem::temp_directory_path() / ("slsd-web-" + name);
}

Answer PageServer::refusal_of(const Failure& failure) const {
  const std::string &name = failure.error.name, &where = failure.error.where;
  if (is_away(name, where, options_.socket)) return answer_of(no_service(options_.socket));
  const int status = name == "permission_denied" ? 403 : name == "invalid_params" ? 400 : name == "busy" ? 503 : 502;
  return refusal(status, name, (where.empty() ? "" : where + ": ") + failure.error.message);
}

Answer PageServer::result_or_refusal(const tl::expected<Answered, Failure>& answered) const {
  return answered ? json_answer(answered->reply.message["result"]) : refusal_of(answered.error());
}

PageServer::PageServer(PageOptions options, Token token)
    : options_(std::move(options)),
      token_(std::move(token)),
      symbols_(options_.socket, {"symbols", "ply", kSymbolsHz}),
      pixels_(options_.socket, {"pixels", "ply", kPixelsHz}),
      maps_(options_.socket, {"pixels", "pcd", kMapsHz}),
      hand_eye_(options_.views, options_.socket),
      model_(options_.model, options_.socket) {
  add_pages();
  add_requests();
  add_model_requests();
}

Result<> PageServer::open() {
  auto server = HttpServer::open(options_.listen, options_.port,
                                 {[this](const Request& request) { return refuse(request); },
                                  [this](const Request& request) { return routes_.at(request.path).answer(request); },
                                  {{"Content-Security-Policy", kPolicy},
                                   {"X-Content-Type-Options", "nosniff"},
                                   {"X-Frame-Options", "DENY"},
                                   {"Referrer-Policy", "no-referrer"},
                                   {"Cross-Origin-Opener-Policy", "same-origin"},
                                   {"Cross-Origin-Resource-Policy", "same-origin"},
                                   {"Cache-Control", "no-store"}},
                                  kBodyMax});
  if (!server) return tl::unexpected(server.error());
  server_ = std::move(*server);
  std::vector<std::string> names = options_.names;
  names.push_back(options_.listen);
  if (is_loopback(options_.listen)) names.emplace_back("localhost");
  gate_ = std::make_unique<Gate>(std::move(names), token_, "slsd_session_" + std::to_string(port()));
  return {};
}

void PageServer::run(const std::function<void()>& at_end) {
  server_->run([&] {
    at_end();
    model_.end();
  });
}

// Judges the head alone, so that no body without a secret is read.
std::optional<Answer> PageServer::refuse(const Request& request) {
  if (const auto refused = gate_->check_host(request)) return answer_of(*refused);
  const auto route = routes_.find(request.path);
  const bool is_open = route != routes_.end() && route->second.open;
  if (!is_open && (route != routes_.end() || request.path.starts_with("/api/"))) {
    if (const auto refused = gate_->check(request)) return answer_of(*refused);
  }
  if (route == routes_.end()) return refusal(404, "not_found", "there is nothing at this address");
  const std::string& method = route->second.method;
  if (request.method == method || (request.method == "HEAD" && method == "GET")) {
    const auto unknown = is_open ? std::nullopt : unknown_parameter(request.query, route->second.names);
    return unknown ? std::optional(answer_of(*unknown)) : std::nullopt;
  }
  Answer wrong = refusal(405, "invalid_request", "use the method " + method);
  wrong.headers.emplace_back("Allow", method == "GET" ? "GET, HEAD" : method);
  return wrong;
}

void PageServer::add_pages() {
  for (const Page& page : pages()) {
    routes_[std::string(page.path)] = {"GET", true, {}, [this, page](const Request& request) {
                                         return page.path == "/" ? index(page, request) : page_answer(page);
                                       }};
  }
  // Debian's files, under fixed names: requests cannot choose a path.
  for (const auto& [path, file] : {std::pair{"/three.js", "three.min.js"},
                                   std::pair{"/orbit_controls.js", "examples/js/controls/OrbitControls.js"}}) {
    routes_[path] = {"GET", true, {}, [file = options_.three / file](const Request&) {
                       auto script = read_file(file, kScriptBytesMax);
                       if (!script)
                         return refusal(
                             404, "no_three",
                             file.string() + " cannot be read: install libjs-three, or give its folder with --three");
                       return Answer{200,
                                     "text/javascript",
                                     client::Bytes(std::move(*script)),
                                     {{"Cache-Control", "private, max-age=86400"}},
                                     {}};
                     }};
  }
}

// The address that slsd-web prints contains the token. It is exchanged for a session and removed from the address. A
// token in another page's background request is ignored.
Answer PageServer::index(const Page& page, const Request& request) {
  const auto token = request.query.find("token");
  const bool opened = request.destination.empty() || request.destination == "document";
  if (token == request.query.end() || !opened) return page_answer(page);
  const auto session = gate_->log_in(request.address, token->second);
  if (!session) {
    Answer answer = page_answer(page);  // asks for the token
    answer.status = session.error().status;
    return answer;
  }
  return {303, "", {}, {{"Location", "./#key=" + session->key}, cookie_header(*session, request)}, {}};
}

Answer PageServer::log_in(const Request& request, const json& body) {
  if (const auto refused = gate_->check_origin(request)) return answer_of(*refused);
  const auto token = body.find("token");
  const auto session =
      gate_->log_in(request.address, token != body.end() && token->is_string() ? token->get<std::string>() : "");
  if (!session) return answer_of(session.error());
  Answer answer = json_answer({{"key", session->key}});
  answer.headers.push_back(cookie_header(*session, request));
  return answer;
}

void PageServer::post(const char* path, bool open, HandleBody handle) {
  routes_[path] = {"POST", open, {}, [handle = std::move(handle)](const Request& request) {
                     const auto [body, repeated] = parse_json(request.body);
                     if (!body.is_object())
                       return refusal(400, "invalid_request", "the request's body is not a JSON object");
                     if (repeated) return refusal(400, "invalid_request", appears_twice(*repeated));
                     return handle(request, body);
                   }};
}

// The service itself reports wrong parameters and missing rights.
void PageServer::pass_on(const char* path, const char* method) {
  post(path, false,
       [this, method](const Request&, const json& body) { return result_or_refusal(call(method, body, kTimeout)); });
}

void PageServer::add_requests() {
  get("/api/status", [this](const Request&) { return status(); });
  get("/api/frame", {"camera", "as_shown", "format"},
      [this](const Request& request) { return image(request, "frame"); });
  get("/api/reasons", {"camera"}, [this](const Request& request) { return reasons(request); });
  get("/api/preview", {"camera"}, [this](const Request& request) { return image(request, "preview"); });
  get("/api/cloud", {"density", "after", "organised"}, [this](const Request& request) { return cloud(request); });
  get("/api/past", {"scan"}, [this](const Request& request) { return past(request); });
  get("/api/metrics", [this](const Request&) {
    const auto answered = call("metrics", {{"format", "prometheus"}}, kTimeout);
    if (!answered) return refusal_of(answered.error());
    return Answer{200, "text/plain; version=0.0.4; charset=utf-8", answered->reply.bytes, {}, {}};
  });
  get("/api/exposure", {"camera"}, [this](const Request& request) {
    ClientOptions options;
    options.socket = options_.socket;
    options.camera = parameter(request, "camera");
    const auto advice = look_at_exposure(options);
    return advice ? json_answer(*advice) : refusal_of(advice.error());
  });
  get("/api/presets", [this](const Request&) { return result_or_refusal(call("presets", json::object(), kTimeout)); });
  get("/api/boards", [this](const Request&) { return boards(); });
  get("/api/board", {"name"}, [this](const Request& request) { return board(request); });
  get("/api/calibration", [this](const Request&) {
    return result_or_refusal(call("calibrate", {{"action", "look"}}, kTimeout));
  });
  get("/api/hand_eye", [this](const Request&) { return hand_eye(); });
  get("/api/hand_eye/look", {"look", "camera"}, [this](const Request& request) { return hand_eye_picture(request); });
  get("/api/hand_eye/file", [this](const Request&) {
    auto text = read_file(hand_eye_.file(), kResultBytesMax);
    if (!text) return refusal(404, "not_found", "there is no result yet: take more views");
    return Answer{200, "application/yaml", client::Bytes(std::move(*text)), {}, {}};
  });
  post("/api/hand_eye/act", false, [this](const Request&, const json& body) {
    const auto done = hand_eye_.act(body);
    return done ? hand_eye() : answer_of(done.error());
  });
  post("/api/scan", false, [this](const Request&, const json& body) { return scan(body); });
  post("/api/project", false, [this](const Request&, const json& body) {
    if (const auto unknown = unknown_parameter(body, {"picture"})) return answer_of(*unknown);
    const auto picture = body.find("picture");
    if (picture == body.end() || !picture->is_string() || *picture == "image")
      return refusal(400, "invalid_params", "\"picture\" must be the name of a picture");
    return result_or_refusal(call("project", {{"picture", *picture}}, kTimeout));
  });
  pass_on("/api/set", "set");
  pass_on("/api/preset", "preset");
  pass_on("/api/calibrate", "calibrate");
  post("/api/login", true, [this](const Request& request, const json& body) { return log_in(request, body); });
}

void PageServer::add_model_requests() {
  get("/api/model", [this](const Request&) { return json_answer(model_.state()); });
  get("/api/model/preview", [this](const Request&) {
    const json about{{"number", model_.state()["previews"]}};  // before: the points are as new or newer
    auto points = model_.preview();
    return points ? cloud_answer(std::move(*points), about) : answer_of(points.error());
  });
  get("/api/model/file", {"format"}, [this](const Request& request) {
    auto file = model_.file(parameter(request, "format"));
    return file ? cloud_answer(std::move(*file), json::object()) : answer_of(file.error());
  });
  post("/api/model/act", false, [this](const Request&, const json& body) {
    const auto done = model_.act(body);
    return done ? json_answer(*done) : answer_of(done.error());
  });
  post("/api/model/background", false, [this](const Request&, const json& body) {
    const auto unknown = unknown_parameter(body, {});
    return unknown ? answer_of(*unknown) : take_background();
  });
}

/// A cloud of the scene without the object.
Answer PageServer::take_background() {
  const auto answered = call("scan",
                             {{"format", "ply"},
                              {"density", "pixels"},
                              {"coordinate_frame", "rig"},
                              {"timeout_ms", 60'000},
                              {"transport", "memfd"}},
                             kTimeout);
  if (!answered) return refusal_of(answered.error());
  if (const auto refused = model_.keep_background(answered->reply.bytes)) return answer_of(*refused);
  return json_answer(model_.state());
}

tl::expected<Answered, Failure> PageServer::call(const char* method, const json& params,
                                                 std::chrono::seconds timeout) const {
  auto connection = Connection::open(options_.socket);
  if (!connection) return tl::unexpected(failure(connection.error()));
  connection->set_timeout(timeout);
  return ask(*connection, method, params);
}

Answer PageServer::status() {
  const auto status = call("status", json::object(), kTimeoutOfStatus);
  if (!status) return refusal_of(status.error());
  const auto settings = call("settings", json::object(), kTimeoutOfStatus);
  if (!settings) return refusal_of(settings.error());
  const json& set = settings->reply.message["result"];
  const json configuration = set.value("configuration", json::object());
  json result{{"status", status->reply.message["result"]},
              {"cameras", set.value("cameras", json::array())},
              {"density", configuration.value("decode", json::object()).value("density", "symbols")},
              {"part", configuration.value("cloud", json::object())}};
  json past = json::array();
  {
    const std::lock_guard lock(mutex_);
    for (const PastScan& scan : past_) {
      past.push_back(scan.about);
      past.back()["kept"] = !scan.cloud.empty();
    }
  }
  result["past"] = std::move(past);
  return json_answer(result);
}

Answer PageServer::image(const Request& request, const char* method) const {
  json params = json::object();
  if (const std::string camera = parameter(request, "camera"); !camera.empty()) params["camera"] = camera;
  const std::string as_shown = parameter(request, "as_shown"), format = parameter(request, "format");
  if (!as_shown.empty() && as_shown != "1") return refusal(400, "invalid_params", "\"as_shown\" must be 1");
  if (!format.empty() && format != "png" && format != "raw")
    return refusal(400, "invalid_params", "\"format\" must be \"png\" or \"raw\"");
  if (!as_shown.empty()) params["as_shown"] = true;
  const bool raw = format == "raw";
  if (raw) params["format"] = "raw";
  auto answered = call(method, params, kTimeout);
  if (!answered) return refusal_of(answered.error());
  const json about = answered->reply.message["result"];
  return {200,
          raw ? "application/octet-stream" : "image/png",
          answered->reply.bytes,
          {header_about(method == std::string_view("preview") ? brief(about) : about)},
          {}};
}

/// A frame with the rule that rejected each region, and the rules' meanings.
Answer PageServer::reasons(const Request& request) const {
  json params{{"why", true}};
  if (const std::string camera = parameter(request, "camera"); !camera.empty()) params["camera"] = camera;
  const auto answered = call("preview", params, kTimeout);
  if (!answered) return refusal_of(answered.error());
  const json& about = answered->reply.message["result"];
  return json_answer({{"png", to_base64(answered->reply.bytes)}, {"reasons", about.value("reasons", json::array())}});
}

Answer PageServer::boards() const {
  const auto boards = read_boards(options_.boards);
  if (!boards) return refusal(404, "no_boards", to_string(boards.error()));
  json result = json::array();
  for (const PrintableBoard& board : *boards)
    result.push_back({{"name", printable(board.name, 200)},
                      {"board", board.board},
                      {"width_mm", board.width_mm},
                      {"height_mm", board.height_mm}});
  return json_answer({{"boards", std::move(result)}});
}

Answer PageServer::board(const Request& request) const {
  auto boards = read_boards(options_.boards);
  if (!boards) return refusal(404, "no_boards", to_string(boards.error()));
  const std::string name = parameter(request, "name");
  for (PrintableBoard& board : *boards) {
    if (board.name == name) return {200, "application/pdf", client::Bytes(std::move(board.pdf)), {}, {}};
  }
  return refusal(404, "not_found", "there is no such board: choose one from the list");
}

/// The session, and where its result belongs.
Answer PageServer::hand_eye() const {
  json told = hand_eye_.state();
  told["file"] = hand_eye_.file().string();
  const auto settings = call("settings", json::object(), kTimeoutOfStatus);
  const auto status = call("status", json::object(), kTimeoutOfStatus);
  if (settings && status) {
    const json configuration = settings->reply.message["result"].value("configuration", json::object());
    const std::filesystem::path named = configuration.value("/frame/hand_eye"_json_pointer, "");
    const std::filesystem::path by = status->reply.message["result"].value("configuration", "");
    const auto place = by.parent_path() / (named.empty() ? "hand_eye.yml" : named);
    told["installs_to"] = place.lexically_normal().string();
    told["configured"] = !named.empty();
    told["configuration"] = by.string();
    told["reload"] = reload_command(by, status->reply.message["result"].value("process", 0));
  }
  return json_answer(told);
}

Answer PageServer::hand_eye_picture(const Request& request) const {
  auto picture = hand_eye_.picture(parameter(request, "look"), parameter(request, "camera"));
  if (!picture) return answer_of(picture.error());
  return {200, "image/png", client::Bytes(std::move(picture->png)), {header_about(picture->about)}, {}};
}

Answer PageServer::cloud(const Request& request) {
  const std::string density = parameter(request, "density"), text = parameter(request, "after");
  const std::string organised = parameter(request, "organised");
  std::uint64_t after = 0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), after);
  if (!is_density(density) || wrong != std::errc() || end != text.data() + text.size())
    return refusal(400, "invalid_params", "\"density\" must be \"symbols\" or \"pixels\", and \"after\" a number");
  if (!organised.empty() && (organised != "1" || density != "pixels"))
    return refusal(400, "invalid_params", "\"organised\" must be 1, and is for clouds of pixels");
  CloudFeed& feed = density == "symbols" ? symbols_ : organised.empty() ? pixels_ : maps_;
  const auto next = feed.next(after, kWaitForCloud);
  if (!next) return refusal_of(next.error());
  if (!*next) return {204, "", {}, {}, {}};
  json about = brief((*next)->about);
  about["number"] = (*next)->number;
  return cloud_answer((*next)->file, about);
}

Answer PageServer::scan(const json& body) {
  json params{{"format", "ply"}, {"coordinate_frame", "rig"}, {"timeout_ms", 60'000}, {"transport", "memfd"}};
  if (const auto unknown = unknown_parameter(body, {kScanKeys.begin(), kScanKeys.end()})) return answer_of(*unknown);
  params.update(body);
  // Organised, because a PLY of pixels does not contain their positions; the page makes both files from it.
  if (params.value("density", json()) == "pixels") params["format"] = "pcd";
  auto answered = call("scan", params, kTimeout);
  if (!answered) {
    keep({{{"time", utc_text_ms(std::chrono::system_clock::now())},
           {"error", printable(answered.error().error.message, 300)}},
          {}});
    return refusal_of(answered.error());
  }
  if (!answered->reply.message["result"].contains("memfd_bytes"))
    return refusal(502, "malformed", "the service did not send the cloud as a memfd: its version differs");
  const json about = brief(answered->reply.message["result"]);
  keep({about, answered->reply.bytes});
  return cloud_answer(answered->reply.bytes, about);
}

Answer PageServer::past(const Request& request) {
  const std::string id = parameter(request, "scan");
  const std::lock_guard lock(mutex_);
  for (const PastScan& scan : past_) {
    if (!scan.cloud.empty() && scan.about.value("scan", "") == id) return cloud_answer(scan.cloud, scan.about);
  }
  return refusal(404, "not_found", "this cloud is no longer kept: scan again");
}

// Keeps the newest clouds within the limit; of older ones only their descriptions.
void PageServer::keep(PastScan scan) {
  const std::lock_guard lock(mutex_);
  past_.push_front(std::move(scan));
  if (past_.size() > kPastMax) past_.pop_back();
  std::size_t bytes = 0;
  for (PastScan& each : past_) {
    bytes += each.cloud.size();
    if (bytes > kPastBytesMax) each.cloud = {};
  }
}

}  // namespace slsd::web
