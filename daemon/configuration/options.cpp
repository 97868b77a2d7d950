// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/printable.hpp"
#include "daemon/configuration/access.hpp"
#include "daemon/configuration/black_box_options.hpp"
#include "daemon/configuration/camera_options.hpp"
#include "daemon/configuration/frame_options.hpp"
#include "daemon/configuration/projector_options.hpp"
#include "daemon/configuration/scan_options.hpp"
#include "daemon/configuration/server_options.hpp"
#include "drivers/system/state_folder.hpp"

namespace slsd {
namespace {

constexpr double kExposureRatioMin = 1.5, kExposureRatioMax = 100;
constexpr int kFramesOfAScan = 6;  // two exposures of the pattern, of white and of black

Result<> in_range(const char* key, std::int64_t value, std::int64_t low, std::int64_t high) {
  if (value >= low && value <= high) return {};
  return fail(ErrorCode::kInvalidArgument, std::string(key) + " must be " + std::to_string(low) + " to " +
                                               std::to_string(high) + ", not " + std::to_string(value));
}

tl::unexpected<Error> refuse_exposures(std::string_view why) {
  return fail(ErrorCode::kInvalidArgument, "exposures_us " + std::string(why));
}

Result<> check_exposures(const CameraOptions& camera) {
  const std::vector<double>& exposures_us = camera.exposures_us;
  if (exposures_us.empty()) return {};
  if (!camera.measures())
    return refuse_exposures("is for cameras that measure points: with use = \"texture\", set exposure_us");
  if (exposures_us.size() != 2) return refuse_exposures("must be two exposures, as in [2000, 8000]");
  const double shorter = exposures_us[0], longer = exposures_us[1];
  if (!(shorter >= 1 && longer <= 1e6)) return refuse_exposures("must be 1 to 1000000");
  if (!(longer >= kExposureRatioMin * shorter && longer <= kExposureRatioMax * shorter))
    return refuse_exposures("must be the shorter first, then one that is 1.5 to 100 times as long");
  const auto* const v4l2 = std::get_if<V4l2CameraOptions>(&camera.of_driver);
  if (v4l2 != nullptr && v4l2->automatic) return refuse_exposures("cannot be set while automatic is true");
  const int held_max = std::visit([](const auto& options) { return options.frames_held_max; }, camera.of_driver);
  if (held_max < kFramesOfAScan)
    return refuse_exposures("needs frames_held_max of " + std::to_string(kFramesOfAScan) + " or more");
  return {};
}

constexpr double kGainMin = 0.1, kGainMax = 10;

Result<> check_white_balance(const ColourGains& gains) {
  for (const double gain : gains)
    if (!(gain >= kGainMin && gain <= kGainMax))
      return fail(ErrorCode::kInvalidArgument, "white_balance must be three factors of 0.1 to 10, as in [1.6, 1, 1.9]");
  return {};
}

}  // namespace

const std::string& CameraOptions::name() const {
  return std::visit([](const auto& options) -> const std::string& { return options.name; }, of_driver);
}

std::string_view CameraOptions::driver() const {
  return std::visit([](const auto& options) { return options.kDriver; }, of_driver);
}

std::optional<double> CameraOptions::exposure_us() const {
  return std::visit(Overloaded{[](const FileCameraOptions&) { return std::optional<double>(); },
                               [](const auto& options) { return std::optional<double>(options.exposure_us); }},
                    of_driver);
}

void CameraOptions::set_exposures(std::vector<double> given_us) {
  if (given_us.empty()) return;
  exposures_us = std::move(given_us);
  std::visit(Overloaded{[&](FileCameraOptions& options) { options.exposures_us = exposures_us; },
                        [&](auto& options) { options.exposure_us = exposures_us.front(); }},
             of_driver);
}

std::optional<double> CameraOptions::gain_db() const {
  return std::visit(Overloaded{[](const FileCameraOptions&) { return std::optional<double>(); },
                               [](const auto& options) { return std::optional<double>(options.gain_db); }},
                    of_driver);
}

std::string CameraOptions::format() const {
  return std::visit(Overloaded{[](const FileCameraOptions&) { return std::string(); },
                               [](const V4l2CameraOptions& options) { return options.format; },
                               [](const AravisCameraOptions& options) { return options.pixel_format; }},
                    of_driver);
}

Result<> CameraOptions::validate() const {
  if (name().empty() || name().size() > 64 || printable(name()) != name()) {
    return fail(ErrorCode::kInvalidArgument, "name must have 1 to 64 bytes of UTF-8, without control characters");
  }
  const auto* const file = std::get_if<FileCameraOptions>(&of_driver);
  if (file != nullptr && file->path.empty()) {
    return fail(ErrorCode::kInvalidArgument, "path must name an image or a folder of images for the driver \"file\"");
  }
  if (auto valid = check_exposures(*this); !valid) return valid;
  if (auto valid = check_white_balance(white_balance); !valid) return valid;
  return std::visit([](const auto& options) { return options.validate(); }, of_driver);
}

std::string_view to_string(ProjectorDriver driver) {
  return driver == ProjectorDriver::kHeadless ? "headless" : "glfw";
}

Result<> ProjectorOptions::validate() const {
  if (auto valid = in_range("width_px", width_px, 640, 3840); !valid) return valid;
  if (auto valid = in_range("height_px", height_px, 360, 2160); !valid) return valid;
  if (auto valid = light.validate(); !valid) return valid;
  if (auto valid = in_range("idle_after_ms", idle_after_ms, 0, 3'600'000); !valid) return valid;
  if (refresh_hz == 0 || (refresh_hz >= 10 && refresh_hz <= 1000)) return {};
  return fail(ErrorCode::kInvalidArgument, "refresh_hz must be 10 to 1000, or 0 for a projector with steady light");
}

Result<> FrameOptions::validate() const {
  if (output == CoordinateFrame::kRig || !hand_eye.empty()) return {};
  return fail(ErrorCode::kInvalidArgument,
              "output = \"robot_base\" needs hand_eye, the file that slsctl hand-eye writes: set it in this table");
}

Result<> ScanOptions::validate() const {
  if (auto valid = in_range("timeout_ms", timeout_ms, 1, kMaxTimeoutMs); !valid) return valid;
  if (auto valid = in_range("exposure_skew_ms", exposure_skew_ms, 0, 10'000); !valid) return valid;
  if (auto valid = in_range("reopen_first_ms", reopen_first_ms, 1, 60'000); !valid) return valid;
  if (auto valid = in_range("reopen_longest_ms", reopen_longest_ms, reopen_first_ms, 600'000); !valid) return valid;
  if (!(projector_latency_ms >= 0 && projector_latency_ms <= 1000)) {
    return fail(ErrorCode::kInvalidArgument, "projector_latency_ms must be 0 to 1000");
  }
  if (power_line_hz == 0 || power_line_hz == 50 || power_line_hz == 60) return {};
  return fail(ErrorCode::kInvalidArgument, "power_line_hz must be 50, 60, or 0 if no lamps are near");
}

std::filesystem::path BlackBoxOptions::bundles() const {
  if (!folder.empty()) return folder;
  const std::filesystem::path state = state_folder();
  return state.empty() ? state : state / "bundles";
}

Result<> BlackBoxOptions::validate() const {
  if (auto valid = in_range("memory_max_mb", memory_max_mb, 0, 512); !valid) return valid;
  return in_range("disk_max_mb", disk_max_mb, 0, 65'536);
}

Result<> ServerOptions::validate() const {
  const std::size_t length = socket.string().size();
  if (length == 0 || length > kMaxSocketPath) {
    return fail(ErrorCode::kInvalidArgument, "socket must be a path of 1 to " + std::to_string(kMaxSocketPath) +
                                                 " bytes, not " + std::to_string(length) + ": choose a shorter one");
  }
  if (auto valid = in_range("socket_mode", socket_mode, 0, 0777); !valid) return valid;
  if (auto valid = in_range("clients_max", clients_max, 1, 10'000); !valid) return valid;
  if (auto valid = in_range("request_bytes_max", request_bytes_max, 1024, 16 * 1024 * 1024); !valid) return valid;
  if (auto valid = in_range("memory_max_mb", memory_max_mb, 16, 65'536); !valid) return valid;
  if (auto valid = in_range("send_timeout_ms", send_timeout_ms, 100, 600'000); !valid) return valid;
  if (auto rules = AccessRules::of(*this); !rules) return tl::unexpected(rules.error());
  return {};
}

}  // namespace slsd
