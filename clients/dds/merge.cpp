// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "merge.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <optional>
#include <stop_token>
#include <system_error>
#include <thread>
#include <utility>

#include "drivers/files/file.hpp"
#include "endpoints.hpp"
#include "extrinsics.hpp"
#include "messages.hpp"

namespace slsd::dds {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using ros::PointCloud2;
using ros::PointField;

constexpr auto kDiscovery = 2000ms;
constexpr auto kHearing = 3s;   // for diagnostics, which come each second
constexpr auto kScanMax = 15s;  // a triggered scanner's limit
constexpr std::size_t kExtrinsicsBytesMax = 1 << 20;
constexpr std::uint32_t kPointsMax = 100'000'000;

double seconds_of(const ros::Time& stamp) {
  return stamp.sec + 1e-9 * stamp.nanosec;
}

/// The offsets of the merged fields in a point of another cloud.
struct Layout {
  std::uint32_t x = 0, y = 0, z = 0;
  std::optional<std::uint32_t> sigma, intensity, byte_intensity, camera;
};

Result<Layout> malformed(const std::string& how) {
  return fail(ErrorCode::kMalformed, "cloud_malformed: its cloud " + how);
}

// A message describes its own fields; every value is checked.
Result<Layout> layout_of(const PointCloud2& cloud, const std::string& frame_id) {
  if (cloud.header.frame_id != frame_id) return malformed("is not in the frame " + frame_id);
  if (cloud.is_bigendian) return malformed("is big-endian");
  const std::uint64_t row = std::uint64_t{cloud.width} * cloud.point_step;
  if (std::uint64_t{cloud.width} * cloud.height > kPointsMax || row > cloud.row_step ||
      std::uint64_t{cloud.row_step} * cloud.height > cloud.data.size()) {
    return malformed("has fewer bytes than its header says");
  }
  const auto offset = [&](const char* name, std::uint8_t type, std::uint32_t size) -> std::optional<std::uint32_t> {
    for (const PointField& field : cloud.point_fields) {
      if (field.name == name && field.datatype == type && field.count == 1 &&
          std::uint64_t{field.offset} + size <= cloud.point_step) {
        return field.offset;
      }
    }
    return std::nullopt;
  };
  const auto x = offset("x", PointField::kFloat32, 4), y = offset("y", PointField::kFloat32, 4),
             z = offset("z", PointField::kFloat32, 4);
  if (!x || !y || !z) return malformed("has points without x, y, z");
  return Layout{*x,
                *y,
                *z,
                offset("sigma", PointField::kFloat32, 4),
                offset("intensity", PointField::kFloat32, 4),
                offset("intensity", PointField::kUint8, 1),
                offset("camera", PointField::kUint8, 1)};
}

/// A scanner whose clouds are merged.
struct Source {
  std::string name, frame_id;
  Reader reader;
  Extrinsics extrinsics;
  std::optional<std::string> calibration_date;  ///< the date in its diagnostics; empty: not received yet
  std::string problem;                          ///< problem of the newest cloud; empty: none
  std::vector<std::uint8_t> points;             ///< published points, in the common frame
  ros::Time stamp{};
  Clock::time_point arrived{};  ///< arrival of the newest cloud, whether placed or not
  bool fresh = false;           ///< a cloud waits to be merged
  std::uint64_t clouds = 0;     ///< clouds that were placed

  [[nodiscard]] std::string why_not_placed() const {
    if (extrinsics.calibration_date.empty()) return {};
    if (!calibration_date) return "extrinsics_unknown: its diagnostics lack the calibration date";
    if (*calibration_date != extrinsics.calibration_date)
      return "extrinsics_stale: the scanner was recalibrated since: measure its pose again with slsd --extrinsics";
    return {};
  }
};

class Running : public Merge {
 public:
  Running(MergeOptions options, Network network, std::vector<Source> sources)
      : options_(std::move(options)), network_(std::move(network)), sources_(std::move(sources)) {}

  Result<> open() {
    network_.show_node(options_.name);
    for (Source& source : sources_) {
      const auto reader = network_.reader(PointCloud2::kType, "rt/" + source.name + "/points", Quality::kSensor);
      const auto trigger = network_.writer(ros::Empty::kType, "rt/" + source.name + "/trigger", Quality::kService);
      if (!reader) return tl::unexpected(reader.error());
      if (!trigger) return tl::unexpected(trigger.error());
      source.reader = *reader;
      triggers_of_.push_back(*trigger);
    }
    const auto& diagnosis = ros::DiagnosticArray::kType;
    const auto points = network_.writer(PointCloud2::kType, "rt/" + options_.name + "/points", Quality::kSensor);
    const auto diagnostics = network_.writer(diagnosis, "rt/diagnostics", Quality::kService);
    const auto heard = network_.reader(diagnosis, "rt/diagnostics", Quality::kService);
    if (!points || !diagnostics) return tl::unexpected((points ? diagnostics : points).error());
    if (!heard) return tl::unexpected(heard.error());
    points_ = *points, diagnostics_ = *diagnostics, heard_ = *heard;
    const auto trigger = Trigger::open(network_, options_.name);
    if (!trigger) return tl::unexpected(trigger.error());
    trigger_ = *trigger;
    std::error_code error;
    extrinsics_written_ = std::filesystem::last_write_time(options_.extrinsics, error);
    return {};
  }

  void start() {
    merging_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) read_and_merge();
    });
    triggers_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) trigger_.answer([this] { return scan_all(); });
    });
    state_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) tell_state();
    });
  }

 private:
  void read_and_merge() {
    std::vector<Reader> readers{heard_};
    for (const Source& source : sources_) readers.push_back(source.reader);
    network_.wait_for(readers, 100ms);
    const std::lock_guard lock(mutex_);
    hear_diagnostics();
    for (Source& source : sources_) take_newest(source);
    if (!triggered_) publish_when_whole();
    changed_.notify_all();
  }

  void hear_diagnostics() {
    while (const auto sample = heard_.take()) {
      const auto array = decode<ros::DiagnosticArray>(sample->bytes);
      if (!array) continue;
      for (const auto& status : array->status) {
        for (Source& source : sources_) {
          if (source.name + ": slsd" != status.name) continue;
          source.calibration_date.emplace();
          for (const auto& [key, value] : status.values) {
            if (key == kCalibrationDate) source.calibration_date = value;
          }
        }
      }
    }
  }

  void take_newest(Source& source) {
    std::optional<Sample> newest;
    while (auto sample = source.reader.take()) newest = std::move(sample);
    if (newest) take(source, newest->bytes);
  }

  void take(Source& source, const Bytes& bytes) {
    source.arrived = Clock::now();
    source.fresh = false;
    source.problem.clear();
    if (const int writers = source.reader.writer_count(); writers > 1) {
      source.problem = "name_taken: " + std::to_string(writers) + " scanners publish under this name";
    } else {
      source.problem = source.why_not_placed();
    }
    if (!source.problem.empty()) return;
    const auto cloud = decode<PointCloud2>(bytes);
    const auto layout = cloud ? layout_of(*cloud, source.frame_id) : malformed("is not a PointCloud2");
    if (!layout) {
      source.problem = layout.error().message;
      return;
    }
    place(source, *cloud, *layout);
    source.stamp = cloud->header.stamp;
    source.fresh = true;
    ++source.clouds;
  }

  void place(Source& source, const PointCloud2& cloud, const Layout& at) {
    const RigidTransform& pose = source.extrinsics.parent_from_scanner;
    const Eigen::Matrix3f turn = pose.rotation.cast<float>();
    const Eigen::Vector3f shift = (pose.translation / 1000).cast<float>();
    const auto index = static_cast<std::uint8_t>(&source - sources_.data());
    source.points.resize(std::size_t{kPointStep} * cloud.width * cloud.height);
    std::uint8_t* to = source.points.data();
    for (std::uint32_t v = 0; v < cloud.height; ++v) {
      const std::uint8_t* from = cloud.data.data() + std::size_t{cloud.row_step} * v;
      for (std::uint32_t u = 0; u < cloud.width; ++u, from += cloud.point_step) {
        Eigen::Vector3f point;
        std::memcpy(&point.x(), from + at.x, 4);
        std::memcpy(&point.y(), from + at.y, 4);
        std::memcpy(&point.z(), from + at.z, 4);
        if (!point.allFinite()) continue;
        point = (turn * point + shift).eval();
        float sigma = 0;
        if (at.sigma) std::memcpy(&sigma, from + *at.sigma, 4);
        std::memcpy(to, point.data(), 12);
        std::memcpy(to + 12, &sigma, 4);
        float intensity = at.byte_intensity ? from[*at.byte_intensity] : 0;
        if (at.intensity) std::memcpy(&intensity, from + *at.intensity, 4);
        std::memcpy(to + 16, &intensity, 4);
        to[20] = at.camera ? from[*at.camera] : 0;
        to[21] = index;
        to[22] = to[23] = 0;
        to += kPointStep;
      }
    }
    source.points.resize(static_cast<std::size_t>(to - source.points.data()));
  }

  // Tells whether every active scanner has a new cloud, or one cloud has waited for its maximum time.
  void publish_when_whole() {
    const auto now = Clock::now();
    bool whole = true, any = false, waited = false;
    for (const Source& source : sources_) {
      const bool sends = source.clouds > 0 && now - source.arrived < options_.max_age;
      if (sends && !source.fresh && source.problem.empty()) whole = false;
      any = any || source.fresh;
      waited = waited || (source.fresh && now - source.arrived > options_.max_age / 2);
    }
    if (any && (whole || waited)) publish(options_.max_age.count());
  }

  /// @param max_age_s  the greatest age of a part relative to the newest
  std::size_t publish(double max_age_s) {
    double newest = -INFINITY;
    for (const Source& source : sources_) {
      if (source.fresh) newest = std::max(newest, seconds_of(source.stamp));
    }
    std::vector<std::uint8_t> merged;
    ros::Time oldest{};
    std::size_t parts = 0;
    for (Source& source : sources_) {
      if (!source.fresh) continue;
      source.fresh = false;
      if (newest - seconds_of(source.stamp) > max_age_s) {
        source.problem =
            "cloud_old: its cloud is older than the others by more than --max-age; check that the clocks agree";
        continue;
      }
      if (parts == 0 || seconds_of(source.stamp) < seconds_of(oldest)) oldest = source.stamp;
      merged.insert(merged.end(), source.points.begin(), source.points.end());
      ++parts;
    }
    PointCloud2 message;
    message.header = {oldest, sources_.front().extrinsics.parent};
    point_count_ = merged.size() / kPointStep;
    set_points(message, PointKind::kMerged, std::move(merged));
    const bool written = points_.write(message);
    if (written) ++published_;
    if (!written && !std::exchange(overtaken_, true)) say(kOvertaken);
    return parts;
  }

  // One after another, because their light would interfere.
  std::pair<bool, std::string> scan_all() {
    std::unique_lock lock(mutex_);
    triggered_ = true;
    std::string failed;
    changed_.wait_for(lock, kHearing, [this] {
      return std::all_of(sources_.begin(), sources_.end(), [](const Source& one) { return one.calibration_date; });
    });
    for (Source& source : sources_) source.fresh = false;
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      const Source& source = sources_[i];
      const auto asked = Clock::now();
      triggers_of_[i].write(ros::Empty{});
      const bool came = changed_.wait_for(lock, kScanMax, [&] { return source.arrived > asked; });
      if (!came || !source.problem.empty())
        failed += (failed.empty() ? "" : "; ") + source.name + ": " + (came ? source.problem : "no cloud in 15 s");
    }
    const auto count = failed.empty() ? publish(INFINITY) : 0;
    for (Source& source : sources_) source.fresh = false;
    triggered_ = false;
    if (!failed.empty()) return {false, failed};
    return {true, std::to_string(point_count_) + " points of " + std::to_string(count) + " scanners"};
  }

  // Reads a changed file again; a broken one leaves the previous extrinsics in force.
  std::string follow_extrinsics() {
    std::error_code error;
    const auto written = std::filesystem::last_write_time(options_.extrinsics, error);
    if (error) return "extrinsics_missing: " + options_.extrinsics.string() + " is gone";
    if (written == extrinsics_written_) return extrinsics_problem_;
    extrinsics_written_ = written;
    extrinsics_problem_.clear();
    const auto text = read_file(options_.extrinsics, kExtrinsicsBytesMax);
    std::vector<Extrinsics> all;
    for (const Source& source : sources_) {
      auto read = text ? read_extrinsics(*text, source.name, options_.extrinsics.string())
                       : Result<Extrinsics>(tl::unexpected(text.error()));
      if (!read) return extrinsics_problem_ = to_string(read.error()) + "; the previous ones stay in force";
      all.push_back(std::move(*read));
    }
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < sources_.size(); ++i) {
      sources_[i].extrinsics = std::move(all[i]);
      sources_[i].fresh = false;
    }
    return {};
  }

  void tell_state() {
    Diagnosis state{Level::kOk, "merging", {}};
    if (const std::string problem = follow_extrinsics(); !problem.empty()) state.worse(Level::kError, problem);
    {
      const std::lock_guard lock(mutex_);
      const auto now = Clock::now();
      for (const Source& source : sources_) {
        std::string told = "merged";
        const auto silent = std::chrono::duration_cast<std::chrono::seconds>(now - source.arrived);
        if (source.arrived == Clock::time_point()) {
          told = source.why_not_placed();
          if (told.empty()) told = "no cloud yet";
          state.worse(Level::kWarn, source.name + ": " + told);
        } else if (!source.problem.empty()) {
          told = source.problem;
          state.worse(Level::kError, source.name + ": " + source.problem);
        } else if (silent > std::max(std::chrono::duration<double>(5s), 2 * options_.max_age)) {
          told = "no cloud for " + std::to_string(silent.count()) + " s";
          state.worse(Level::kWarn, source.name + ": no longer sends clouds");
        }
        state.values.emplace_back(source.name, told);
      }
      state.values.emplace_back("clouds published", std::to_string(published_));
    }
    if (network_.other_writers("rt/" + options_.name + "/points") > 0)
      state.worse(Level::kError,
                  "name_taken: another program publishes as \"" + options_.name + "\"; rename one of them");
    if (state.level == Level::kError && state.message != said_) say(said_ = state.message);
    if (state.level == Level::kOk) said_.clear();
    write_diagnosis(diagnostics_, state, options_.name, options_.name + ": slsd merge");
    std::this_thread::sleep_for(1s);
  }

  void say(const std::string& text) const {
    std::fprintf(stderr, "slsd-dds: %s: %s\n", options_.name.c_str(), text.c_str());
  }

  MergeOptions options_;
  Network network_;
  Writer points_, diagnostics_;
  Reader heard_;
  std::vector<Writer> triggers_of_;  ///< one for each source
  Trigger trigger_;
  std::filesystem::file_time_type extrinsics_written_;  ///< only the state thread uses this and the two below
  std::string extrinsics_problem_, said_;
  std::mutex mutex_;  ///< guards the members below, before the threads
  std::condition_variable changed_;
  std::vector<Source> sources_;
  std::size_t point_count_ = 0;  ///< points of the newest merged cloud
  bool triggered_ = false;
  bool overtaken_ = false;  ///< a cloud was not published
  std::uint64_t published_ = 0;
  std::jthread merging_, triggers_, state_;
};

}  // namespace

Result<std::unique_ptr<Merge>> Merge::start(const MergeOptions& options, Network network) {
  if (!is_ros_name(options.name)) {
    return fail(ErrorCode::kInvalidArgument, "a ROS name has letters, digits and _, and begins with a letter",
                options.name);
  }
  if (options.extrinsics.empty()) {
    return fail(ErrorCode::kInvalidArgument,
                "extrinsics_missing: --merge needs --extrinsics FILE; slsd --extrinsics FILE measures one");
  }
  const std::string file = options.extrinsics.string();
  const auto text = read_file(options.extrinsics, kExtrinsicsBytesMax);
  if (!text) return fail(text.error().code, "extrinsics_missing: " + text.error().message, file);
  std::vector<std::string> names = options.scanners;
  if (names.empty()) {
    auto all = scanners_in(*text, file);
    if (!all) return tl::unexpected(all.error());
    names = std::move(*all);
  }
  std::vector<Source> sources;
  for (const std::string& name : names) {
    auto read = read_extrinsics(*text, name, file);
    if (!read) return tl::unexpected(read.error());
    if (!is_ros_name(name) || name == options.name || sources.size() == 256)
      return fail(ErrorCode::kInvalidArgument, "is not a valid name of a scanner to merge", name);
    Source& source = sources.emplace_back();
    source.name = name;
    source.frame_id = name + "_optical_frame";
    source.extrinsics = std::move(*read);
  }
  if (sources.size() < 2) {
    return fail(ErrorCode::kNotFound, "extrinsics_missing: the file names fewer than two scanners to merge", file);
  }
  std::this_thread::sleep_for(kDiscovery);
  if (network.other_writers("rt/" + options.name + "/points") > 0) {
    return fail(ErrorCode::kAlreadyExists, "name_taken: the network already has this name; choose another with --name",
                options.name);
  }
  auto merge = std::make_unique<Running>(options, std::move(network), std::move(sources));
  if (auto opened = merge->open(); !opened) return tl::unexpected(opened.error());
  merge->start();
  return merge;
}

}  // namespace slsd::dds
