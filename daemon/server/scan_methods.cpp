// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/scan_methods.hpp"

#include <asio/post.hpp>

#include "daemon/rpc/message.hpp"
#include "daemon/rpc/param_reader.hpp"
#include "daemon/server/scan_json.hpp"
#include "daemon/server/sealed_memory.hpp"
#include "daemon/server/settings_json.hpp"

namespace slsd {
namespace {

using nlohmann::json;

MonotonicTime deadline_in(int timeout_ms) {
  return std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
}

int read_timeout(ParamReader& reader, const ServiceState& state) {
  return reader.integer("timeout_ms", state.configuration.scan.timeout_ms, 1, kMaxTimeoutMs);
}

SharedBytes share(std::string bytes) {
  return std::make_shared<const std::string>(std::move(bytes));
}

// An answer of the scanner's thread, made into a reply there and carried to the event loop's.
template <class Value, class MakeReply>
Scanner::Answer<Value> carry(ServiceState& state, Respond respond, MakeReply make_reply) {
  return [&events = state.events, respond = std::move(respond), make_reply](Result<Value> value) {
    auto outcome = std::make_shared<Outcome>(value ? make_reply(*value) : tl::unexpected(rpc_error(value.error())));
    asio::post(events, [respond, outcome] { respond(std::move(*outcome)); });
  };
}

// As carry(); the reply tells how long after the last byte of its frames it was handed to the socket.
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
  params["light"] = to_string(frame.light);
  params["format"] = coding == FrameCoding::kPng ? "png" : "raw";
  params["bytes"] = event.bytes->size();
  event.line = to_line(event_message("frame", std::move(params)));
  return event;
}

Outcome scan_reply(const ScanResult& scan, CloudFormat format, bool as_memfd, FrameCoding frames) {
  Reply reply{scan_json(scan)};
  reply.result["format"] = to_string(format);
  CloudFiles files = scan.files;
  const SharedBytes cloud = files.file(scan.cloud, format);
  if (as_memfd) {
    auto memory = sealed_memory(*cloud);
    if (!memory) return tl::unexpected(rpc_error(memory.error()));
    reply.result["memfd_bytes"] = cloud->size();
    reply.descriptor = std::move(*memory);
  } else {
    reply.result["bytes"] = cloud->size();
    reply.bytes = cloud;
  }
  if (!scan.picture_png.empty()) reply.first.push_back(picture_event(scan));
  for (const FrameImage& frame : scan.frames) reply.first.push_back(frame_event(scan.cloud.scan_id, frame, frames));
  return reply;
}

Outcome image_reply(std::string bytes, json result) {
  Reply reply{std::move(result)};
  reply.result["bytes"] = bytes.size();
  reply.bytes = share(std::move(bytes));
  return reply;
}

}  // namespace

void run_scan(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const CloudFormat format = cloud_format(reader.choice("format", {"ply", "pcd"}));
  const bool as_memfd = reader.choice("transport", {"inline", "memfd"}) == "memfd";
  const int timeout_ms = read_timeout(reader, state);
  const bool picture = reader.boolean("picture", false);
  const FrameCoding frames = frame_coding(reader.choice("frames", {"none", "raw", "png"}));
  const std::string camera = reader.text("camera");
  const bool texture = reader.boolean("texture", false);
  const bool ambient = reader.boolean("ambient", false);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.scan({deadline_in(timeout_ms), picture, camera, frames, texture, ambient, CloudFormats::only(format)},
                     carry_scan(state, std::move(respond), [format, as_memfd, frames](const ScanResult& scan) {
                       return scan_reply(scan, format, as_memfd, frames);
                     }));
}

void run_settings(ServiceState& state, const json& params, Session&, Respond respond) {
  const ParamReader reader(params);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  const ScanFiles files = state.scanner.setup()->files();
  Reply reply{settings_json(state.configuration)};
  reply.result["pattern"] = files.pattern;
  reply.result["calibration"] = files.calibration;
  respond(std::move(reply));
}

void run_preview(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const int timeout_ms = read_timeout(reader, state);
  const std::string camera = reader.text("camera");
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.scan({deadline_in(timeout_ms), true, camera},
                     carry_scan(state, std::move(respond), [](const ScanResult& scan) -> Outcome {
                       json result = scan_json(scan);
                       result["format"] = "png";
                       return image_reply(scan.picture_png, std::move(result));
                     }));
}

void run_frame(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const std::string format = reader.choice("format", {"png", "raw"});
  const int timeout_ms = read_timeout(reader, state);
  const std::string camera = reader.text("camera");
  const bool as_shown = reader.boolean("as_shown", false);
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.frame({deadline_in(timeout_ms), camera, format == "png", as_shown},
                      carry<FrameImage>(state, std::move(respond), [format](const FrameImage& image) {
                        json result = frame_json(image);
                        result["format"] = format;
                        return image_reply(image.bytes, std::move(result));
                      }));
}

void run_pattern(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  (void)reader.choice("format", {"png"});
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.pattern(carry<std::string>(state, std::move(respond), [](const std::string& png) {
    return image_reply(png, {{"format", "png"}});
  }));
}

}  // namespace slsd
