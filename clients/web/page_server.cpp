// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/page_server.hpp"

#include <httplib.h>

#include <sys/mman.h>
#include <unistd.h>

#include <charconv>
#include <cstdint>
#include <utility>

#include "clients/web/connections.hpp"
#include "clients/web/pages.hpp"
#include "core/printable.hpp"
#include "core/utc_text.hpp"
#include "daemon/client/client_commands.hpp"
#include "daemon/client/connection.hpp"
#include "daemon/rpc/message.hpp"
#include "drivers/files/file.hpp"

namespace slsd::web {
namespace {

using namespace std::chrono_literals;
using httplib::Request;
using httplib::Response;
using nlohmann::json;

constexpr std::size_t kBodyMax = 16 << 10;
constexpr std::size_t kThreads = 48;  // each watcher holds one while it waits for a cloud
constexpr auto kWaitForCloud = 10s;
constexpr auto kPatience = 90s;
constexpr double kSymbolsHz = 15.0, kPixelsHz = 5.0;
constexpr std::size_t kPastMax = 50;
constexpr std::size_t kPastBytesMax = 24 << 20;
constexpr std::size_t kScriptBytesMax = 4 << 20;

// No exceptions: no script, style or picture of anywhere else, none written in the page, no frame around it.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";

Asker asker_of(const Request& request) {
  return {request.remote_addr,
          request.get_header_value("Host"),
          request.get_header_value("Origin"),
          request.get_header_value("Sec-Fetch-Site"),
          request.get_header_value("Cookie"),
          request.get_header_value("X-Slsd-Page") == "1"};
}

void refuse(Response& response, int status, const std::string& name, const std::string& message) {
  response.status = status;
  const json error{{"error", {{"name", name}, {"message", printable(message, 1500)}}}};
  response.set_content(to_line(error), "application/json");
}

void refuse(Response& response, const Failure& failure) {
  const std::string& name = failure.error.name;
  const int status = failure.exit_status == kNoDaemon ? 503
                     : name == "permission_denied"    ? 403
                     : name == "invalid_params"       ? 400
                     : name == "busy"                 ? 503
                                                      : 502;
  const std::string where = failure.error.where.empty() ? "" : failure.error.where + ": ";
  refuse(response, status, failure.exit_status == kNoDaemon ? "no_service" : name, where + failure.error.message);
}

void send_json(Response& response, const json& value) {
  response.set_content(to_line(value), "application/json");
}

/// Takes pages of a memfd out of this process again: they stay where the service has them, and may be read anew.
void forget(const char* data, std::size_t size) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(data), first = (begin + page - 1) / page * page;
  const std::uintptr_t end = (begin + size) / page * page;
  if (first < end) ::madvise(reinterpret_cast<void*>(first), end - first, MADV_DONTNEED);
}

// Clouds are memfds, of which no more is here than is being sent, however many read however many.
void send_cloud_bytes(Response& response, client::Bytes bytes, const json& about) {
  response.set_header("X-Slsd-About", about.dump(-1, ' ', true, json::error_handler_t::replace));
  const std::size_t size = bytes.size();
  response.set_content_provider(
      size, "application/octet-stream",
      [bytes = std::move(bytes)](std::size_t at, std::size_t length, httplib::DataSink& sink) {
        const std::size_t part = std::min<std::size_t>(length, 1 << 20);
        const bool sent = sink.write(bytes.data() + at, part);
        forget(bytes.data() + at, part);
        return sent;
      });
}

// The bytes stay one piece, however many read them.
void send_bytes(Response& response, client::Bytes bytes, const char* type, const json& about) {
  response.set_header("X-Slsd-About", about.dump(-1, ' ', true, json::error_handler_t::replace));
  const std::size_t size = bytes.size();
  response.set_content_provider(
      size, type, [bytes = std::move(bytes)](std::size_t at, std::size_t length, httplib::DataSink& sink) {
        return sink.write(bytes.data() + at, std::min<std::size_t>(length, 1 << 20));
      });
}

/// What the page shows of a scan.
json brief(const json& about) {
  json result = json::object();
  for (const char* key : {"scan", "time", "points", "density", "capture_ms", "decode_ms", "latency_ms", "lost", "tries",
                          "saturated", "sigma_calibration_mm", "width_px", "height_px"}) {
    if (about.contains(key)) result[key] = about[key];
  }
  return result;
}

bool is_density(const std::string& text) {
  return text == "symbols" || text == "pixels";
}

}  // namespace

PageServer::PageServer(PageOptions options, std::string token)
    : options_(std::move(options)),
      gate_(
          [this] {
            std::vector<std::string> names = options_.names;
            names.push_back(options_.listen.find(':') == std::string::npos ? options_.listen
                                                                           : "[" + options_.listen + "]");
            if (options_.listen == "127.0.0.1" || options_.listen == "::1") names.emplace_back("localhost");
            return names;
          }(),
          std::move(token)),
      symbols_(options_.socket, "symbols", kSymbolsHz),
      pixels_(options_.socket, "pixels", kPixelsHz) {}

Result<> PageServer::run() {
  Connections server;
  server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  server.set_payload_max_length(kBodyMax);
  server.set_tcp_nodelay(true);
  server.set_default_headers({{"Content-Security-Policy", kPolicy},
                              {"X-Content-Type-Options", "nosniff"},
                              {"Referrer-Policy", "no-referrer"},
                              {"Cross-Origin-Opener-Policy", "same-origin"},
                              {"Cross-Origin-Resource-Policy", "same-origin"},
                              {"Cache-Control", "no-store"}});
  server.set_exception_handler([](const Request&, Response& response, std::exception_ptr) {
    refuse(response, 400, "invalid_request", "the request cannot be read");
  });
  server.set_error_handler([](const Request&, Response& response) {
    if (response.body.empty() && response.status != 404)
      refuse(response, response.status, "invalid_request", "no such request");
    if (response.body.empty()) refuse(response, 404, "not_found", "there is nothing of this name");
  });
  add_pages(server);
  add_requests(server);
  if (!server.bind_to_port(options_.listen.c_str(), options_.port))
    return fail(ErrorCode::kIo, "cannot listen there: choose another --port, or stop what has it",
                options_.listen + ":" + std::to_string(options_.port));
  if (!server.listen_after_bind()) return fail(ErrorCode::kIo, "listening ended", options_.listen);
  return {};
}

void PageServer::add_pages(httplib::Server& server) {
  for (const Page& page : pages()) {
    server.Get(std::string(page.path), [this, page](const Request& request, Response& response) {
      if (const auto refused = gate_.check_host(asker_of(request)))
        return refuse(response, refused->status, refused->name, refused->message);
      response.set_content(page.text.data(), page.text.size(), std::string(page.type));
    });
  }
  // Debian's, by their own names: no path of a request's.
  for (const auto& [path, file] : {std::pair{"/three.js", "three.min.js"},
                                   std::pair{"/orbit_controls.js", "examples/js/controls/OrbitControls.js"}}) {
    server.Get(path, [this, file = options_.three / file](const Request& request, Response& response) {
      if (const auto refused = gate_.check_host(asker_of(request)))
        return refuse(response, refused->status, refused->name, refused->message);
      auto script = read_file(file, kScriptBytesMax);
      if (!script)
        return refuse(response, 404, "no_three",
                      file.string() + " cannot be read: install libjs-three, or name its folder with --three");
      response.set_header("Cache-Control", "private, max-age=86400");
      response.set_content(std::move(*script), "text/javascript");
    });
  }
}

bool PageServer::admits(const Request& request, Response& response, bool open) {
  const auto refused = gate_.check(asker_of(request), open);
  if (refused) refuse(response, refused->status, refused->name, refused->message);
  return !refused;
}

void PageServer::add_requests(httplib::Server& server) {
  const auto get = [&](const char* path, auto handle) {
    server.Get(path, [this, handle](const Request& request, Response& response) {
      if (admits(request, response)) handle(request, response);
    });
  };
  const auto post = [&](const char* path, bool open, auto handle) {
    server.Post(path, [this, open, handle](const Request& request, Response& response) {
      if (!admits(request, response, open)) return;
      const json body = json::parse(request.body, nullptr, /*allow_exceptions=*/false);
      if (!body.is_object()) return refuse(response, 400, "invalid_request", "the request's body is no JSON object");
      handle(request, body, response);
    });
  };
  get("/api/status", [this](const Request&, Response& response) { tell_status(response); });
  get("/api/frame", [this](const Request& request, Response& response) { send_image(request, response, "frame"); });
  get("/api/preview", [this](const Request& request, Response& response) { send_image(request, response, "preview"); });
  get("/api/cloud", [this](const Request& request, Response& response) { send_cloud(request, response); });
  get("/api/past", [this](const Request& request, Response& response) { send_past(request, response); });
  get("/api/metrics", [this](const Request&, Response& response) {
    const auto answered = call("metrics", json::object());
    if (!answered) return refuse(response, answered.error());
    const client::Bytes& text = answered->reply.bytes;
    response.set_content(text.data(), text.size(), "text/plain; charset=utf-8");
  });
  get("/api/exposure", [this](const Request& request, Response& response) {
    ClientOptions options;
    options.socket = options_.socket;
    options.camera = request.get_param_value("camera");
    const auto advice = look_at_exposure(options);
    advice ? send_json(response, *advice) : refuse(response, advice.error());
  });
  post("/api/scan", false, [this](const Request&, const json& body, Response& response) { scan(body, response); });
  post("/api/project", false, [this](const Request&, const json& body, Response& response) {
    const auto picture = body.find("picture");
    if (picture == body.end() || !picture->is_string() || *picture == "image")
      return refuse(response, 400, "invalid_params", "\"picture\" must be the name of a picture");
    const auto answered = call("project", {{"picture", *picture}});
    answered ? send_json(response, answered->reply.message["result"]) : refuse(response, answered.error());
  });
  // The service says what can be set, and to whom it is given.
  post("/api/set", false, [this](const Request&, const json& body, Response& response) {
    const auto answered = call("set", body);
    answered ? send_json(response, answered->reply.message["result"]) : refuse(response, answered.error());
  });
  post("/api/calibrate", false, [this](const Request&, const json& body, Response& response) {
    const auto answered = call("calibrate", body);
    answered ? send_json(response, answered->reply.message["result"]) : refuse(response, answered.error());
  });
  get("/api/calibration", [this](const Request&, Response& response) {
    const auto answered = call("calibrate", {{"action", "look"}});
    answered ? send_json(response, answered->reply.message["result"]) : refuse(response, answered.error());
  });
  post("/api/login", true, [this](const Request& request, const json& body, Response& response) {
    const auto token = body.find("token");
    Refusal refusal{};
    const auto cookie = gate_.log_in(
        request.remote_addr, token != body.end() && token->is_string() ? token->get<std::string>() : "", refusal);
    if (!cookie) return refuse(response, refusal.status, refusal.name, refusal.message);
    const bool secure = request.get_header_value("X-Forwarded-Proto") == "https";
    response.set_header("Set-Cookie", *cookie + (secure ? "; Secure" : ""));
    send_json(response, json::object());
  });
}

tl::expected<Answered, Failure> PageServer::call(const char* method, json params) const {
  auto connection = Connection::open(options_.socket);
  if (!connection) return tl::unexpected(failure(connection.error()));
  connection->set_patience(kPatience);
  return ask(*connection, method, std::move(params));
}

void PageServer::tell_status(Response& response) {
  const auto status = call("status", json::object());
  if (!status) return refuse(response, status.error());
  const auto settings = call("settings", json::object());
  if (!settings) return refuse(response, settings.error());
  const json& set = settings->reply.message["result"];
  json result{{"status", status->reply.message["result"]},
              {"cameras", set.value("cameras", json::array())},
              {"density",
               set.value("configuration", json::object()).value("decode", json::object()).value("density", "symbols")}};
  json past = json::array();
  {
    const std::lock_guard lock(mutex_);
    for (const PastScan& scan : past_) {
      past.push_back(scan.about);
      past.back()["kept"] = !scan.ply.empty();
    }
  }
  result["past"] = std::move(past);
  send_json(response, result);
}

void PageServer::send_image(const Request& request, Response& response, const char* method) const {
  json params = json::object();
  if (const std::string camera = request.get_param_value("camera"); !camera.empty()) params["camera"] = camera;
  if (request.get_param_value("as_shown") == "1") params["as_shown"] = true;
  const bool raw = request.get_param_value("format") == "raw" && method == std::string_view("frame");
  if (raw) params["format"] = "raw";
  auto answered = call(method, std::move(params));
  if (!answered) return refuse(response, answered.error());
  const json about = answered->reply.message["result"];
  send_bytes(response, answered->reply.bytes, raw ? "application/octet-stream" : "image/png",
             method == std::string_view("preview") ? brief(about) : about);
}

void PageServer::send_cloud(const Request& request, Response& response) {
  const std::string density = request.get_param_value("density"), text = request.get_param_value("after");
  std::uint64_t after = 0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), after);
  if (!is_density(density) || wrong != std::errc() || end != text.data() + text.size())
    return refuse(response, 400, "invalid_params", "\"density\" is \"symbols\" or \"pixels\", \"after\" a number");
  const auto next = (density == "pixels" ? pixels_ : symbols_).next(after, kWaitForCloud);
  if (!next) return refuse(response, next.error());
  if (!*next) {
    response.status = 204;
    return;
  }
  json about = brief((*next)->about);
  about["number"] = (*next)->number;
  send_cloud_bytes(response, (*next)->ply, about);
}

void PageServer::scan(const json& body, Response& response) {
  json params{{"format", "ply"}, {"timeout_ms", 60'000}, {"transport", "memfd"}};
  for (const auto& [key, value] : body.items()) {
    const bool known = key == "density" || key == "texture" || key == "ambient" || key == "normals";
    if (!known) return refuse(response, 400, "invalid_params", "no such parameter: \"" + printable(key, 64) + "\"");
    params[key] = value;
  }
  auto answered = call("scan", std::move(params));
  if (!answered) {
    keep({{{"time", utc_text_ms(std::chrono::system_clock::now())},
           {"error", printable(answered.error().error.message, 300)}},
          {}});
    return refuse(response, answered.error());
  }
  if (!answered->reply.message["result"].contains("memfd_bytes"))
    return refuse(response, 502, "malformed",
                  "the service sends clouds otherwise than asked: it is of another version");
  const json about = brief(answered->reply.message["result"]);
  keep({about, answered->reply.bytes});
  send_cloud_bytes(response, answered->reply.bytes, about);
}

void PageServer::send_past(const Request& request, Response& response) {
  const std::string id = request.get_param_value("scan");
  const std::lock_guard lock(mutex_);
  for (const PastScan& scan : past_) {
    if (!scan.ply.empty() && scan.about.value("scan", "") == id)
      return send_cloud_bytes(response, scan.ply, scan.about);
  }
  refuse(response, 404, "not_found", "this cloud is not kept any more: scan again");
}

// The newest clouds as far as they fit; of the others only what they were.
void PageServer::keep(PastScan scan) {
  const std::lock_guard lock(mutex_);
  past_.push_front(std::move(scan));
  if (past_.size() > kPastMax) past_.pop_back();
  std::size_t bytes = 0;
  for (PastScan& each : past_) {
    bytes += each.ply.size();
    if (bytes > kPastBytesMax) each.ply = {};
  }
}

}  // namespace slsd::web
