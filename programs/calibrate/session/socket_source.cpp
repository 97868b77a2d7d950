// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/session/socket_source.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

#include "core/base64.hpp"
#include "drivers/files/encode_png.hpp"
#include "rpc/request.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr int kTimeoutMs = 10'000;  // network cameras take seconds to open
constexpr auto kTimeout = 30s;
constexpr auto kLatency = 200ms;  // covers the image processing of unmeasured projectors

/// Converts the service's error to ours, by its name.
Error error_of(const json& told) {
  const std::string name = told.value("/data/name"_json_pointer, std::string());
  ErrorCode code = ErrorCode::kIo;
  for (int i = 0; i <= static_cast<int>(ErrorCode::kFrameSkewed); ++i) {
    if (to_string(static_cast<ErrorCode>(i)) == name) code = static_cast<ErrorCode>(i);
  }
  return {code, told.value("message", "the service gave no reason"),
          told.value("/data/where"_json_pointer, std::string())};
}

}  // namespace

Result<std::unique_ptr<SocketSource>> SocketSource::create(const std::filesystem::path& socket) {
  auto connection = Connection::open(socket);
  if (!connection) return tl::unexpected(connection.error());
  connection->set_timeout(kTimeout);
  std::unique_ptr<SocketSource> source(new SocketSource(std::move(*connection)));
  if (auto learnt = source->learn(); !learnt) return tl::unexpected(learnt.error());
  return source;
}

Result<Received> SocketSource::ask(std::string_view method, const json& params) {
  auto answered = connection_.call(method, params);
  if (!answered) return tl::unexpected(answered.error());
  const json& message = answered->reply.message;
  if (message.contains("error")) return tl::unexpected(error_of(message["error"]));
  return std::move(answered->reply);
}

Result<> SocketSource::learn() {
  const auto settings = ask("settings", json::object());
  if (!settings) return tl::unexpected(settings.error());
  const auto status = ask("status", json::object());
  if (!status) return tl::unexpected(status.error());
  const json &set = settings->message["result"], &is = status->message["result"];
  projector_ = {set["projector"].value("width_px", 0), set["projector"].value("height_px", 0)};
  pattern_ = set.value("pattern", "");
  calibration_ = is.value("calibration", "");
  status_.projector.hardware = is["projector"].value("hardware", "");
  for (const json& camera : is["cameras"]) {
    names_.push_back(camera.value("name", ""));
    status_.cameras.emplace_back();
    status_.cameras.back().name = names_.back();
    status_.cameras.back().hardware = camera.value("hardware", "");
  }
  wanted_ = Grey8(projector_.width_px, projector_.height_px, 0);
  return names_.empty() ? fail(ErrorCode::kNotFound, "no camera is configured: add a [[camera]] table") : Result<>();
}

void SocketSource::show(const Grey8& image) {
  if (wanted_ == image) return;
  wanted_ = image;
  shown_ = false;
  (void)show_now();  // if this fails, the next grab() tries again and reports it
}

Result<> SocketSource::show_now() {
  if (shown_) return {};
  const auto is_all = [this](std::uint8_t level) {
    return std::all_of(wanted_.data(), wanted_.data() + wanted_.size(), [level](auto each) { return each == level; });
  };
  json params{{"timeout_ms", kTimeoutMs}, {"picture", is_all(255) ? "white" : is_all(0) ? "black" : "image"}};
  if (params["picture"] == "image") {
    const auto png = encode_png(wanted_);
    if (!png) return tl::unexpected(png.error());
    params["png"] = to_base64(*png);
  }
  const auto shown = ask("project", params);
  if (!shown) return tl::unexpected(shown.error());
  shown_ = true;
  std::this_thread::sleep_for(kLatency);
  return {};
}

Result<std::vector<GreyImage>> SocketSource::grab() {
  if (auto shown = show_now(); !shown) return tl::unexpected(shown.error());
  std::vector<GreyImage> pictures;
  for (const std::string& name : names_) {
    const auto frame =
        ask("frame", {{"camera", name}, {"format", "raw"}, {"as_shown", true}, {"timeout_ms", kTimeoutMs}});
    if (!frame) {
      shown_ = false;  // after a failure of the service, its picture is uncertain
      return tl::unexpected(frame.error());
    }
    const auto image = frame->image(frame->message["result"]);
    if (!image) return tl::unexpected(image.error());
    pictures.push_back(copy_of(*image));
  }
  return pictures;
}

}  // namespace slsd
