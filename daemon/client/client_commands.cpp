// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/client/client_commands.hpp"

#include <iostream>

#include "core/cloud/pcd.hpp"
#include "core/cloud/ply.hpp"
#include "core/printable.hpp"
#include "daemon/client/connection.hpp"
#include "daemon/client/report.hpp"
#include "daemon/rpc/base64.hpp"
#include "daemon/rpc/message.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "picture/render_cloud.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t kMaxImageBytes = 64 << 20;

// A file that cannot be written is a failed request, and never a daemon that is not there.
tl::expected<void, Failure> write(const path& file, std::string_view bytes) {
  if (auto written = write_file_atomically(file, bytes); !written) {
    return tl::unexpected(Failure{kRequestFailed, rpc_error(written.error())});
  }
  return {};
}

tl::expected<void, Failure> write_cloud_picture(const path& file, const std::string& ply) {
  const auto cloud = read_ply(ply, "the daemon's cloud");
  if (!cloud) return tl::unexpected(failure(cloud.error()));
  const auto png = encode_png(render_cloud(*cloud));
  if (!png) return tl::unexpected(failure(png.error()));
  return write(file, *png);
}

// The cloud's picture is drawn from a PLY; a PCD is then made of it here.
tl::expected<void, Failure> write_cloud_file(const ClientOptions& options, const std::string& bytes, bool as_ply) {
  if (options.output.empty()) return {};
  if (!as_ply || options.output.extension() == ".ply") return write(options.output, bytes);
  const auto cloud = read_ply(bytes, "the daemon's cloud");
  if (!cloud) return tl::unexpected(failure(cloud.error()));
  return write(options.output, write_pcd(*cloud));
}

tl::expected<void, Failure> write_files(const ClientOptions& options, const Answered& answered, bool as_ply) {
  auto written = write_cloud_file(options, answered.reply.bytes, as_ply);
  if (written && !options.cloud_picture.empty()) {
    written = write_cloud_picture(options.cloud_picture, answered.reply.bytes);
  }
  for (const Received& event : answered.events) {
    const bool picture = event.message.value("method", "") == "picture";
    if (written && picture && !options.picture.empty()) written = write(options.picture, event.bytes);
  }
  return written;
}

int print_event(const ClientOptions& options, const json& event) {
  const json params = event.value("params", json::object());
  if (options.json) {
    std::cout << to_line(event) << std::flush;
  } else if (event.value("method", "") == "cloud") {
    std::cout << scan_line(params) << ", " << params.value("lost", 0) << " lost\n" << std::flush;
  } else if (params.contains("error")) {
    std::cout << "scan failed: " << printable(params["error"].value("message", "")) << "\n" << std::flush;
  }
  return event.value("method", "") == "cloud" ? 1 : 0;
}

}  // namespace

int scan_command(const ClientOptions& options) {
  const bool as_ply = options.output.extension() != ".pcd" || !options.cloud_picture.empty();
  json params{{"format", as_ply ? "ply" : "pcd"}, {"picture", !options.picture.empty()}};
  if (options.texture) params["texture"] = true;
  if (options.ambient) params["ambient"] = true;
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  const auto answered = ask(options, "scan", std::move(params));
  if (!answered) return report(options, answered.error());
  if (auto written = write_files(options, *answered, as_ply); !written) return report(options, written.error());
  const json& result = answered->reply.message["result"];
  std::cout << (options.json ? to_line(result) : scan_line(result) + "\n");
  return kDone;
}

int status_command(const ClientOptions& options) {
  const auto answered = ask(options, "status", json::object());
  if (!answered) return report(options, answered.error());
  const json& result = answered->reply.message["result"];
  std::cout << (options.json ? to_line(result) : status_table(result));
  return kDone;
}

int watch_command(const ClientOptions& options) {
  auto connection = Connection::open(options.socket);
  if (!connection) return report(options, failure(connection.error()));
  json params{{"format", "ply"}};
  if (options.rate_hz) params["rate_hz"] = *options.rate_hz;
  const auto answered = ask(*connection, "subscribe", std::move(params));
  if (!answered) return report(options, answered.error());
  std::uint64_t clouds = 0;
  while (options.count == 0 || clouds < options.count) {
    const auto event = connection->receive();
    if (!event) return report(options, failure(event.error()));
    clouds += static_cast<std::uint64_t>(print_event(options, event->message));
    if (!std::cout) return kRequestFailed;
  }
  return kDone;
}

int image_command(const ClientOptions& options, const std::string& method) {
  json params = json::object();
  if (options.timeout_ms && method != "pattern") params["timeout_ms"] = *options.timeout_ms;
  if (options.as_shown) params["as_shown"] = true;
  const auto answered = ask(options, method, std::move(params));
  if (!answered) return report(options, answered.error());
  if (auto written = write(options.image, answered->reply.bytes); !written) return report(options, written.error());
  const json& result = answered->reply.message["result"];
  if (options.json) std::cout << to_line(result);
  return kDone;
}

int project_command(const ClientOptions& options) {
  json params{{"picture", options.picture.string()}};
  if (options.picture.extension() == ".png") {
    const auto image = read_file(options.picture, kMaxImageBytes);
    if (!image) return report(options, Failure{kRequestFailed, rpc_error(image.error())});
    params = {{"picture", "image"}, {"png", to_base64(*image)}};
  }
  if (options.timeout_ms) params["timeout_ms"] = *options.timeout_ms;
  const auto answered = ask(options, "project", std::move(params));
  if (!answered) return report(options, answered.error());
  if (options.json) std::cout << to_line(answered->reply.message["result"]);
  return kDone;
}

}  // namespace slsd
