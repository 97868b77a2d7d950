// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/methods.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <vector>

#include <spdlog/spdlog.h>
#include <asio/post.hpp>

#include "core/nearest_name.hpp"
#include "core/printable.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "daemon/rpc/base64.hpp"
#include "daemon/rpc/message.hpp"
#include "daemon/rpc/param_reader.hpp"
#include "daemon/scan/message_ids.hpp"
#include "daemon/server/metrics.hpp"
#include "daemon/server/scan_json.hpp"
#include "daemon/server/status_json.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr double kRateMinHz = 0.001;
constexpr double kRateMaxHz = 1000.0;

MonotonicTime deadline_in(int timeout_ms) {
  return std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
}

int read_timeout(ParamReader& reader, const ServiceState& state) {
  return reader.integer("timeout_ms", state.configuration.scan.timeout_ms, 1, kMaxTimeoutMs);
}

SharedBytes share(std::string bytes) {
  return std::make_shared<const std::string>(std::move(bytes));
}

// Makes an answer into a reply on the scanner's thread and carries it to the event loop's thread.
template <class Value, class MakeReply>
Scanner::Answer<Value> carry(ServiceState& state, Respond respond, MakeReply make_reply) {
  return [&events = state.events, respond = std::move(respond), make_reply](Result<Value> value) {
    auto outcome = std::make_shared<Outcome>(value ? make_reply(*value) : tl::unexpected(rpc_error(value.error())));
    asio::post(events, [respond, outcome] { respond(std::move(*outcome)); });
  };
}

// Like carry(); the reply also reports the time from the last byte of its frames to the socket.
template <class MakeReply>
Scanner::Answer<ScanResult> carry_scan(ServiceState& state, Respond respond, MakeReply make_reply) {
  return [&state, respond = std::move(respond), make_reply](const Result<ScanResult>& scan) {
    auto outcome = std::make_shared<Outcome>(scan ? make_reply(*scan) : tl::unexpected(rpc_error(scan.error())));
    const MonotonicTime received = scan ? scan->received : MonotonicTime();
    const bool pictured = scan && !scan->picture_png.empty();
    asio::post(state.events, [&state, respond, outcome, received, pictured] {
      if (*outcome) (*outcome)->result["latency_ms"] = latency_ms(received);
      if (*outcome && !pictured) state.scanner.note_latency(std::chrono::steady_clock::now() - received);
      respond(std::move(*outcome));
    });
  };
}

// An upper bound of a camera picture's bytes in any coding, known before the capture. 0: no such camera, or its size is
// unknown because it was not open yet; then the picture is counted when it exists.
std::size_t picture_bytes(const ServiceState& state, const std::string& camera, std::size_t bytes_a_pixel) {
  for (const DeviceStatus& each : state.scanner.rig().camera_statuses()) {
    if (!camera.empty() && each.name != camera) continue;
    return static_cast<std::size_t>(each.width_px) * static_cast<std::size_t>(each.height_px) * bytes_a_pixel;
  }
  return 0;
}

constexpr std::size_t kFrameBytes = 2;    // per pixel: grey, at full bit depth
constexpr std::size_t kPictureBytes = 3;  // per pixel: decoded symbols are drawn in colour

// An upper bound of a scan's bytes, without a cloud of symbols: nobody knows its size in advance.
std::size_t expected_bytes(const ServiceState& state, const ScanRequest& request, CloudForm form = {}) {
  std::size_t bytes = request.picture ? picture_bytes(state, request.camera, kPictureBytes) : 0;
  if (form.dense()) {
    const std::size_t record = form.format == CloudFormat::kPcd ? 21U : 18U;
    const std::size_t a_pixel = form.format == CloudFormat::kTiff ? 8U : record + (form.normals ? 12U : 0U);
    for (const DeviceStatus& camera : state.scanner.rig().camera_statuses())
      bytes += static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px) * a_pixel;
  }
  if (request.frames == FrameCoding::kNone) return bytes;
  const std::size_t lights = 1 + (request.texture ? 1U : 0U) + (request.ambient ? 1U : 0U);
  for (const DeviceStatus& camera : state.scanner.rig().camera_statuses()) {
    bytes +=
        lights * static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px) * kFrameBytes;
  }
  return bytes;
}

Outgoing picture_event(const ScanResult& scan) {
  Outgoing event;
  event.kind = Outgoing::Kind::kEvent;
  event.bytes = share(scan.picture_png);
  event.line = to_line(
      event_message("picture", {{"scan", scan.cloud.scan_id}, {"format", "png"}, {"bytes", event.bytes->size()}}));
  return event;
}

FrameCoding frame_coding(const std::string& name) {
  if (name == "png") return FrameCoding::kPng;
  return name == "raw" ? FrameCoding::kRaw : FrameCoding::kNone;
}

Outgoing frame_event(const std::string& scan_id, const FrameImage& frame, FrameCoding coding) {
  Outgoing event;
  event.kind = Outgoing::Kind::kEvent;
  event.bytes = share(frame.bytes);
  json params = frame_json(frame);
  params["scan"] = scan_id;
  params["light"] = light_name(frame.light);
  params["format"] = coding == FrameCoding::kPng ? "png" : "raw";
  params["bytes"] = event.bytes->size();
  event.line = to_line(event_message("frame", std::move(params)));
  return event;
}

// The form of cloud that a request asks for; without a density, the configured one.
CloudForm read_form(ParamReader& reader, const ServiceState& state) {
  CloudForm form(cloud_format(reader.choice("format", {"ply", "pcd", "tiff"})));
  const bool pixels = state.configuration.decode.density == Density::kPixels;
  const std::string density =
      pixels ? reader.choice("density", {"pixels", "symbols"}) : reader.choice("density", {"symbols", "pixels"});
  form.density = density == "pixels" ? Density::kPixels : Density::kSymbols;
  form.normals = reader.boolean("normals", false);
  return form;
}

// Refuses parameters that exclude each other.
std::optional<RpcError> refused_form(CloudForm form) {
  const bool tiff = form.format == CloudFormat::kTiff;
  if (tiff && !form.dense()) return invalid_params("\"tiff\" is a depth map: it needs \"density\": \"pixels\"");
  if (form.normals && !form.dense()) return invalid_params("\"normals\" need \"density\": \"pixels\"");
  if (form.normals && tiff) return invalid_params("a depth map (\"tiff\") has no normals: ask for \"ply\" or \"pcd\"");
  return std::nullopt;
}

Outcome scan_reply(const ScanResult& scan, CloudForm form, bool as_memfd, FrameCoding frames, bool why) {
  Reply reply{scan_json(scan, form.density)};
  if (why) reply.result["reasons"] = reasons_json(scan);
  reply.result["format"] = to_string(form.format);
  CloudFiles files = scan.files;
  const SharedBytes cloud = files.file(scan.cloud, scan.dense.get(), form);
  if (as_memfd) {
    auto memory = sealed_memory(*cloud);
    if (!memory) return tl::unexpected(rpc_error(memory.error()));
    reply.result["memfd_bytes"] = cloud->size();
    reply.memory = std::move(*memory);
  } else {
    reply.result["bytes"] = cloud->size();
    reply.bytes = cloud;
  }
  if (!scan.picture_png.empty()) reply.first.push_back(picture_event(scan));
  for (const FrameImage& frame : scan.frames) reply.first.push_back(frame_event(scan.cloud.scan_id, frame, frames));
  return reply;
}

Outcome bytes_reply(std::string bytes, json result) {
  Reply reply{std::move(result)};
  reply.result["bytes"] = bytes.size();
  reply.bytes = share(std::move(bytes));
  return reply;
}

void run_scan(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const CloudForm form = read_form(reader, state);
  const bool as_memfd = reader.choice("transport", {"inline", "memfd"}) == "memfd";
  const int timeout_ms = read_timeout(reader, state);
  const bool picture = reader.boolean("picture", false);
  const bool why = reader.boolean("why", false);
  const FrameCoding frames = frame_coding(reader.choice("frames", {"none", "raw", "png"}));
  const std::string camera = reader.text("camera");
  const bool texture = reader.boolean("texture", false);
  const bool ambient = reader.boolean("ambient", false);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (auto refused = refused_form(form)) return respond(tl::unexpected(*refused));
  const ScanRequest request{deadline_in(timeout_ms),  picture,        camera, frames, texture, ambient,
                            CloudFormats::only(form), session.gone(), why};
  if (auto refused = session.reserve(expected_bytes(state, request, form))) return respond(tl::unexpected(*refused));
  state.scanner.scan(request,
                     carry_scan(state, std::move(respond), [form, as_memfd, frames, why](const ScanResult& scan) {
                       return scan_reply(scan, form, as_memfd, frames, why);
                     }));
}

void run_settings(ServiceState& state, const json& params, Session&, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  const ScanFiles files = state.scanner.setup()->files();
  Reply reply{settings_json(state.configuration)};
  reply.result["pattern"] = files.pattern;
  reply.result["calibration"] = files.calibration;
  reply.result["set"] = state.settings;
  reply.result["file"] = state.configuration_file.string();
  respond(std::move(reply));
}

void run_preview(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const int timeout_ms = read_timeout(reader, state);
  const std::string camera = reader.text("camera");
  const bool why = reader.boolean("why", false);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  ScanRequest request{deadline_in(timeout_ms), true, camera};
  request.why = why;
  request.gone = session.gone();
  if (auto refused = session.reserve(expected_bytes(state, request))) return respond(tl::unexpected(*refused));
  state.scanner.scan(request, carry_scan(state, std::move(respond), [why](const ScanResult& scan) -> Outcome {
                       json result = scan_json(scan);
                       if (why) result["reasons"] = reasons_json(scan);
                       result["format"] = "png";
                       return bytes_reply(scan.picture_png, std::move(result));
                     }));
}

void run_frame(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const std::string format = reader.choice("format", {"png", "raw"});
  const int timeout_ms = read_timeout(reader, state);
  const std::string camera = reader.text("camera");
  const bool as_shown = reader.boolean("as_shown", false);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  const std::size_t expected = picture_bytes(state, camera, kFrameBytes);
  if (auto refused = session.reserve(expected)) return respond(tl::unexpected(*refused));
  state.scanner.frame({deadline_in(timeout_ms), camera, format == "png", as_shown, session.gone()},
                      carry<FrameImage>(state, std::move(respond), [format](const FrameImage& image) {
                        json result = frame_json(image);
                        result["format"] = format;
                        return bytes_reply(image.bytes, std::move(result));
                      }));
}

void run_metrics(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const std::string format = reader.choice("format", {"openmetrics", "prometheus"});
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  const bool older = format == "prometheus";
  respond(bytes_reply(metrics_text(state, older ? MetricsFormat::kPrometheus : MetricsFormat::kOpenMetrics),
                      {{"format", format}}));
}

constexpr std::size_t kBundleNotesBytes = 1 << 20;

void run_bundle(ServiceState& state, const json& params, Session& session, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (auto refused = session.reserve(state.scanner.black_box().bytes() + kBundleNotesBytes))
    return respond(tl::unexpected(*refused));
  state.bundle(carry<std::string>(state, std::move(respond), [](const std::string& bundle) {
    return bytes_reply(bundle, {{"format", "tar"}});
  }));
}

void run_pattern(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  (void)reader.choice("format", {"png"});
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.pattern(carry<std::string>(state, std::move(respond), [](const std::string& png) {
    return bytes_reply(png, {{"format", "png"}});
  }));
}

// Limits a user's pictures per second and at once, because each is decoded and changes the light. No camera needs more.
// Root and the service's own user, which runs slsd-calibrate, are exempt.
constexpr double kPicturesPerSecond = 30.0;

std::optional<RpcError> refused_picture(ServiceState& state, const Session& session) {
  const auto user = session.peer().user;
  if (user == 0 || user == ::geteuid()) return std::nullopt;
  const auto now = std::chrono::steady_clock::now();
  for (auto& [_, allowance] : state.pictures) {
    allowance.left += std::chrono::duration<double>(now - allowance.since).count() * kPicturesPerSecond;
    allowance.since = now;
  }
  std::erase_if(state.pictures, [](const auto& entry) { return entry.second.left >= kPicturesPerSecond; });
  double& left = state.pictures.try_emplace(user, PictureAllowance{kPicturesPerSecond, now}).first->second.left;
  if (left >= 1.0) return left -= 1.0, std::nullopt;
  return rpc_error({ErrorCode::kBusy,
                    "user " + std::to_string(user) + " has shown " +
                        std::to_string(static_cast<int>(kPicturesPerSecond)) +
                        " pictures within a second, the most for one user: try again later",
                    {}});
}

void run_project(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const std::string name = reader.choice("picture", {"pattern", "idle", "black", "white", "focus", "grid", "image"});
  const auto png_bytes_max = static_cast<std::size_t>(state.configuration.server.request_bytes_max);
  std::optional<std::string> png = from_base64(reader.text("png", png_bytes_max));
  const int timeout_ms = read_timeout(reader, state);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (!png || (name == "image") == png->empty()) {
    return respond(tl::unexpected(
        invalid_params("\"png\" must be an image in base64, and goes only with \"picture\": \"image\"")));
  }
  if (auto refused = refused_picture(state, session)) return respond(tl::unexpected(*refused));
  state.scanner.project({*picture_named(name), std::move(*png), deadline_in(timeout_ms), session.gone()},
                        [&events = state.events, respond = std::move(respond), name](const Result<>& shown) {
                          auto outcome = std::make_shared<Outcome>(Reply{{{"picture", name}}});
                          if (!shown) *outcome = tl::unexpected(rpc_error(shown.error()));
                          asio::post(events, [respond, outcome] { respond(std::move(*outcome)); });
                        });
}

void run_status(ServiceState& state, const json& params, Session& session, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  json status = status_json(state);
  status["role"] = to_string(session.role());
  respond(Reply{std::move(status)});
}

void run_subscribe(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const CloudForm form = read_form(reader, state);
  const bool as_memfd = reader.choice("transport", {"inline", "memfd"}) == "memfd";
  const std::optional<double> rate_hz = reader.number("rate_hz", kRateMinHz, kRateMaxHz);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (auto refused = refused_form(form)) return respond(tl::unexpected(*refused));
  json result{{"format", to_string(form.format)}};
  if (form.dense()) result["density"] = to_string(form.density);
  result["rate_hz"] = rate_hz ? json(*rate_hz) : json();
  respond(Reply{std::move(result)});
  session.subscribe(Subscription(form, rate_hz, as_memfd));
  state.server->update_demand();
}

void run_unsubscribe(ServiceState& state, const json& params, Session& session, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  session.unsubscribe();
  state.server->update_demand();
  respond(Reply{json::object()});
}

void run_reload(ServiceState& state, const json& params, Session&, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.reload(state.settings, std::move(respond));
}

void run_set(ServiceState& state, const json& params, Session&, Respond respond) {
  auto settings = merge_settings(state.settings, params);
  if (!settings) return respond(tl::unexpected(invalid_params(settings.error().message)));
  state.reload(std::move(*settings), [&state, respond = std::move(respond)](Outcome outcome) {
    if (outcome) {
      outcome->result["set"] = state.settings;
      if (!outcome->result.contains("not_kept")) outcome->result["not_kept"] = nullptr;
    }
    respond(std::move(outcome));
  });
}

// The folder of the calibrations made over the socket, beside the settings.
std::filesystem::path made_calibration(const ServiceState& state) {
  const auto settings = kept_settings_file(state.configuration_file);
  if (settings.empty()) return {};
  return settings.parent_path() / ("calibration-" + state.configuration_file.stem().string() + ".yml");
}

Result<> begin_calibration(ServiceState& state, const std::vector<std::string>& wanted, bool resume) {
  const auto file = made_calibration(state);
  if (file.empty())
    return fail(
        ErrorCode::kNotFound,
        "$STATE_DIRECTORY is not set, so a calibration cannot be kept: start the service with its systemd unit");
  if (state.calibration->under_way())
    return fail(ErrorCode::kBusy, "a calibration is under way: end or cancel it first");
  const auto poses = std::filesystem::path(file).replace_extension(".poses");
  std::error_code ignored;
  if (!resume) std::filesystem::remove_all(poses, ignored);
  std::vector<std::string> arguments{"--calibrate",
                                     "--progress",
                                     "--config=" + state.configuration_file.string(),
                                     "--socket=" + state.configuration.server.socket.string(),
                                     "--output=" + file.string(),
                                     "--record=" + poses.string()};
  arguments.insert(arguments.end(), wanted.begin(), wanted.end());
  auto begun = state.calibration->begin(state.calibrator, arguments);
  if (begun) state.scanner.run_freely(std::nullopt);
  return begun;
}

void run_calibrate(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const std::string action = reader.choice("action", {"look", "begin", "end", "cancel"});
  const std::string board = reader.text("board"), ruler = reader.text("ruler");
  const std::string code = reader.choice("code", {"pattern", "gray"});
  const int poses = reader.integer("poses", 12, 3, 99);
  const bool resume = reader.boolean("resume", false);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (action == "begin") {
    std::vector<std::string> wanted{"--poses=" + std::to_string(poses), "--code=" + code};
    if (!board.empty()) wanted.push_back("--board=" + board);
    if (!ruler.empty()) wanted.push_back("--ruler=" + ruler);
    if (auto begun = begin_calibration(state, wanted, resume); !begun)
      return respond(tl::unexpected(rpc_error(begun.error())));
  }
  if (action == "end") state.calibration->end();
  if (action == "cancel") state.calibration->cancel();
  respond(Reply{state.calibration->look()});
}

bool always(const json&) {
  return true;
}

bool unless_as_shown(const json& params) {
  return params.value("as_shown", json()) != true;
}

constexpr std::array kMethods{
    RpcMethod{"bundle", Role::kAdminister, run_bundle},
    RpcMethod{"calibrate", Role::kAdminister, run_calibrate},
    RpcMethod{"frame", Role::kScan, run_frame, unless_as_shown},
    RpcMethod{"metrics", Role::kObserve, run_metrics},
    RpcMethod{"pattern", Role::kObserve, run_pattern},
    RpcMethod{"preview", Role::kScan, run_preview, always},
    RpcMethod{"project", Role::kAdminister, run_project, always},
    RpcMethod{"reload", Role::kAdminister, run_reload, always},
    RpcMethod{"scan", Role::kScan, run_scan, always},
    RpcMethod{"set", Role::kAdminister, run_set, always},
    RpcMethod{"settings", Role::kObserve, run_settings},
    RpcMethod{"status", Role::kObserve, run_status},
    RpcMethod{"subscribe", Role::kScan, run_subscribe},
    RpcMethod{"unsubscribe", Role::kObserve, run_unsubscribe},
};

RpcError not_for(Session& session, const RpcMethod& method) {
  const Peer& peer = session.peer();
  const MessageId id(MessageId::kClientRefused);
  if (session.is_first_refusal())
    spdlog::warn("a client (process {}, user {}) asked for {}, which needs the role \"{}\": refused", peer.process,
                 peer.user, method.name, to_string(method.role));
  return rpc_error({ErrorCode::kPermissionDenied,
                    "\"" + std::string(method.name) + "\" needs the role \"" + std::string(to_string(method.role)) +
                        "\", but user " + std::to_string(peer.user) + " has \"" +
                        std::string(to_string(session.role())) + "\": " + session.way_to(method.role),
                    {}});
}

// While somebody holds a calibration board in the light, no other client may change the light.
bool would_disturb(const ServiceState& state, const RpcMethod& method, const json& params, const Session& session) {
  if (!state.calibration || !state.calibration->under_way()) return false;
  if (session.peer().process == state.calibration->process()) return false;
  return method.disturbs != nullptr && method.disturbs(params);
}

}  // namespace

std::span<const RpcMethod> methods() {
  return kMethods;
}

void calibrated(ServiceState& state, bool made) {
  const auto release = [&state] {
    const MonotonicTime deadline = deadline_in(state.configuration.scan.timeout_ms);
    state.scanner.project({Picture::kIdle, {}, deadline, {}}, [](const auto&) {});
    state.server->update_demand();
  };
  if (!made) return release();
  const auto conclude = [&state, release](const Outcome& outcome) {
    state.calibration->conclude(
        outcome ? Result<>()
                : fail(ErrorCode::kIo, "the calibration is saved but not in force: " + outcome.error().message));
    release();
  };
  auto settings = merge_settings(state.settings, {{"calibration", {{"file", made_calibration(state).string()}}}});
  if (settings) return state.reload(std::move(*settings), conclude);
  conclude(tl::unexpected(rpc_error(settings.error())));
}

void dispatch(ServiceState& state, const Request& request, Session& session, Respond respond) {
  respond = [&state, answer = std::move(respond)](Outcome outcome) {
    if (!outcome) ++state.requests.failed[outcome.error().name];
    answer(std::move(outcome));
  };
  const auto found = std::ranges::lower_bound(kMethods, request.method, {}, &RpcMethod::name);
  if (found != kMethods.end() && found->name == request.method) {
    if (session.role() < found->role) return respond(tl::unexpected(not_for(session, *found)));
    if (would_disturb(state, *found, request.params, session))
      return respond(tl::unexpected(rpc_error(
          {ErrorCode::kBusy, "a calibration is under way: wait until it ends, or cancel it (calibrate)", {}})));
    const bool is_look = request.method == "calibrate" && request.params.value("action", json("look")) == "look";
    const bool is_own = state.calibration && session.peer().process == state.calibration->process();
    if (found->role == Role::kAdminister && !is_look && !is_own)
      spdlog::info("{}: by user {} (process {})", found->name, session.peer().user, session.peer().process);
    ++state.requests.by_method[found->name];
    return found->run(state, request.params, session, std::move(respond));
  }
  std::vector<std::string> names;
  for (const RpcMethod& method : kMethods) names.emplace_back(method.name);
  respond(tl::unexpected(method_not_found("no such method: \"" + printable(request.method, 64) + "\"" +
                                          nearest_hint(request.method, names))));
}

}  // namespace slsd
