// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/server/scan_methods.hpp"

#include <asio/post.hpp>

#include "daemon/rpc/message.hpp"
#include "daemon/rpc/param_reader.hpp"
#include "daemon/server/scan_json.hpp"
#include "daemon/server/sealed_memory.hpp"

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

Outgoing picture_event(const ScanResult& scan) {
  Outgoing event;
  event.kind = Outgoing::Kind::kEvent;
  event.bytes = share(scan.picture_png);
  event.line = to_line(
      event_message("picture", {{"scan", scan.cloud.scan_id}, {"format", "png"}, {"bytes", event.bytes->size()}}));
  return event;
}

Outcome scan_reply(const ScanResult& scan, CloudFormat format, bool as_memfd) {
  Reply reply{scan_json(scan)};
  reply.result["format"] = to_string(format);
  std::string cloud = write_cloud(scan.cloud, format);
  if (as_memfd) {
    auto memory = sealed_memory(cloud);
    if (!memory) return tl::unexpected(rpc_error(memory.error()));
    reply.result["memfd_bytes"] = cloud.size();
    reply.descriptor = std::move(*memory);
  } else {
    reply.result["bytes"] = cloud.size();
    reply.bytes = share(std::move(cloud));
  }
  if (!scan.picture_png.empty()) reply.first.push_back(picture_event(scan));
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
  const std::string camera = reader.text("camera");
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.scan({deadline_in(timeout_ms), picture, camera},
                     carry<ScanResult>(state, std::move(respond), [format, as_memfd](const ScanResult& scan) {
                       return scan_reply(scan, format, as_memfd);
                     }));
}

void run_preview(ServiceState& state, const json& params, Session&, Respond respond) {
  ParamReader reader(params);
  const int timeout_ms = read_timeout(reader, state);
  const std::string camera = reader.text("camera");
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.scan({deadline_in(timeout_ms), true, camera},
                     carry<ScanResult>(state, std::move(respond), [](const ScanResult& scan) {
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
  if (auto error = reader.error()) return respond(tl::unexpected(*error));
  state.scanner.frame(camera, format == "png", deadline_in(timeout_ms),
                      carry<FrameImage>(state, std::move(respond), [format](const FrameImage& image) {
                        return image_reply(image.bytes, {{"format", format},
                                                         {"width_px", image.width_px},
                                                         {"height_px", image.height_px},
                                                         {"bits", image.bits},
                                                         {"frame", image.sequence}});
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
