// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include <asio/io_context.hpp>
#include <asio/signal_set.hpp>
#include <asio/steady_timer.hpp>

#include "core/result.hpp"
#include "daemon/bundle/bundle_store.hpp"
#include "daemon/configuration/configuration.hpp"
#include "daemon/scan/scanner.hpp"
#include "daemon/server/server.hpp"
#include "daemon/server/service_state.hpp"
#include "daemon/service/notifier.hpp"

namespace slsd {

/// The composition root: owns everything, in order of creation. The threads, and the reason for each:
///
///   main       the event loop: socket, signals, watchdog. Never waits for a device, never computes for long.
///   scanner    the projector, and each scan's frames: waits for devices.
///   display    the projector's window: a hung X server blocks every thread that talks to it.
///   cam NAME   one for each camera: cameras expose at the same time, and opening one may take seconds.
///   log        writes the log: its reader may stall.
///   decode N   one or two, from frames to clouds and pictures: each fully uses a processor during the next capture.
///   helper N   compute parts of a frame or a dense cloud for those; one for each processor but one, less busy lanes.
///   deadlines  ends requests whose time is over, whatever the other threads wait for.
///   chores     long work without devices: a reload's pattern and decoders, the pattern as a PNG.
///
/// The threads exchange data through bounded queues: the scanner's requests, the lanes' few sets of frames, and the
/// server's few newest clouds. The event loop's own queue holds at most one answer for each client.
/// @thread thread-bound: main
class Service {
 public:
  /// Makes everything from the configuration; nothing answers yet.
  /// @param file  the configuration file, which a reload reads again
  /// @errors of ScanSetup::create(), make_projector() and make_camera()
  /// @param settings  settings made earlier over the socket; the configuration includes them
  [[nodiscard]] static Result<std::unique_ptr<Service>> create(Configuration configuration,
                                                               const std::filesystem::path& file,
                                                               nlohmann::json settings);
  ~Service();

  /// Sets the path of slsd-calibrate, for the method `calibrate`.
  void set_calibrator(std::filesystem::path program) { state_.calibrator = std::move(program); }

  /// Serves until SIGTERM or SIGINT. @errors of Server::open()
  [[nodiscard]] Result<> run();

 private:
  Service(Configuration configuration, const std::filesystem::path& file, std::unique_ptr<Rig> rig, ScanSetup setup);
  void announce() const;
  void await_signal();
  void on_signal(int number);
  void stop();
  void await_end(std::chrono::steady_clock::time_point began);
  void reload(const nlohmann::json& settings, Respond answered);
  void on_reloaded(const Result<Configuration>& configuration, nlohmann::json settings, const Respond& answered);
  void bundle(nlohmann::json reason, Scanner::Answer<std::string> answer);
  void on_failure(const std::string& scan_id, const Error& error);
  void watch();
  void update_status();

  int reloads_ = 0;            ///< under way, one after another
  bool setting_ = false;       ///< the last reload has other settings than those in force
  bool reload_again_ = false;  ///< a signal came during a reload
  Notifier notifier_;
  asio::io_context events_;
  asio::signal_set signals_;
  asio::steady_timer watchdog_;
  asio::steady_timer status_;
  asio::steady_timer ending_;
  BundleStore bundles_;
  Scanner scanner_;
  ServiceState state_;
  std::unique_ptr<Server> server_;
};

}  // namespace slsd
