// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <thread>

#include <fmt/format.h>

#include "clients/connection/connection.hpp"
#include "core/calibrate/doubt/calibration_doubts.hpp"
#include "core/calibrate/doubt/frame_doubt.hpp"
#include "core/calibrate/watch/drift_watch.hpp"
#include "core/decode/symbols/symbol_warnings.hpp"
#include "core/dense/dense_mapper.hpp"
#include "core/dense/dense_outlook.hpp"
#include "core/duration.hpp"
#include "core/exposure/exposure_advice.hpp"
#include "core/exposure/light_levels.hpp"
#include "core/exposure/merge_exposures.hpp"
#include "core/image_size.hpp"
#include "core/printable.hpp"
#include "daemon/configuration/access.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/configuration/exposure_warnings.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "daemon/scan/rig/devices.hpp"
#include "daemon/scan/rig/hardware.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "daemon/server/listening_socket.hpp"
#include "drivers/files/file.hpp"
#include "drivers/projector/x11/choose_output.hpp"
#include "drivers/projector/x11/x_display.hpp"
#include "programs/commands/commands.hpp"
#include "programs/commands/device_list.hpp"
#include "programs/latency/latency_file.hpp"

namespace slsd {
namespace {

using nlohmann::json;
using std::filesystem::path;

constexpr std::size_t kMaxLatencyBytes = 1 << 20;
constexpr std::size_t kLongestProblem = 1000;
constexpr auto kOpenTime = std::chrono::seconds(30);
constexpr int kDenseRuns = 3;                  // the first run allocates buffers
constexpr std::size_t kCloudBytesAPixel = 31;  // 10 for the map and 21 for a PCD file

/// Prints findings, and remembers whether one prevents a scan.
class Findings {
 public:
  void good(const std::string& what) { std::cout << "ok       " << what << "\n"; }
  void warn(const std::string& what) { std::cout << "warning  " << what << "\n"; }
  void bad(const std::string& what) {
    std::cout << "error    " << what << "\n";
    scan_possible_ = false;
  }
  template <class T>
  bool note(const Result<T>& result, const std::string& what) {
    result ? good(what) : bad(what + ": " + to_string(result.error()));
    return result.has_value();
  }
  [[nodiscard]] bool scan_possible() const { return scan_possible_; }

 private:
  bool scan_possible_ = true;
};

/// The running service as a source of information: it holds the devices, so nobody else can open them.
class LiveService {
 public:
  /// Asks the service, and waits some seconds for devices that it is opening.
  /// @return nothing if no service answers at this socket
  /// @errors kPermissionDenied; kTimeout: no answer; kMalformed: not slsd
  static Result<std::optional<LiveService>> ask(const path& socket) {
    auto connection = Connection::open(socket);
    if (!connection && connection.error().code == ErrorCode::kNotFound) return std::nullopt;
    if (!connection) return tl::unexpected(connection.error());
    connection->set_timeout(kTimeout);
    const auto settings = result_of(connection->call("settings", json::object()), socket);
    if (!settings) return tl::unexpected(settings.error());
    const auto end = std::chrono::steady_clock::now() + kTimeout;
    while (true) {
      const auto status = result_of(connection->call("status", json::object()), socket);
      if (!status) return tl::unexpected(status.error());
      LiveService service(*status, *settings);
      if (!service.opens_devices() || std::chrono::steady_clock::now() > end) return service;
      std::this_thread::sleep_for(kPause);
    }
  }

  [[nodiscard]] path configuration_file() const { return status_.value("configuration", ""); }
  [[nodiscard]] bool serves(const path& file) const {
    std::error_code ignored;
    return std::filesystem::equivalent(configuration_file(), file, ignored);
  }
  /// The tables whose keys differ from those in force.
  [[nodiscard]] std::vector<std::string> tables_behind(const Configuration& configuration) const {
    const json in_force = settings_.value("configuration", json::object());
    const json differences = json::diff(in_force, configuration.given);
    std::vector<std::string> tables;
    for (const json& difference : differences) {
      const std::string place = difference.value("path", "/").substr(1);
      const std::string table = place.substr(0, place.find('/'));
      if (std::ranges::find(tables, table) == tables.end()) tables.push_back(table);
    }
    return tables;
  }
  /// The settings made over its socket, which override the file's.
  [[nodiscard]] Result<json> set() const {
    return merge_settings(json::object(), settings_.value("set", json::object()));
  }
  [[nodiscard]] json projector() const { return status_.value("projector", json::object()); }
  [[nodiscard]] json camera(const std::string& name) const {
    for (const json& camera : status_.value("cameras", json::array()))
      if (camera.value("name", "") == name) return camera;
    return json::object();
  }
  /// The reason why the last scan gave no points; empty: it gave some.
  [[nodiscard]] std::string why_empty() const {
    const json empty = status_.value("scans", json::object()).value("empty", json());
    return empty.is_string() ? printable(empty.get<std::string>(), kLongestProblem) : std::string();
  }
  [[nodiscard]] std::uint64_t log_lines_dropped() const { return status_.value("log_lines_dropped", std::uint64_t{0}); }

 private:
  static constexpr std::chrono::seconds kTimeout{10};
  static constexpr std::chrono::milliseconds kPause{100};

  LiveService(json status, json settings) : status_(std::move(status)), settings_(std::move(settings)) {}

  static Result<json> result_of(const Result<Answered>& answered, const path& socket) {
    if (!answered) return fail(answered.error().code, answered.error().message, socket.string());
    const json& message = answered->reply.message;
    if (message.contains("result") && message["result"].is_object()) return message["result"];
    return fail(ErrorCode::kMalformed, "the program at this socket is not slsd", socket.string());
  }

  [[nodiscard]] bool opens_devices() const {
    const auto opens = [](const json& device) { return device.value("state", "") == to_string(DeviceState::kOpening); };
    const json cameras = status_.value("cameras", json::array());
    return opens(projector()) || std::ranges::any_of(cameras, opens);
  }

  json status_;
  json settings_;
};

/// Checks what a scan needs, step by step.
class Check {
 public:
  Check(Configuration configuration, const path& file, Findings& findings)
      : configuration_(std::move(configuration)), file_(file), findings_(findings) {}

  void look() {
    look_for_service();
    const auto calibration = configured_calibration(configuration_);
    if (calibration) calibration_ = *calibration;
    check_projector();
    const auto pattern = configured_pattern(configuration_);
    findings_.note(pattern, "pattern");
    if (pattern) {
      pattern_ = *pattern;
      for (const std::string& warning :
           symbol_warnings(pattern->options, pattern_scale(calibration_, configuration_.decode)))
        findings_.warn(warning);
    }
    if (calibration && !calibration_) {
      findings_.bad("no calibration: calibrate, or set [calibration] file");
    } else {
      findings_.note(calibration, "calibration");
    }
    if (configuration_.cameras.empty()) findings_.bad("no camera: add a [[camera]] table to the configuration");
    for (const CameraOptions& camera : configuration_.cameras) check_camera(camera);
    for (const std::string& warning : exposure_warnings(configuration_)) findings_.warn(warning);
    if (pattern && calibration_) {
      const auto setup = ScanSetup::create(configuration_, 1);
      if (setup) {
        for (const std::string& doubt : setup->doubts) findings_.warn(doubt);
      }
      if (findings_.note(setup, "decoder")) check_dense(*setup);
    }
    check_latency();
    check_black_box();
  }

 private:
  // Asks a running service about its devices. If it does not answer, leaves its devices alone.
  void look_for_service() {
    const path socket = configuration_.server.socket;
    auto service = LiveService::ask(socket);
    if (!service) {
      held_ = true;
      return findings_.bad("service: " + to_string(service.error()));
    }
    if (!*service) {
      findings_.note(check_socket_path(socket), "socket " + socket.string());
      return take_settings(find_kept_settings(file_));
    }
    if (!(*service)->serves(file_)) {
      return findings_.bad("socket " + socket.string() + ": the service at this socket has another configuration, " +
                           printable((*service)->configuration_file().string()) +
                           ": check that one, stop the service, or give one of them another [server] socket");
    }
    live_ = std::move(**service);
    findings_.good("service: running at " + socket.string());
    take_settings(live_->set());
    for (const std::string& table : live_->tables_behind(configuration_)) {
      findings_.warn("service: [" + printable(table) +
                     "] differs from this file: reload the service; tables that still differ then need a restart");
    }
    if (const std::uint64_t dropped = live_->log_lines_dropped(); dropped > 0) {
      findings_.warn("service: " + std::to_string(dropped) + " lines of its log were dropped: its reader is too slow");
    }
    if (const std::string why = live_->why_empty(); !why.empty())
      findings_.warn("the last scan gave no points: " + why);
  }

  // As the service has it, or will have it after a start.
  void take_settings(const Result<json>& settings) {
    if (settings && settings->empty()) return;
    auto with_them = settings ? load_configuration_with(file_, *settings) : tl::unexpected(settings.error());
    if (!with_them)
      return findings_.warn("ignoring the settings made over the socket: " + to_string(with_them.error()));
    configuration_ = std::move(*with_them);
    findings_.good("set over the socket: " + names_of_settings(*settings));
  }

  /// Notes the service's report about one of its devices. @return whether the device is open
  bool note_held(const std::string& name, const json& device) {
    const std::string state = device.value("state", "not configured");
    const std::string problem = printable(device.value("problem", ""), kLongestProblem);
    if (state == to_string(DeviceState::kReady) || state == to_string(DeviceState::kCapturing)) {
      findings_.good(name + ": in use by the service, " + state);
      return true;
    }
    findings_.bad(name + ": the service reports it as " + printable(state) + (problem.empty() ? "" : ": " + problem));
    return false;
  }

  void check_hardware_of(const std::string& who, const std::string& calibrated, const std::string& connected) {
    const auto same = check_hardware(who, calibrated, connected);
    if (same) return;
    const std::string text = to_string(same.error());
    configuration_.other_hardware == OtherHardware::kError ? findings_.bad(text) : findings_.warn(text);
  }

  void check_projector() {
    const ProjectorOptions& options = configuration_.projector;
    const bool open = live_ && note_held("projector", live_->projector());
    if (options.driver == ProjectorDriver::kGlfw) return check_monitor(open);
    if (live_ || held_) return;
    const auto projector = make_projector(options);
    findings_.note((*projector)->open(std::chrono::steady_clock::now() + kOpenTime),
                   "projector headless, " + size_text(options.width_px, options.height_px) + " px");
  }

  // Shows nothing: a running service may be showing its pattern there, on another user's display.
  void check_monitor(bool open) {
    const ProjectorOptions& options = configuration_.projector;
    const auto report = report_monitor(options.monitor, options.width_px, options.height_px,
                                       options.enable_output.value_or(owns_display()));
    if (!report && open) return;
    if (!report) return findings_.bad(to_string(report.error()));
    monitor_ = report->output.name;
    findings_.good("projector: monitor " + describe_output(report->output));
    for (const std::string& warning : report->warnings) {
      findings_.warn("projector: monitor " + report->output.name + ": " + warning);
    }
    if (!calibration_) return;
    check_hardware_of("projector", calibration_->report.projector_serial.value_or(""),
                      projector_hardware(report->output.model, report->output.serial));
  }

  void check_camera(const CameraOptions& options) {
    const std::string name = "camera \"" + options.name() + "\"";
    if (live_) {
      const json camera = live_->camera(options.name());
      if (note_held(name, camera)) {
        check_calibrated(name, options, camera.value("hardware", ""), camera.value("width_px", 0),
                         camera.value("height_px", 0));
      }
      return check_drift(name, camera.value("calibration", json()));
    }
    if (held_) return;
    auto camera = make_camera(options);
    if (!camera) return findings_.bad(name + ": " + camera.error().message);
    if (const auto opened = (*camera)->open(); !opened) {
      return findings_.bad(name + " does not open: " + to_string(opened.error()) + advice_for(opened.error(), options));
    }
    findings_.good(name + " opens");
    const CameraDescription& seen = (*camera)->description();
    check_calibrated(name, options, seen.hardware, seen.width_px, seen.height_px);
    if (options.replays() && options.measures()) check_symbols(name, options, **camera);
  }

  void check_light(const std::string& name, const CameraOptions& options, const GreyView& frame) {
    const FrameLight light = measure_frame_light(frame, std::nullopt, guess_full_level(frame));
    for (const Trouble trouble : advise_exposure(light, std::nullopt, {}).troubles)
      findings_.warn(fmt::format("{}: {}: {}", name, to_string(trouble), remedy(trouble)));
    const LightLevels& levels = light.levels;
    if (!options.exposures_us.empty() || !needs_second_exposure(levels)) return;
    findings_.warn(
        fmt::format("{}: symbols are clipped in {:.0f} % of the pattern, while the faintest reach {:.0f} of "
                    "{:.0f}: if nothing moves, set exposures_us to a shorter and a longer exposure",
                    name, 100 * levels.clipped_share, levels.lit_faintest, levels.full));
  }

  // Recorded frames show the pattern; what another camera sees now depends on the service.
  void check_symbols(const std::string& name, const CameraOptions& options, Camera& camera) {
    const CalibratedCamera* const known = calibration_ ? calibration_->camera(options.name()) : nullptr;
    if (known == nullptr || !pattern_) return;
    const auto frame = camera.capture(std::chrono::steady_clock::now() + kOpenTime);
    if (!frame) return findings_.warn(name + ": no frame: " + to_string(frame.error()));
    check_light(name, options, frame->image());
    const auto index = static_cast<std::size_t>(known - calibration_->cameras.data());
    const DecodeOptions& decode = configuration_.decode;
    std::size_t read = 0;
    const std::string doubt = doubt_by_frame(frame->image(), *pattern_, *calibration_, index,
                                             {decode.depth_min_mm, decode.depth_max_mm}, read);
    if (!doubt.empty()) return findings_.warn(doubt);
    if (read >= kSymbolsForDoubt)
      findings_.good(name + ": its calibration fits the symbols of its first frame: " + std::to_string(read));
  }

  [[nodiscard]] std::string advice_for(const Error& error, const CameraOptions& absent) const {
    if (error.code != ErrorCode::kNotFound || absent.replays()) return {};
    return "; " + CameraList::look(configuration_).similar_to(absent);
  }

  void check_calibrated(const std::string& name, const CameraOptions& options, const std::string& hardware,
                        int width_px, int height_px) {
    const CalibratedCamera* const known = calibration_ ? calibration_->camera(options.name()) : nullptr;
    if (known == nullptr) return;
    check_hardware_of(name, calibrated_hardware(*calibration_, *known), hardware);
    const std::string size = size_text(width_px, height_px);
    if (known->lens.width_px == width_px && known->lens.height_px == height_px) {
      return findings_.good(name + " matches the size in its calibration, " + size + " px");
    }
    findings_.bad(name + " sends frames of " + size + " px, but its calibration is for " +
                  size_text(known->lens.width_px, known->lens.height_px) +
                  " px: set the camera's size, or calibrate again");
  }

  // Simulates a wall as each camera would see it. The time and the memory are those of this machine.
  void check_dense(const ScanSetup& setup) {
    for (const std::string& warning : calibration_error_warnings(*setup.calibration)) findings_.warn(warning);
    Crew& crew = *setup.crew;
    for (const Decoder& made : setup.lanes.front()) {
      const std::string name =
          "dense clouds of camera \"" + setup.calibration->cameras[made.camera_index()].name + "\"";
      const CalibratedCamera& camera = setup.calibration->cameras[made.camera_index()];
      DenseMapper mapper(setup.pattern, *setup.calibration, made.camera_index(), setup.decode);
      const DenseOutlook outlook =
          dense_outlook(setup.pattern, *setup.calibration, made.camera_index(), setup.decode, mapper.window_px());
      if (outlook.too_coarse) {
        findings_.warn(
            fmt::format("{}: the pattern is too coarse for this camera, which sees symbols {:.0f} px apart and fits "
                        "windows of {} px: use smaller symbols, such as config/patterns/8px-6-dense-no-repeats.toml",
                        name, outlook.pitch_px, mapper.window_px()));
      }
      const int stride = DenseMapper::stride_px(camera.lens, setup.decode.dense);
      if (stride != setup.decode.dense.stride_px) {
        findings_.warn(
            fmt::format("{}: dense_stride_px = {} would need too much memory for this many pixels: slsd uses {}", name,
                        setup.decode.dense.stride_px, stride));
      }
      const Grey8 frame = wall_frame(setup.pattern, *setup.calibration, made.camera_index(), outlook.depth_mm);
      Decoder decoder = made.another();
      std::uint32_t points = 0;
      auto least = std::chrono::steady_clock::duration::max();
      for (int run = 0; run < kDenseRuns; ++run) {
        const auto begin = std::chrono::steady_clock::now();
        if (const auto decoding = decoder.decode(frame.view(), 255, nullptr, &crew); !decoding) {
          return findings_.bad(name + ": " + to_string(decoding.error()));
        }
        points = mapper.measure(frame.view(), 255, decoder.symbols(crew), crew).count(DensePixel::kMeasured);
        least = std::min(least, std::chrono::steady_clock::now() - begin);
      }
      // Repeats the same frame: measures the memory that a stream keeps, and the time of the third run.
      auto still = std::chrono::steady_clock::duration::zero();
      for (int run = 0; run < kDenseRuns; ++run) {
        const auto begin = std::chrono::steady_clock::now();
        (void)mapper.measure_next(frame.view(), 255, decoder.symbols(crew), crew);
        still = std::chrono::steady_clock::now() - begin;
      }
      const auto pixels = static_cast<std::size_t>(frame.width()) * static_cast<std::size_t>(frame.height());
      if (points == 0) {
        findings_.warn(
            name + " would be empty: a wall at " + fmt::format("{:.0f}", outlook.depth_mm) +
            " mm shows no symbol that can be decoded; use larger symbols, or check depth_min_mm and depth_max_mm");
        continue;
      }
      constexpr double kMega = 1e6;
      findings_.good(fmt::format(
          "{}, at {:.0f} mm: resolves parts from {:.1f} mm, and half the height of waves {:.1f} mm long; one px is "
          "{:.2f} mm of depth. A wall gives {} points of {} pixels in {:.0f} ms per frame, in {:.0f} ms in a stream of "
          "a still scene. Memory: {:.0f} MB, at most {:.0f} MB shared by all decoders, and {:.0f} MB per cloud in "
          "progress",
          name, outlook.depth_mm, outlook.thinnest_part_mm, outlook.half_transfer_mm, outlook.mm_per_px, points, pixels,
          in_ms(least), in_ms(still), static_cast<double>(mapper.bytes()) / kMega,
          static_cast<double>(DenseMapper::bytes_of_fields(setup.calibration->projector)) / kMega,
          static_cast<double>(pixels * kCloudBytesAPixel) / kMega));
    }
  }

  void check_drift(const std::string& name, const json& drift) {
    if (!drift.is_object() || !drift.value("off_since_scan", json()).is_number()) return;
    findings_.warn(fmt::format("{}: knocked out of its calibration since scan {}: {}", name,
                               drift.value("off_since_scan", std::uint64_t{0}), kKnockRemedy));
  }

  /// The projector's name in the latency report; empty if unknown.
  [[nodiscard]] std::string projector_in_use() const {
    if (live_) return projector_name(live_->projector().value("driver", ""), live_->projector().value("device", ""));
    const auto projector = make_projector(configuration_.projector);
    if (!projector) return {};
    const ProjectorDescription& description = (*projector)->description();
    const bool headless = configuration_.projector.driver == ProjectorDriver::kHeadless;
    if (!headless && monitor_.empty()) return {};
    return projector_name(description.driver, headless ? description.monitor : monitor_);
  }

  // A virtual projector has no light to wait for.
  void check_latency() {
    const path file = latency_file(configuration_, file_);
    const auto text = read_file(file, kMaxLatencyBytes);
    if (!text && text.error().code == ErrorCode::kNotFound) {
      if (configuration_.projector.driver == ProjectorDriver::kHeadless) return;
      return findings_.warn("the latency of projector and cameras was not measured: run slsd --calibrate --latency");
    }
    const auto report = text ? read_latency(*text, file) : tl::unexpected(text.error());
    if (!findings_.note(report, "latency " + file.string())) return;
    for (const std::string& warning : latency_warnings(configuration_, *report, projector_in_use())) {
      findings_.warn(warning);
    }
  }

  // Assumes frames of the calibration's size with two bytes per pixel, the maximum.
  void check_black_box() {
    const BlackBoxOptions& options = configuration_.black_box;
    if (options.memory_max_mb == 0) return findings_.warn("black box: off, so failures cannot be analysed later");
    double scan_bytes = 0;
    for (const CameraOptions& camera : configuration_.cameras) {
      const CalibratedCamera* const known = calibration_ ? calibration_->camera(camera.name()) : nullptr;
      if (known != nullptr && camera.measures()) scan_bytes += 2.0 * known->lens.width_px * known->lens.height_px;
    }
    const double scans = scan_bytes > 0 ? static_cast<double>(options.memory_max_bytes()) / scan_bytes : 0;
    const std::string memory = fmt::format("black box: {} MB of memory", options.memory_max_mb);
    if (scan_bytes > 0 && scans < 1) {
      return findings_.warn(
          fmt::format("{}, but the frames of one scan may need {:.0f}: raise [black_box] memory_max_mb", memory,
                      std::ceil(scan_bytes / (1 << 20))));
    }
    findings_.good(scan_bytes > 0 ? fmt::format("{} for the last {:.0f} scans of 8 bits, or {:.0f} of 16", memory,
                                                std::floor(2 * scans), std::floor(scans))
                                  : memory);
  }

  Configuration configuration_;
  const path& file_;
  Findings& findings_;
  std::optional<Pattern> pattern_;
  std::optional<Calibration> calibration_;
  std::optional<LiveService> live_;  ///< the service with this configuration
  bool held_ = false;                ///< a service that cannot be asked holds the devices
  std::string monitor_;              ///< the visible monitor; empty: none
};

}  // namespace

Result<> check_configuration(const std::optional<path>& configuration_file) {
  const path file = configuration_file.value_or(kConfigurationFile);
  const auto configuration = load_configuration(file);
  if (!configuration) return tl::unexpected(configuration.error());
  if (const auto access = AccessRules::of(configuration->server); !access) return tl::unexpected(access.error());
  if (const auto projector = make_projector(configuration->projector); !projector) {
    return tl::unexpected(projector.error());
  }
  for (const CameraOptions& options : configuration->cameras) {
    if (const auto camera = make_camera(options); !camera) return tl::unexpected(camera.error());
  }
  const auto setup = ScanSetup::create(*configuration, 1);
  if (!setup) return tl::unexpected(setup.error());
  Findings findings;
  findings.good("configuration " + file.string());
  for (const std::string& warning : exposure_warnings(*configuration)) findings.warn(warning);
  for (const std::string& doubt : setup->doubts) findings.warn(doubt);
  return {};
}

bool check_everything(const std::optional<path>& configuration_file) {
  Findings findings;
  const path file = configuration_file.value_or(kConfigurationFile);
  auto configuration = load_configuration(file);
  if (!findings.note(configuration, "configuration " + file.string())) return false;
  Check(std::move(*configuration), file, findings).look();
  return findings.scan_possible();
}

}  // namespace slsd
