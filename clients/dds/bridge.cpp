// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "bridge.hpp"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <list>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>
#include <slsd/scanner.hpp>

#include "drivers/files/file.hpp"
#include "endpoints.hpp"
#include "extrinsics.hpp"
#include "messages.hpp"

namespace slsd::dds {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr auto kDiscovery = 1500ms;  // until others of the same name are known
constexpr auto kRetry = 1s;
constexpr std::size_t kExtrinsicsBytesMax = 1 << 20;

// A camera may have any name.
std::string ros_name(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !is_ros_name(std::string("a") + c); }, '_');
  return is_ros_name(name) ? name : "camera_" + name;
}

// A body's axes (x forward, y left, z up; REP 103) from those of an optical frame.
RigidTransform body_from_optical() {
  RigidTransform turn;
  turn.rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return turn;
}

/// A camera of the scanner in the network.
struct Camera {
  std::string name;  ///< as slsd has it
  std::string frame_id;
  std::optional<CalibratedCamera> calibrated;
  dds_entity_t info = 0, image = 0;
};

class Running : public Bridge {
 public:
  Running(const BridgeOptions& options, Network network, std::optional<Extrinsics> extrinsics)
      : options_(options),
        network_(std::move(network)),
        extrinsics_(std::move(extrinsics)),
        frame_id_(options.name + "_optical_frame") {}

  Result<> open() {
    using Quality = Network::Quality;
    Result<> opened;
    const auto keep = [&](dds_entity_t& entity, Result<dds_entity_t> made) {
      if (made) entity = *made;
      if (!made && opened) opened = tl::unexpected(made.error());
    };
    keep(points_,
         network_.writer(sensor_msgs_msg_dds__PointCloud2__desc, "rt/" + options_.name + "/points", Quality::kSensor));
    keep(transforms_, network_.writer(tf2_msgs_msg_dds__TFMessage__desc, "rt/tf_static", Quality::kLatched));
    keep(diagnostics_,
         network_.writer(diagnostic_msgs_msg_dds__DiagnosticArray__desc, "rt/diagnostics", Quality::kService));
    auto trigger = Trigger::open(network_, options_.name);
    if (!trigger) return tl::unexpected(trigger.error());
    trigger_ = *trigger;
    return opened;
  }

  void start() {
    if (!options_.rate_hz || *options_.rate_hz > 0) {
      clouds_ = std::jthread([this](const std::stop_token& stop) {
        while (!stop.stop_requested()) stream();
      });
    }
    triggers_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) trigger_.answer([this] { return scan(); });
    });
    state_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) tell_state();
    });
  }

 private:
  // Waits for clouds until the service is gone.
  void stream() {
    try {
      client::StreamOptions options;
      options.rate_hz = options_.rate_hz;
      options.density = options_.density;
      options.shared = true;
      client::Stream stream = client::Scanner(options_.socket).stream(options);
      while (true) publish(stream.next());
    } catch (const client::ScannerError& error) {
      say(error.what());
      std::this_thread::sleep_for(kRetry);
    }
  }

  void publish(const client::Cloud& cloud) {
    const json told = json::parse(cloud.description, nullptr, false);
    const auto stamp =
        stamp_of(told.is_object() && told.contains("time") && told["time"].is_string() ? told["time"].get<std::string>()
                                                                                       : std::string());
    const std::lock_guard lock(mutex_);
    lost_ += cloud.lost;
    const int written = dds_write(points_, &message_.of(cloud, frame_id_, stamp));
    if (written < 0) say(std::string("a cloud was not published: ") + dds_strretcode(written));
    if (written == 0) ++published_;
    for (const Camera& camera : cameras_) {
      if (!camera.calibrated) continue;
      const auto info = camera_info(*camera.calibrated, camera.frame_id, stamp);
      dds_write(camera.info, &info);
    }
  }

  std::pair<bool, std::string> scan() {
    try {
      client::ScanOptions options;
      options.density = options_.density;
      const client::Cloud cloud = client::Scanner(options_.socket).scan(options);
      publish(cloud);
      const std::string why = cloud.why_empty.empty() ? "" : ": " + cloud.why_empty;
      return {true, std::to_string(cloud.size()) + " points, scan " + cloud.scan + why};
    } catch (const client::ScannerError& error) {
      say(error.what());
      return {false, (error.name().empty() ? "" : error.name() + ": ") + error.what()};
    }
  }

  void tell_state() {
    Diagnosis state{Level::kOk, "ready to scan", {}};
    auto& values = state.values;
    try {
      client::Scanner scanner(options_.socket);
      const json status = json::parse(scanner.status());
      const json settings = json::parse(scanner.settings());
      if (settings.value("calibration", "") != calibration_text_ || cameras_.empty()) {
        const std::lock_guard lock(mutex_);
        if (auto read = take_calibration(settings); !read)
          state.worse(Level::kError, "calibration: " + to_string(read.error()));
      }
      if (!status.value("ready", false)) state.worse(Level::kWarn, "not ready to scan");
      json devices = status.value("cameras", json::array());
      if (status.contains("projector")) devices.push_back(status["projector"]);
      for (const json& device : devices) {
        values.emplace_back(device.value("name", ""), device.value("state", ""));
        if (const std::string problem = device.value("problem", ""); !problem.empty())
          state.worse(Level::kError, problem);
      }
      values.emplace_back("scans succeeded", status.value("scans", json::object()).value("succeeded", json(0)).dump());
      if (const json why = status.value("scans", json::object()).value("empty", json()); why.is_string())
        state.worse(Level::kWarn, "the last cloud is empty: " + why.get<std::string>());
      if (calibration_text_.empty()) state.worse(Level::kError, "not calibrated");
      if (stale_)
        state.worse(Level::kError, "extrinsics_stale: the scanner was calibrated anew since; measure where it stands");
      publish_images(scanner);
    } catch (const client::ScannerError& error) {
      state.worse(Level::kError, error.what());
    } catch (const json::exception& error) {
      state.worse(Level::kError, std::string("the service's state is not slsd's: ") + error.what());
    }
    if (network_.other_writers("rt/" + options_.name + "/points") > 0)
      state.worse(Level::kError,
                  "name_taken: another scanner publishes as \"" + options_.name + "\"; rename one of them");
    values.emplace_back("clouds published", std::to_string(published_));
    values.emplace_back("clouds lost before publishing", std::to_string(lost_));
    if (!calibration_date_.empty()) values.emplace_back(kCalibrationDate, calibration_date_);
    if (state.level == Level::kError && state.message != said_) say(said_ = state.message);
    if (state.level == Level::kOk) said_.clear();
    write_diagnosis(diagnostics_, std::move(state), options_.name, options_.name + ": slsd");
    std::this_thread::sleep_for(options_.image_rate_hz > 1
                                    ? std::chrono::duration_cast<std::chrono::nanoseconds>(
                                          std::chrono::duration<double>(1 / options_.image_rate_hz))
                                    : std::chrono::nanoseconds(1s));
  }

  // The cameras of the network by those of the service, and where all of them stand.
  Result<> take_calibration(const json& settings) {
    calibration_text_ = settings.value("calibration", "");
    std::optional<Calibration> calibration;
    if (!calibration_text_.empty()) {
      auto read = read_calibration(calibration_text_, "calibration");
      if (!read) return tl::unexpected(read.error());
      calibration = std::move(*read);
    }
    for (const json& told : settings.value("cameras", json::array())) {
      const std::string name = told.value("name", "");
      auto known = std::find_if(cameras_.begin(), cameras_.end(), [&](const Camera& one) { return one.name == name; });
      if (known == cameras_.end()) {
        const std::string topic = "rt/" + options_.name + "/" + ros_name(name);
        Camera camera{name, cameras_.empty() ? frame_id_ : options_.name + "_" + ros_name(name) + "_optical_frame", {}};
        const auto info =
            network_.writer(sensor_msgs_msg_dds__CameraInfo__desc, topic + "/camera_info", Network::Quality::kSensor);
        const auto image =
            network_.writer(sensor_msgs_msg_dds__Image__desc, topic + "/image_raw", Network::Quality::kSensor);
        if (!info || !image) return tl::unexpected((info ? image : info).error());
        camera.info = *info, camera.image = *image;
        known = cameras_.insert(cameras_.end(), camera);
      }
      const CalibratedCamera* calibrated = calibration ? calibration->camera(name) : nullptr;
      known->calibrated = calibrated ? std::optional(*calibrated) : std::nullopt;
    }
    calibration_date_ = calibration ? calibration->report.date.value_or("") : "";
    stale_ = extrinsics_ && calibration && !extrinsics_->calibration_date.empty() &&
             calibration->report.date.value_or("") != extrinsics_->calibration_date;
    publish_transforms();
    return {};
  }

  // With extrinsics that no longer hold the scanner stands nowhere: no place is better than a wrong one.
  void publish_transforms() {
    const auto now = stamp_now();
    const std::string link = options_.name + "_link";
    std::vector<geometry_msgs_msg_dds__TransformStamped_> all;
    if (!extrinsics_) all.push_back(transform(link, frame_id_, body_from_optical(), now));
    if (extrinsics_ && !stale_)
      all.push_back(transform(extrinsics_->parent, frame_id_, extrinsics_->parent_from_scanner, now));
    for (const Camera& camera : cameras_) {
      if (camera.frame_id != frame_id_ && camera.calibrated)
        all.push_back(transform(frame_id_, camera.frame_id, camera.calibrated->rig_from_camera, now));
    }
    const auto count = static_cast<std::uint32_t>(all.size());
    const tf2_msgs_msg_dds__TFMessage_ message{{count, count, all.data(), false}};
    dds_write(transforms_, &message);
  }

  void publish_images(client::Scanner& scanner) {
    if (options_.image_rate_hz <= 0) return;
    for (const Camera& camera : cameras_) {
      const client::Frame frame = scanner.frame(camera.name);
      const auto stamp = stamp_now();
      const auto message = image(frame, camera.frame_id, stamp);
      dds_write(camera.image, &message);
      if (!camera.calibrated) continue;
      const auto info = camera_info(*camera.calibrated, camera.frame_id, stamp);
      dds_write(camera.info, &info);
    }
  }

  void say(const std::string& text) const {
    std::fprintf(stderr, "slsd-dds: %s: %s\n", options_.name.c_str(), text.c_str());
  }

  BridgeOptions options_;
  Network network_;
  std::optional<Extrinsics> extrinsics_;
  std::string frame_id_;
  dds_entity_t points_ = 0, transforms_ = 0, diagnostics_ = 0;
  Trigger trigger_;
  std::mutex mutex_;  ///< of what is below, up to the threads
  CloudMessage message_;
  std::list<Camera> cameras_;  ///< changed by the thread of the state alone
  std::string calibration_text_, calibration_date_, said_;
  bool stale_ = false;
  std::atomic<std::uint64_t> published_{0}, lost_{0};
  std::jthread clouds_, triggers_, state_;
};

}  // namespace

Result<std::unique_ptr<Bridge>> Bridge::start(const BridgeOptions& options, Network network) {
  if (!is_ros_name(options.name)) {
    return fail(ErrorCode::kInvalidArgument, "a name of ROS has letters, digits and _, and begins with a letter",
                options.name);
  }
  std::optional<Extrinsics> extrinsics;
  if (!options.extrinsics.empty()) {
    const auto text = read_file(options.extrinsics, kExtrinsicsBytesMax);
    if (!text) return tl::unexpected(text.error());
    auto read = read_extrinsics(*text, options.name, options.extrinsics.string());
    if (!read) return tl::unexpected(read.error());
    extrinsics = std::move(*read);
  }
  std::this_thread::sleep_for(kDiscovery);
  if (network.other_writers("rt/" + options.name + "/points") > 0) {
    return fail(ErrorCode::kAlreadyExists,
                "name_taken: another scanner of this name is in the network; name this one with --name", options.name);
  }
  auto bridge = std::make_unique<Running>(options, std::move(network), std::move(extrinsics));
  if (auto opened = bridge->open(); !opened) return tl::unexpected(opened.error());
  bridge->start();
  return bridge;
}

}  // namespace slsd::dds
