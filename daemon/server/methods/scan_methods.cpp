// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <asio/post.hpp>

#include "core/cloud/dense_file.hpp"
#include "core/geometry/robot_pose.hpp"
#include "daemon/server/methods/answer.hpp"
#include "daemon/server/methods/methods_by_kind.hpp"
#include "daemon/server/methods/scan_json.hpp"
#include "rpc/message.hpp"
#include "rpc/param_reader.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr double kRateMinHz = 0.001;
constexpr double kRateMaxHz = 1000.0;

// Like carry(); the reply also reports the time from the last byte of its frames to the socket.
template <class MakeReply>
Scanner::Answer<ScanResult> carry_scan(ServiceState& state, Respond respond, MakeReply make_reply) {
  return [&state, respond = std::move(respond), make_reply](const Result<ScanResult>& scan) {
    const auto outcome = outcome_of(scan, make_reply);
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
    const std::size_t record = form.format == CloudFormat::kPcd ? dense_pcd_bytes(form.normals, request.colour)
                                                                : dense_ply_bytes(form.normals, request.colour);
    const std::size_t a_pixel = form.format == CloudFormat::kTiff ? 8U : record;
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

enum class Delivery { kOnce, kStream };

bool on_arm(const ScanSetup& setup) {
  return setup.hand_eye && setup.hand_eye->mounted == Mounted::kArm;
}

// The form of cloud that a request asks for; without a density or frame, the configured one. No poses come with a
// stream, so that of a scanner on the arm is in the rig's frame.
CoordinateFrame read_frame(ParamReader& reader, const char* name, CoordinateFrame otherwise) {
  const std::string frame = otherwise == CoordinateFrame::kRobotBase ? reader.choice(name, {"robot_base", "rig"})
                                                                     : reader.choice(name, {"rig", "robot_base"});
  return frame == "robot_base" ? CoordinateFrame::kRobotBase : CoordinateFrame::kRig;
}

CloudForm read_form(ParamReader& reader, const ServiceState& state, Delivery delivery) {
  CloudForm form(cloud_format(reader.choice("format", {"ply", "pcd", "tiff"})));
  const bool pixels = state.configuration.decode.density == Density::kPixels;
  const std::string density =
      pixels ? reader.choice("density", {"pixels", "symbols"}) : reader.choice("density", {"symbols", "pixels"});
  form.density = density == "pixels" ? Density::kPixels : Density::kSymbols;
  form.normals = reader.boolean("normals", false);
  const bool base = state.configuration.frame.output == CoordinateFrame::kRobotBase &&
                    (delivery == Delivery::kOnce || !on_arm(*state.scanner.setup()));
  const auto frame = read_frame(reader, "coordinate_frame", base ? CoordinateFrame::kRobotBase : CoordinateFrame::kRig);
  form.in_base = frame == CoordinateFrame::kRobotBase && form.format != CloudFormat::kTiff;
  return form;
}

// The robot's pose as its controller writes it.
struct AskedPose {
  std::vector<double> numbers;  ///< empty: none
  std::string notation;
};

AskedPose read_asked_pose(ParamReader& reader) {
  constexpr NumberList kPose{.count_min = 1, .count_max = 16, .low = -1e9, .high = 1e9};
  std::vector<double> numbers = reader.numbers("robot_pose", kPose).value_or(std::vector<double>());
  return {std::move(numbers), reader.text("poses")};
}

// What a request wants in the robot's base.
struct WantedInBase {
  bool cloud, part;

  [[nodiscard]] bool any() const { return cloud || part; }
  /// The parameter that says otherwise.
  [[nodiscard]] std::string_view remedy() const {
    return cloud ? "\"coordinate_frame\": \"rig\"" : "\"box_frame\": \"rig\"";
  }
};

// Refuses a frame that is not possible, and a pose that is missing or useless.
std::optional<RpcError> refused_frame(WantedInBase wanted, const AskedPose& pose, const ScanSetup& setup,
                                      Delivery delivery) {
  const bool given = !pose.numbers.empty();
  if (!wanted.any() && given) {
    return invalid_params(
        "\"robot_pose\" is for points or a box in the robot's base: leave it out, or ask for \"coordinate_frame\": "
        "\"robot_base\"");
  }
  if (!wanted.any()) return std::nullopt;
  if (auto possible = setup.check_robot_base(); !possible) return rpc_error(possible.error());
  if (!on_arm(setup) && given)
    return invalid_params("the scanner stands in the cell, where no pose moves it: leave \"robot_pose\" out");
  if (!on_arm(setup) || given) return std::nullopt;
  if (delivery == Delivery::kStream) {
    return invalid_params(fmt::format(
        "the scanner is on the robot's arm, and no poses come with a stream: {} {}, or scan at each place with "
        "\"robot_pose\"",
        wanted.cloud ? "ask for" : "[cloud] box and plane are in the robot's base; set them with", wanted.remedy()));
  }
  return invalid_params(
      fmt::format("the scanner is on the robot's arm: add the robot's pose as \"robot_pose\" and \"poses\", or ask for "
                  "{}",
                  wanted.remedy()));
}

tl::expected<RigidTransform, RpcError> pose_of(const AskedPose& asked) {
  if (asked.notation.empty()) {
    return tl::unexpected(invalid_params(fmt::format("\"robot_pose\" needs \"poses\", how the robot writes them: {}",
                                                     fmt::join(pose_notation_names(), ", "))));
  }
  const auto notation = pose_notation(asked.notation);
  if (!notation) return tl::unexpected(invalid_params("\"poses\" " + notation.error().message));
  const auto pose = read_robot_pose(asked.numbers, *notation);
  if (!pose) return tl::unexpected(invalid_params("\"robot_pose\" " + pose.error().message));
  if (const auto reached = check_reach(*pose); !reached)
    return tl::unexpected(invalid_params(fmt::format("\"robot_pose\" {}: in \"{}\" it has {}", reached.error().message,
                                                     asked.notation, describe(*notation))));
  return *pose;
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
  add_frame(reply.result, files.base_from_rig(form));
  if (as_memfd) {
    auto memory = files.memory(scan.cloud, scan.dense.get(), form);
    if (!memory) return tl::unexpected(rpc_error(memory.error()));
    reply.result["memfd_bytes"] = memory->bytes;
    reply.memory = std::move(*memory);
  } else {
    reply.bytes = files.file(scan.cloud, scan.dense.get(), form);
    reply.result["bytes"] = reply.bytes->size();
  }
  if (!scan.picture_png.empty()) reply.first.push_back(picture_event(scan));
  for (const FrameImage& frame : scan.frames) reply.first.push_back(frame_event(scan.cloud.scan_id, frame, frames));
  return reply;
}

// The part of the cloud that a request asks for; what it does not name is as configured.
CloudOptions read_part(ParamReader& reader, const ServiceState& state) {
  constexpr NumberList kBox{.count_min = 0, .count_max = 6, .low = -1e6, .high = 1e6};
  CloudOptions part = state.configuration.cloud;
  constexpr NumberList kPlane{.count_min = 0, .count_max = 4, .low = -1e6, .high = 1e6};
  part.box = reader.numbers("box", kBox).value_or(part.box);
  part.plane = reader.numbers("plane", kPlane).value_or(part.plane);
  part.box_frame = read_frame(reader, "box_frame", part.box_frame);
  part.voxel_mm = reader.number("voxel_mm", 0, 1000).value_or(part.voxel_mm);
  part.stride = reader.integer("stride", part.stride, 1, 64);
  return part;
}

// A request for a scan, read from its parameters.
struct AskedScan {
  CloudForm form;
  bool as_memfd;
  FrameCoding frames;
  ScanRequest request;
  std::string preset;  ///< empty: the settings in force
  bool skips = false;  ///< leaves out rows and columns, by its own parameter
};

tl::expected<AskedScan, RpcError> read_scan(const json& params, const ServiceState& state, const Session& session) {
  ParamReader reader(params);
  AskedScan asked;
  asked.form = read_form(reader, state, Delivery::kOnce);
  const AskedPose pose = read_asked_pose(reader);
  asked.as_memfd = reader.choice("transport", {"inline", "memfd"}) == "memfd";
  asked.request.deadline = deadline_in(read_timeout(reader, state));
  asked.request.picture = reader.boolean("picture", false);
  asked.request.why = reader.boolean("why", false);
  asked.request.frames = asked.frames = frame_coding(reader.choice("frames", {"none", "raw", "png"}));
  asked.request.camera = reader.text("camera");
  asked.request.colour = reader.boolean("colour", false);
  asked.request.texture = reader.boolean("texture", asked.request.colour);
  asked.request.ambient = reader.boolean("ambient", false);
  asked.request.formats = asked.as_memfd ? CloudFormats::only_memory(asked.form) : CloudFormats::only(asked.form);
  asked.request.gone = session.gone();
  asked.preset = reader.text("preset");
  const CloudOptions part = read_part(reader, state);
  if (auto error = reader.error()) return tl::unexpected(*error);
  asked.skips = params.contains("stride") && part.stride > 1;
  if (asked.request.colour && !asked.request.texture)
    return tl::unexpected(
        invalid_params("\"colour\" comes from the frame of \"texture\": leave out \"texture\": false"));
  if (auto valid = part.validate(); !valid)
    return tl::unexpected(invalid_params("\"" + valid.error().where + "\" " + valid.error().message));
  const WantedInBase in_base{asked.form.in_base, part.in_base()};
  if (auto refused = refused_frame(in_base, pose, *state.scanner.setup(), Delivery::kOnce))
    return tl::unexpected(*refused);
  if (pose.numbers.empty() && !pose.notation.empty())
    return tl::unexpected(
        invalid_params("\"poses\" tells how the robot writes \"robot_pose\": add that, or leave both out"));
  if (!pose.numbers.empty()) {
    const auto base_from_flange = pose_of(pose);
    if (!base_from_flange) return tl::unexpected(base_from_flange.error());
    asked.request.base_from_flange = *base_from_flange;
  }
  asked.request.part = part;
  return asked;
}

// Keeps others from changing the settings while a scan with a preset is under way.
class PresetHold {
 public:
  explicit PresetHold(std::shared_ptr<std::atomic<int>> count) : count_(std::move(count)) { ++*count_; }
  ~PresetHold() { release(); }
  PresetHold(const PresetHold&) = delete;
  PresetHold& operator=(const PresetHold&) = delete;
  void release() {
    if (const auto count = std::exchange(count_, nullptr)) --*count;
  }

 private:
  std::shared_ptr<std::atomic<int>> count_;
};

void start_scan(ServiceState& state, const AskedScan& asked, Session& session, Respond respond) {
  if (auto refused = refused_form(asked.form)) return respond(tl::unexpected(*refused));
  if (asked.skips && !asked.form.dense())
    return respond(tl::unexpected(invalid_params("\"stride\" above 1 needs \"density\": \"pixels\"")));
  if (auto refused = session.reserve(expected_bytes(state, asked.request, asked.form)))
    return respond(tl::unexpected(*refused));
  state.scanner.scan(asked.request, carry_scan(state, std::move(respond), [asked](const ScanResult& scan) {
                       auto outcome = scan_reply(scan, asked.form, asked.as_memfd, asked.frames, asked.request.why);
                       if (outcome && !asked.preset.empty()) outcome->result["preset"] = asked.preset;
                       return outcome;
                     }));
}

}  // namespace

void run_scan(ServiceState& state, const json& params, Session& session, Respond respond) {
  auto asked = read_scan(params, state, session);
  if (!asked) return respond(tl::unexpected(asked.error()));
  if (asked->preset.empty()) return start_scan(state, *asked, session, std::move(respond));
  auto settings = find_preset(state, asked->preset);
  if (!settings) return respond(tl::unexpected(rpc_error(settings.error())));
  // The scan begins in the same turn of the event loop as its settings come into force: no other comes between.
  const auto scan = [&state, params, asked = *asked, waiting = session.shared_from_this()](Respond answer) {
    auto again = read_scan(params, state, *waiting);  // by the preset's density
    if (!again) return answer(tl::unexpected(again.error()));
    again->request.deadline = asked.request.deadline;
    const auto hold = std::make_shared<PresetHold>(state.preset_scans);
    start_scan(state, *again, *waiting, [hold, answer = std::move(answer)](Outcome outcome) {
      hold->release();
      answer(std::move(outcome));
    });
  };
  if (*settings == state.settings) return scan(std::move(respond));
  use_settings(state, std::move(*settings), [scan, respond = std::move(respond)](Outcome outcome) {
    outcome ? scan(respond) : respond(std::move(outcome));
  });
}

void run_preview(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const int timeout_ms = read_timeout(reader, state);
  const std::string camera = reader.text("camera");
  const bool why = reader.boolean("why", false);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  ScanRequest request{deadline_in(timeout_ms), true, camera};
  request.why = why;
  request.part = CloudOptions();  // a picture shows all symbols, and needs no place in the robot's base
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

void run_subscribe(ServiceState& state, const json& params, Session& session, Respond respond) {
  ParamReader reader(params);
  const CloudForm form = read_form(reader, state, Delivery::kStream);
  const bool as_memfd = reader.choice("transport", {"inline", "memfd"}) == "memfd";
  const std::optional<double> rate_hz = reader.number("rate_hz", kRateMinHz, kRateMaxHz);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  if (auto refused = refused_form(form)) return respond(tl::unexpected(*refused));
  if (auto refused = refused_frame({form.in_base, state.configuration.cloud.in_base()}, {}, *state.scanner.setup(),
                                   Delivery::kStream))
    return respond(tl::unexpected(*refused));
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

}  // namespace slsd
