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

/// The composition root: owns everything, in the order in which it is made. The threads, and why each is one:
///
///   main     the event loop: socket, signals, watchdog. Never waits for a device, never computes for long.
///   scanner  the projector, and each scan's frames: waits for devices.
///   display  the projector's window: an X server that hangs holds whatever talks to it.
///   cam NAME one to a camera: cameras expose at the same time, and opening one may take seconds.
///   log      writes the log: whoever reads that may stand still.
///   decode N one or two, from frames to clouds and pictures: each uses a processor fully while the next frames come.
///   helper N help those with the parts of a frame or a dense cloud, one to each processor but one, as far as lanes
///   that
///            compute leave processors free.
///   deadlines  ends requests whose time is over, whatever the others wait for.
///   chores   what needs no device and takes long: a reload's pattern and decoders, the pattern as a PNG.
///
/// Between them stand the scanner's bounded queue, the lanes' few sets of frames, the server's few newest clouds, and
/// the event loop's own queue, which holds at most one answer to a client.
/// @thread thread-bound: main
class Service {
 public:
  /// Makes everything from the configuration; nothing answers yet.
  /// @param file  the configuration's, to be read again by a reload
  /// @errors of ScanSetup::create(), make_projector() and make_camera()
  /// @param settings  set over the socket before, which the configuration has in it
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

  int reloads_ = 0;            ///< under way, one after the other
  bool setting_ = false;       ///< the last of them has other settings than those in force
  bool reload_again_ = false;  ///< a signal came meanwhile
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
