// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/service/service.hpp"

#include <csignal>
#include <cstdlib>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>
#include <asio/post.hpp>

#include "core/calibrate/doubt/calibration_doubts.hpp"
#include "core/decode/symbols/symbol_warnings.hpp"
#include "daemon/bundle/bundle.hpp"
#include "daemon/configuration/exposure_warnings.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "daemon/scan/message_ids.hpp"
#include "daemon/scan/rig/devices.hpp"
#include "daemon/scan/rig/projected_picture.hpp"
#include "daemon/server/listening_socket.hpp"
#include "daemon/server/methods/methods.hpp"
#include "daemon/server/methods/metrics.hpp"
#include "daemon/server/methods/status_json.hpp"
#include "drivers/files/file.hpp"
#include "drivers/log/logging.hpp"

namespace slsd {
namespace {

using namespace std::chrono_literals;

constexpr auto kStopTime = 700ms;  // for the devices
constexpr auto kSendTime = 2s;     // for messages being sent, while the clients read them
constexpr auto kSilence = 300ms;   // after which no client seems to read
constexpr auto kEndGlance = 5ms;
constexpr auto kStatusPeriod = 5s;
constexpr auto kPrepareTime = 5min;  // half a second of computing, on a heavily loaded host

// The default symbol sets are known to be good at a sufficient scale, and the check takes a while.
void warn_of_symbols(const PatternOptions& pattern, double scale) {
  constexpr double kKnownScale = 1.3;
  if (pattern.symbols == default_symbols(pattern.symbol_size_px) && scale >= kKnownScale) return;
  for (const std::string& warning : symbol_warnings(pattern, scale)) spdlog::warn("pattern: {}", warning);
}

// Tables that a reload cannot put into force.
nlohmann::json tables_that_need_restart(const Configuration& now, const Configuration& next) {
  nlohmann::json tables = nlohmann::json::array();
  if (!(now.projector == next.projector)) tables.push_back("projector");
  if (!(with_exposures_of(now.cameras, next.cameras) == next.cameras)) tables.push_back("camera");
  if (!(now.server == next.server)) tables.push_back("server");
  ScanOptions in_force = now.scan;
  in_force.timeout_ms = next.scan.timeout_ms;  // takes effect at once
  if (!(in_force == next.scan)) tables.push_back("scan");
  if (!(now.black_box == next.black_box)) tables.push_back("black_box");
  return tables;
}

// Only these keys of the camera tables take effect.
void note_exposures(nlohmann::json& given, const nlohmann::json& next) {
  if (!given.contains("camera") || !next.contains("camera")) return;
  for (nlohmann::json& camera : given["camera"]) {
    for (const nlohmann::json& other : next["camera"]) {
      if (other.value("name", "camera") != camera.value("name", "camera")) continue;
      for (const char* const key : {"exposure_us", "gain_db", "gain_steps"}) {
        camera.erase(key);
        if (other.contains(key)) camera[key] = other[key];
      }
    }
  }
}

}  // namespace

Result<std::unique_ptr<Service>> Service::create(Configuration configuration, const std::filesystem::path& file,
                                                 nlohmann::json settings) {
  auto projector = make_projector(configuration.projector);
  if (!projector) return tl::unexpected(projector.error());
  std::vector<std::unique_ptr<Camera>> cameras;
  std::vector<std::vector<double>> exposures_us;
  std::size_t texture_cameras = 0;
  for (const CameraOptions& options : configuration.cameras) {
    texture_cameras += options.measures() ? 0 : 1;
    auto camera = make_camera(options);
    if (!camera) return tl::unexpected(camera.error());
    cameras.push_back(std::move(*camera));
    exposures_us.push_back(options.exposures_us);
  }
  Notifier().starting("starting: preparing the decoder", kPrepareTime);
  auto setup = ScanSetup::create(configuration, DecodeLanes::lanes_here());
  if (!setup) return tl::unexpected(setup.error());
  warn_of_symbols(setup->pattern.options, pattern_scale(setup->calibration, configuration.decode));
  for (const std::string& warning : exposure_warnings(configuration)) spdlog::warn("{}", warning);
  for (const std::string& doubt : setup->doubts) spdlog::warn("{}", doubt);
  if (configuration.decode.density == Density::kPixels && setup->calibration)
    for (const std::string& warning : calibration_error_warnings(*setup->calibration)) spdlog::warn("{}", warning);
  // The rig opens the devices. A second service must not show its picture over that of the first, nor take its cameras.
  if (auto can = check_can_listen(configuration.server.socket); !can) return tl::unexpected(can.error());
  auto rig = std::make_unique<Rig>(std::move(*projector), std::move(cameras), setup->image, configuration.scan,
                                   exposures_us, texture_cameras);
  rig->set_idle(draw_idle(configuration.projector), std::chrono::milliseconds(configuration.projector.idle_after_ms));
  std::error_code ignored;
  const auto known_from_anywhere = std::filesystem::absolute(file, ignored);
  std::unique_ptr<Service> service(
      new Service(std::move(configuration), known_from_anywhere, std::move(rig), std::move(*setup)));
  service->state_.settings = std::move(settings);
  return service;
}

Service::Service(Configuration configuration, const std::filesystem::path& file, std::unique_ptr<Rig> rig,
                 ScanSetup setup)
    : signals_(events_),
      watchdog_(events_),
      status_(events_),
      ending_(events_),
      bundles_(configuration.black_box.bundles(), configuration.black_box.disk_max_bytes()),
      scanner_(std::move(rig), std::move(setup), configuration.black_box.memory_max_bytes()),
      state_{events_, scanner_, file, std::move(configuration)} {
  const auto handler = [this](const Request& request, Session& session, Respond respond) {
    dispatch(state_, request, session, std::move(respond));
  };
  const auto demand_changed = [this](std::optional<FreeRun> demand) {
    const bool calibrates = state_.calibration && state_.calibration->under_way();
    scanner_.run_freely(calibrates ? std::nullopt : demand);
  };
  server_ = std::make_unique<Server>(events_, state_.configuration.server, handler, demand_changed);
  state_.server = server_.get();
  for (const RpcMethod& method : methods()) state_.requests.by_method[method.name] = 0;
  state_.log_lines_dropped = log_lines_dropped;
  state_.reload = [this](const nlohmann::json& settings, Respond answered) { reload(settings, std::move(answered)); };
  state_.calibration = std::make_unique<CalibrationRun>(events_, [this](bool made) { calibrated(state_, made); });
  state_.bundle = [this](Scanner::Answer<std::string> answer) { bundle(nullptr, std::move(answer)); };
  state_.bundles_written = [this] { return bundles_.written(); };
  scanner_.set_failure_listener([this](const std::string& scan_id, const Error& error) { on_failure(scan_id, error); });
  server_->set_delivered(
      [this](const ScanResult& scan) { scanner_.note_latency(std::chrono::steady_clock::now() - scan.received); });
  scanner_.set_listener([this](FreeScan scan) { server_->publish(std::move(scan)); });
}

Service::~Service() {
  scanner_.request_stop();
}

Result<> Service::run() {
  std::error_code error;
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) signals_.add(number, error);
  if (auto opened = server_->open(); !opened) return opened;
  await_signal();
  watch();
  announce();
  update_status();
  events_.run();
  return {};
}

void Service::announce() const {
  const Configuration& configuration = state_.configuration;
  const MessageId id(MessageId::kReady);
  spdlog::info("ready at {}: {} camera(s), projector {} {}x{}, {}", configuration.server.socket.string(),
               configuration.cameras.size(), to_string(configuration.projector.driver),
               configuration.projector.width_px, configuration.projector.height_px,
               configuration.calibration_file.empty() ? "no calibration"
                                                      : "calibration " + configuration.calibration_file.string());
  notifier_.ready("ready");
}

void Service::await_signal() {
  signals_.async_wait([this](const std::error_code& error, int number) {
    if (!error) on_signal(number);
  });
}

void Service::on_signal(int number) {
  if (number != SIGHUP) {
    spdlog::info("stopping: {}", number == SIGINT ? "SIGINT" : "SIGTERM");
    return stop();
  }
  if (setting_) {
    reload_again_ = true;
  } else {
    reload(state_.settings, [](Outcome) {});
  }
  await_signal();
}

void Service::stop() {
  notifier_.stopping();
  state_.calibration->cancel();
  server_->wind_down();
  watchdog_.cancel();
  status_.cancel();
  scanner_.request_stop();
  await_end(std::chrono::steady_clock::now());
}

// Meanwhile the event loop sends the answers of cancelled requests, and clouds and images to their end.
void Service::await_end(std::chrono::steady_clock::time_point began) {
  const auto now = std::chrono::steady_clock::now();
  const bool stopped = scanner_.wait_stopped(0ms);
  const bool in_time = now < began + kStopTime;
  const bool sending = server_->is_sending_since(now - kSilence) && now < began + kSendTime;
  if ((!stopped && in_time) || (server_->clients() > 0 && (in_time || sending))) {
    ending_.expires_after(kEndGlance);
    return ending_.async_wait([this, began](const std::error_code& error) {
      if (!error) await_end(began);
    });
  }
  server_->end_all();
  events_.stop();
  if (stopped) return spdlog::info("stopped");
  // A driver or a long computation may be impossible to interrupt. No file is half written: a bundle is whole or
  // absent.
  spdlog::warn("stopped without waiting for a device or a computation");
  flush_log(kLogTimeout);
  std::_Exit(EXIT_SUCCESS);
}

// Refuses a change of settings while another reload is under way: the later one would not know the earlier one's
// settings.
void Service::reload(const nlohmann::json& settings, Respond answered) {
  const bool sets = settings != state_.settings;
  if (setting_ || (sets && reloads_ > 0)) {
    const Error busy{ErrorCode::kBusy, "another change of the settings is under way: try again", {}};
    return answered(tl::unexpected(rpc_error(busy)));
  }
  if (sets && *state_.preset_scans > 0) {
    const Error busy{ErrorCode::kBusy, "a scan with a preset is under way: try again after it", {}};
    return answered(tl::unexpected(rpc_error(busy)));
  }
  ++reloads_;
  setting_ = sets;
  notifier_.reloading();
  scanner_.reload(state_.configuration_file, state_.configuration, settings,
                  [this, settings, answered = std::move(answered)](const Result<Configuration>& configuration) {
                    asio::post(events_, [this, configuration, settings, answered] {
                      on_reloaded(configuration, settings, answered);
                    });
                  });
}

void Service::on_reloaded(const Result<Configuration>& configuration, nlohmann::json settings,
                          const Respond& answered) {
  notifier_.ready("ready");
  --reloads_;
  setting_ = false;
  if (std::exchange(reload_again_, false)) asio::post(events_, [this] { reload(state_.settings, [](Outcome) {}); });
  if (!configuration) {
    const MessageId id(MessageId::kReloadRefused);
    spdlog::error("reload refused, the previous settings stay in force: {}", to_string(configuration.error()));
    return answered(tl::unexpected(rpc_error(configuration.error())));
  }
  nlohmann::json restart = tables_that_need_restart(state_.configuration, *configuration);
  spdlog::info("reloaded {}", state_.configuration_file.string());
  if (!restart.empty()) spdlog::warn("changes that need a restart: {}", restart.dump());
  state_.configuration.pattern_file = configuration->pattern_file;
  state_.configuration.pattern = configuration->pattern;
  state_.configuration.calibration_file = configuration->calibration_file;
  state_.configuration.other_hardware = configuration->other_hardware;
  state_.configuration.decode = configuration->decode;
  state_.configuration.frame = configuration->frame;
  state_.configuration.cloud = configuration->cloud;
  state_.configuration.cameras = with_exposures_of(state_.configuration.cameras, configuration->cameras);
  state_.configuration.scan.timeout_ms = configuration->scan.timeout_ms;
  for (const char* table : {"pattern", "calibration", "decode", "frame", "cloud"}) {
    state_.configuration.given.erase(table);
    if (configuration->given.contains(table)) state_.configuration.given[table] = configuration->given[table];
  }
  note_exposures(state_.configuration.given, configuration->given);
  // The next start reads this file; the configuration itself belongs to the administrator.
  const bool changed = settings != state_.settings;
  const std::filesystem::path kept = kept_settings_file(state_.configuration_file);
  nlohmann::json why_not_kept;
  state_.settings = std::move(settings);
  if (changed && kept.empty()) why_not_kept = "$STATE_DIRECTORY is not set: start the service with its systemd unit";
  if (changed && !kept.empty()) {
    if (auto written = write_file_atomically(kept, state_.settings.dump(2) + "\n"); !written) {
      why_not_kept = to_string(written.error());
      spdlog::warn("settings are in force but not saved: {}", to_string(written.error()));
    }
  }
  nlohmann::json reply{{"needs_restart", std::move(restart)}};
  if (changed) reply["not_kept"] = std::move(why_not_kept);
  answered(Reply{std::move(reply)});
}

void Service::bundle(nlohmann::json reason, Scanner::Answer<std::string> answer) {
  const BundleNotes notes{std::move(reason), status_json(state_), settings_json(state_.configuration),
                          metrics_text(state_)};
  scanner_.last_scans([notes, answer = std::move(answer)](const Result<std::vector<KeptScan>>& scans) {
    answer(scans ? write_bundle(*scans, notes, std::chrono::system_clock::now()) : tl::unexpected(scans.error()));
  });
}

// Runs on a thread of the scanner. Only the event loop's thread may read the state that a bundle describes.
void Service::on_failure(const std::string& scan_id, const Error& error) {
  if (!bundles_.claim(error, std::chrono::system_clock::now())) return;
  asio::post(events_, [this, scan_id, error] {
    nlohmann::json reason{{"scan", scan_id}, {"error", rpc_error(error).to_json()}};
    bundle(std::move(reason), [this, scan_id, error](const Result<std::string>& bytes) {
      const LogField about("SLSD_SCAN", scan_id);
      const LogField code("SLSD_ERROR", std::string(to_string(error.code)));
      const auto file =
          bytes ? bundles_.put(error, *bytes, std::chrono::system_clock::now()) : tl::unexpected(bytes.error());
      if (!file) {
        if (file.error().code != ErrorCode::kCancelled)
          spdlog::warn("cannot write a bundle of scan {}: {}", scan_id, to_string(file.error()));
        return;
      }
      const MessageId id(MessageId::kBundleWritten);
      spdlog::warn("scan {} failed in a new way ({}): the last scans are in {}; decode them again with slsd --replay",
                   scan_id, to_string(error.code), file->string());
    });
  });
}

void Service::watch() {
  const auto time = Notifier::watchdog_time();
  if (!time) return;
  if (scanner_.kept()) notifier_.ping_watchdog();
  watchdog_.expires_after(*time / 3);
  watchdog_.async_wait([this](const std::error_code& error) {
    if (!error) watch();
  });
}

void Service::update_status() {
  const ScanTotals totals = scanner_.totals();
  std::uint64_t failed = 0;
  for (const auto& [code, count] : totals.failed) failed += count;
  notifier_.status("ready, " + std::to_string(totals.succeeded) + " scans, " + std::to_string(failed) + " failed");
  status_.expires_after(kStatusPeriod);
  status_.async_wait([this](const std::error_code& error) {
    if (!error) update_status();
  });
}

}  // namespace slsd
