// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "bridge.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <list>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>
#include <slsd/scanner.hpp>

#include "core/calibration_file/calibration_file.hpp"
#include "core/utc_text.hpp"
#include "description.hpp"
#include "drivers/files/file.hpp"
#include "endpoints.hpp"
#include "extrinsics.hpp"
#include "messages.hpp"
#include "tf/robot_poses.hpp"

namespace slsd::dds {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;

constexpr auto kDiscovery = 2000ms;  // time to discover others of the same name
constexpr auto kRetry = 1s;
constexpr std::size_t kExtrinsicsBytesMax = 1 << 20, kCalibrationBytesMax = 1 << 24;

Result<> check_name(const BridgeOptions& options) {
  if (is_ros_name(options.name)) return {};
  return fail(ErrorCode::kInvalidArgument, "a ROS name has letters, digits and _, and begins with a letter",
              options.name);
}

Result<std::string> calibration_in_force(const std::string& socket) {
  try {
    const std::string text = json::parse(client::Scanner(socket).settings()).value("calibration", "");
    if (!text.empty()) return text;
    return fail(ErrorCode::kNotFound, "not calibrated, so the pose of the projector is unknown: run slsctl calibrate");
  } catch (const client::ScannerError& error) {
    return fail(ErrorCode::kIo, error.what(), error.where());
  } catch (const json::exception& error) {
    return fail(ErrorCode::kIo, std::string("the service sent invalid settings: ") + error.what());
  }
}

/// A transform of a cloud's description, by its key; nothing if it has none.
std::optional<RigidTransform> transform_of(const json& told, const char* key) {
  const json matrix = told.is_object() ? told.value(key, json()) : json();
  const auto is_number = [](const json& each) { return each.is_number(); };
  if (!matrix.is_array() || matrix.size() != 16 || !std::all_of(matrix.begin(), matrix.end(), is_number)) return {};
  RigidTransform transform;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column)
      transform.rotation(static_cast<int>(row), static_cast<int>(column)) = matrix[4 * row + column];
    transform.translation[static_cast<int>(row)] = matrix[4 * row + 3];
  }
  return transform;
}

/// Reads from its description when a cloud was exposed. A service without `time_ns` tells milliseconds.
std::optional<std::chrono::system_clock::time_point> time_of_exposure(const json& told) {
  if (!told.is_object()) return std::nullopt;
  if (const auto exact = told.find("time_ns"); exact != told.end() && exact->is_number_integer())
    return std::chrono::sys_time<std::chrono::nanoseconds>(std::chrono::nanoseconds(exact->get<std::int64_t>()));
  const auto text = told.find("time");
  return text != told.end() && text->is_string() ? time_from_utc(text->get<std::string>()) : std::nullopt;
}

/// "socket: no service answers there", or the message alone.
std::string text_of(const client::ScannerError& error) {
  return error.where().empty() ? error.what() : error.where() + ": " + error.what();
}

// "tf_late" of "tf_late: ..."
std::string name_of_problem(const std::string& problem) {
  return problem.substr(0, problem.find(':'));
}

/// A camera of the scanner as the network sees it.
struct Camera {
  std::string name;  ///< the name in slsd's configuration
  std::string frame_id;
  std::optional<CalibratedCamera> calibrated;
  Writer info, image, compressed, depth, depth_info;
};

class Running : public Bridge {
 public:
  Running(const BridgeOptions& options, Network network, std::optional<Extrinsics> extrinsics)
      : options_(options),
        network_(std::move(network)),
        extrinsics_(std::move(extrinsics)),
        frame_id_(rig_frame(options.name)) {}

  Result<> open() {
    network_.show_node(options_.name);
    Result<> opened;
    make(points_, ros::PointCloud2::kType, "rt/" + options_.name + "/points", Quality::kSensor, opened);
    if (options_.transforms) make(transforms_, ros::TFMessage::kType, "rt/tf_static", Quality::kLatched, opened);
    make(description_, ros::String::kType, "rt/" + options_.name + "/robot_description", Quality::kLatched, opened);
    make(diagnostics_, ros::DiagnosticArray::kType, "rt/diagnostics", Quality::kService, opened);
    if (!options_.flange.empty()) {
      auto poses = RobotPoses::open(network_, {options_.robot_base, options_.flange});
      if (!poses) return tl::unexpected(poses.error());
      poses_ = std::move(*poses);
    }
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
  void make(Writer& writer, const ros::Type& type, const std::string& topic, Quality quality, Result<>& all) const {
    const auto made = network_.writer(type, topic, quality);
    if (made) writer = *made;
    if (!made && all) all = tl::unexpected(made.error());
  }

  // Receives clouds until the service is gone.
  void stream() {
    try {
      client::StreamOptions options;
      options.rate_hz = options_.rate_hz;
      options.density = options_.density;
      options.shared = true;
      client::Stream stream = client::Scanner(options_.socket).stream(options);
      while (true) (void)publish(stream.next());  // diagnostics tell why one was not
    } catch (const client::ScannerError& error) {
      say(text_of(error));
      std::this_thread::sleep_for(kRetry);
    }
  }

  // Publishes a cloud, unless its place is uncertain; its depth images need none.
  // @errors of base_from_rig()
  Result<> publish(const client::Cloud& cloud) {
    const json told = json::parse(cloud.description, nullptr, false);
    const auto exposed = time_of_exposure(told);
    const auto stamp = exposed ? stamp_of(*exposed) : stamp_now();
    const auto in_base = transform_of(told, "base_from_rig");  // the service has placed the points
    const auto moved = in_base || !poses_ ? RigidTransform() : base_from_rig(told);
    const std::lock_guard lock(mutex_);
    lost_ += cloud.lost;
    // As if the cameras' places were in the frame of the points.
    const auto placed = [&in_base](CalibratedCamera camera) {
      if (in_base) camera.rig_from_camera = in_base->after(camera.rig_from_camera);
      return camera;
    };
    std::vector<CalibratedCamera> cameras;
    std::transform(calibrated_.begin(), calibrated_.end(), std::back_inserter(cameras), placed);
    if (moved) {
      not_placed_.clear();
      const ros::Header of_points{stamp, in_base || poses_ ? options_.robot_base : frame_id_};
      const bool written = points_.write(point_cloud(cloud, of_points, cameras, options_.thinning, *moved));
      ++(written ? published_ : lost_);
      if (!written && !std::exchange(overtaken_, true)) say(kOvertaken);
    } else {
      ++lost_;
      const std::string& why = moved.error().message;
      if (name_of_problem(why) != name_of_problem(not_placed_)) not_placed_ = why;  // the newest numbers are no news
    }
    std::uint8_t index = 0;
    for (Camera& camera : cameras_) {
      const std::uint8_t i = index++;
      if (!camera.calibrated) continue;
      const ros::Header header{stamp, camera.frame_id};
      camera.info.write(camera_info(*camera.calibrated, header));
      if (cloud.has("camera_u")) continue;  // a cloud of symbols has no depth image, so none is announced
      if (auto shown = show_depth(camera); !shown) say(to_string(shown.error()));
      if (!camera.depth.has_readers()) continue;
      camera.depth.write(depth_image(cloud, header, placed(*camera.calibrated), i, options_.thinning.stride));
      camera.depth_info.write(camera_info(*camera.calibrated, header, options_.thinning.stride));
    }
    return moved ? Result<>() : tl::unexpected(moved.error());
  }

  // The rig's place in the robot's base when a cloud was exposed.
  // @errors kNotFound: hand_eye_missing; kMalformed: time_missing; those of RobotPoses::at()
  [[nodiscard]] Result<RigidTransform> base_from_rig(const json& told) const {
    const auto flange_from_rig = transform_of(told, "flange_from_rig");
    if (!flange_from_rig) {
      return fail(
          ErrorCode::kNotFound,
          "hand_eye_missing: the service has no hand-eye calibration for the scanner on the arm, or an old one: "
          "run slsctl hand-eye --mounted arm, set [frame] hand_eye, and run systemctl reload slsd");
    }
    const auto time = time_of_exposure(told);
    if (!time) return fail(ErrorCode::kMalformed, "time_missing: the cloud does not say when it was exposed");
    auto base_from_flange = poses_->at(*time);
    if (!base_from_flange) return base_from_flange;
    return base_from_flange->after(*flange_from_rig);
  }

  Result<> show_depth(Camera& camera) const {
    Result<> made;
    if (camera.depth) return made;
    const std::string topic = "rt/" + options_.name + "/" + ros_name(camera.name) + "/depth";
    make(camera.depth, ros::Image::kType, topic + "/image_raw", Quality::kSensor, made);
    make(camera.depth_info, ros::CameraInfo::kType, topic + "/camera_info", Quality::kSensor, made);
    return made;
  }

  std::pair<bool, std::string> scan() {
    try {
      client::ScanOptions options;
      options.density = options_.density;
      options.colour = options_.colour;
      if (on_arm_) options.coordinate_frame = "rig";  // the robot's pose is known after the exposure, or never
      const client::Cloud cloud = client::Scanner(options_.socket).scan(options);
      if (const auto published = publish(cloud); !published) return {false, published.error().message};
      const std::string why = cloud.why_empty.empty() ? "" : ": " + cloud.why_empty;
      return {true, std::to_string(cloud.size()) + " points, scan " + cloud.scan + why};
    } catch (const client::ScannerError& error) {
      say(text_of(error));
      return {false, (error.name().empty() ? "" : error.name() + ": ") + error.what()};
    }
  }

  std::string not_placed() {
    const std::lock_guard lock(mutex_);
    return not_placed_;
  }

  void tell_state() {
    Diagnosis state{Level::kOk, "ready to scan", {}};
    auto& values = state.values;
    try {
      client::Scanner scanner(options_.socket);
      const json status = json::parse(scanner.status());
      const json settings = json::parse(scanner.settings());
      on_arm_ = settings.value("hand_eye", json::object()).value("mounted", "") == "arm";
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
        state.worse(
            Level::kError,
            "extrinsics_stale: the scanner was recalibrated since: measure its pose again with slsd --extrinsics");
      if (const std::string why = not_placed(); !why.empty())
        state.worse(Level::kError, "the last cloud is not published: " + why);
      publish_images(scanner);
    } catch (const client::ScannerError& error) {
      state.worse(Level::kError, text_of(error));
    } catch (const json::exception& error) {
      state.worse(Level::kError, std::string("the service sent an invalid state: ") + error.what());
    }
    if (network_.other_writers("rt/" + options_.name + "/points") > 0)
      state.worse(Level::kError,
                  "name_taken: another scanner publishes as \"" + options_.name + "\"; rename one of them");
    values.emplace_back("clouds published", std::to_string(published_));
    values.emplace_back("clouds lost before publishing", std::to_string(lost_));
    if (!calibration_date_.empty()) values.emplace_back(kCalibrationDate, calibration_date_);
    if (state.level == Level::kError && state.message != said_) say(said_ = state.message);
    if (state.level == Level::kOk) said_.clear();
    write_diagnosis(diagnostics_, state, options_.name, options_.name + ": slsd");
    std::this_thread::sleep_for(options_.image_rate_hz > 1
                                    ? std::chrono::duration_cast<std::chrono::nanoseconds>(
                                          std::chrono::duration<double>(1 / options_.image_rate_hz))
                                    : std::chrono::nanoseconds(1s));
  }

  // Matches the network's cameras with the service's, and updates all positions.
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
        Camera camera;
        camera.name = name;
        camera.frame_id = cameras_.empty() ? frame_id_ : camera_frame(options_.name, name);
        Result<> made;
        make(camera.info, ros::CameraInfo::kType, topic + "/camera_info", Quality::kSensor, made);
        if (options_.image_rate_hz > 0) {
          make(camera.image, ros::Image::kType, topic + "/image_raw", Quality::kSensor, made);
          make(camera.compressed, ros::CompressedImage::kType, topic + "/image_raw/compressed", Quality::kSensor, made);
        }
        if (!made) return made;
        known = cameras_.insert(cameras_.end(), camera);
      }
      const CalibratedCamera* calibrated = calibration ? calibration->camera(name) : nullptr;
      known->calibrated = calibrated ? std::optional(*calibrated) : std::nullopt;
    }
    calibrated_ = calibration ? calibration->cameras : std::vector<CalibratedCamera>();
    calibration_date_ = calibration ? calibration->report.date.value_or("") : "";
    stale_ = extrinsics_ && calibration && !extrinsics_->calibration_date.empty() &&
             calibration->report.date.value_or("") != extrinsics_->calibration_date;
    std::vector<Device> devices;
    for (const Camera& camera : cameras_) {
      if (camera.calibrated)
        devices.push_back({Device::Kind::kCamera, camera.frame_id, camera.calibrated->rig_from_camera});
    }
    if (calibration) devices.push_back(projector(options_.name, *calibration));
    if (options_.transforms) publish_transforms(devices);
    description_.write(ros::String{robot_description(options_.name, devices, extrinsics_.has_value())});
    return {};
  }

  // If the extrinsics no longer hold, the scanner has no position: none is better than a wrong one.
  void publish_transforms(const std::vector<Device>& devices) const {
    const auto now = stamp_now();
    std::vector<ros::TransformStamped> all;
    if (!extrinsics_) all.push_back(transform(body_frame(options_.name), frame_id_, body_from_rig(), now));
    if (extrinsics_ && !stale_)
      all.push_back(transform(extrinsics_->parent, frame_id_, extrinsics_->parent_from_scanner, now));
    for (const Device& device : devices) {
      if (device.frame_id != frame_id_)
        all.push_back(transform(frame_id_, device.frame_id, device.rig_from_device, now));
    }
    transforms_.write(ros::TFMessage{std::move(all)});
  }

  void publish_images(client::Scanner& scanner) {
    if (options_.image_rate_hz <= 0) return;
    for (const Camera& camera : cameras_) {
      const bool raw = camera.image.has_readers(), compressed = camera.compressed.has_readers();
      if (!raw && !compressed) continue;
      const client::Frame frame = scanner.frame(camera.name);
      const ros::Header header{stamp_now(), camera.frame_id};
      if (raw) camera.image.write(image(frame, header));
      if (compressed) {
        if (const auto jpeg = compressed_image(frame, header)) camera.compressed.write(*jpeg);
      }
      if (camera.calibrated) camera.info.write(camera_info(*camera.calibrated, header));
    }
  }

  void say(const std::string& text) const {
    std::fprintf(stderr, "slsd-dds: %s: %s\n", options_.name.c_str(), text.c_str());
  }

  BridgeOptions options_;
  Network network_;
  std::optional<Extrinsics> extrinsics_;
  std::string frame_id_;
  Writer points_, transforms_, description_, diagnostics_;
  Trigger trigger_;
  std::unique_ptr<RobotPoses> poses_;  ///< only with a flange
  std::mutex mutex_;                   ///< guards the members below, before the threads
  std::list<Camera> cameras_;          ///< only the state thread changes this and the next member
  std::vector<CalibratedCamera> calibrated_;
  std::string calibration_text_, calibration_date_, said_;
  bool stale_ = false;
  bool overtaken_ = false;  ///< a cloud was not published
  std::string not_placed_;  ///< why the last cloud was not, or one before by the same name; empty: it was
  std::atomic<bool> on_arm_{false};
  std::atomic<std::uint64_t> published_{0}, lost_{0};
  std::jthread clouds_, triggers_, state_;
};

}  // namespace

Result<std::string> describe(const BridgeOptions& options, const std::filesystem::path& file) {
  if (auto named = check_name(options); !named) return tl::unexpected(named.error());
  const auto text = file.empty() ? calibration_in_force(options.socket) : read_file(file, kCalibrationBytesMax);
  if (!text) return tl::unexpected(text.error());
  const auto calibration = read_calibration(*text, file.empty() ? "calibration" : file.string());
  if (!calibration) return tl::unexpected(calibration.error());
  return robot_description(options.name, devices(options.name, *calibration), !options.extrinsics.empty());
}

Result<std::unique_ptr<Bridge>> Bridge::start(const BridgeOptions& options, Network network) {
  if (auto named = check_name(options); !named) return tl::unexpected(named.error());
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
                "name_taken: the network already has a scanner of this name; choose another with --name", options.name);
  }
  auto bridge = std::make_unique<Running>(options, std::move(network), std::move(extrinsics));
  if (auto opened = bridge->open(); !opened) return tl::unexpected(opened.error());
  bridge->start();
  return bridge;
}

}  // namespace slsd::dds
