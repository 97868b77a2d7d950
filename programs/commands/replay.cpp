// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <algorithm>
#include <iostream>
#include <optional>
#include <system_error>
#include <variant>

#include <fmt/format.h>

#include "core/calibration_file/calibration_file.hpp"
#include "core/cloud/ply.hpp"
#include "core/printable.hpp"
#include "core/shown_picture.hpp"
#include "daemon/bundle/bundle.hpp"
#include "daemon/scan/cloud/reconstruct.hpp"
#include "drivers/files/file.hpp"
#include "drivers/files/read_image.hpp"
#include "drivers/recording/layout.hpp"
#include "drivers/system/system_error.hpp"
#include "programs/commands/commands.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

Result<> in_file(const Result<>& result, const std::string& file) {
  if (result) return result;
  return fail(result.error().code, result.error().message,
              file + (result.error().where.empty() ? "" : ": " + result.error().where));
}

Result<> write_below(const path& folder, const std::string& name, std::string_view bytes) {
  const path file = folder / name;
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  if (error) return tl::unexpected(system_error(error.value(), "cannot create the folder", file.parent_path()));
  return write_file_atomically(file, bytes);
}

/// Decodes a recording of a bundle again.
class Replay {
 public:
  [[nodiscard]] static Result<Replay> of(const BundledRecording& recording) {
    const auto configuration = read_configuration(recording.configuration, "slsd.toml");
    if (!configuration) return tl::unexpected(configuration.error());
    auto pattern = read_pattern(recording.pattern, "pattern.toml");
    if (!pattern) return tl::unexpected(pattern.error());
    std::optional<Calibration> calibration;
    if (!recording.calibration.empty()) {
      auto read = read_calibration(recording.calibration, "calibration.yml");
      if (!read) return tl::unexpected(read.error());
      calibration = std::move(*read);
    }
    auto setup = ScanSetup::of(std::move(*pattern), std::move(calibration), *configuration, 1);
    if (!setup) return tl::unexpected(setup.error());
    setup->hand_eye = HandEyeCalibration{};  // each scan tells where the rig was, as if the rig were the flange
    return Replay(std::move(*setup));
  }

  [[nodiscard]] Result<ScanResult> decode(const BundledScan& scan) {
    ScanRequest request;
    request.formats = CloudFormats::only({CloudFormat::kPly, scan.dense ? Density::kPixels : Density::kSymbols});
    request.part = scan.part;
    request.base_from_flange = scan.base_from_rig;
    if (auto possible = setup_.check(request); !possible) return tl::unexpected(possible.error());
    images_.clear();
    FrameSet set;
    for (auto [light, frames] : {std::pair(Picture::kPattern, &set.frames), std::pair(Picture::kWhite, &set.white),
                                 std::pair(Picture::kBlack, &set.dark)}) {
      if (auto read = read_frames(scan, light_name(light), *frames); !read) return tl::unexpected(read.error());
    }
    if (set.frames.empty()) return fail(ErrorCode::kMalformed, "a scan has only white or dark frames");
    // As during the recording: a level from an earlier frame also holds for later ones.
    setup_.full_levels = std::make_unique<FullLevels>();
    for (std::size_t i = 0; i < std::min(scan.full_levels.size(), set.frames.size()); ++i)
      (void)setup_.full_levels->raise(i, scan.full_levels[i]);
    auto result = reconstruct(set, setup_, 0, request, scan.id);
    if (!result) return result;
    result->cloud.time = scan.time;
    if (result->dense) {
      auto dense = std::make_shared<DenseCloud>(*result->dense);
      dense->time = scan.time;
      result->dense = std::move(dense);
    }
    return result;
  }

 private:
  explicit Replay(ScanSetup setup) : setup_(std::move(setup)) {}

  // None, or one for each camera, in their order.
  [[nodiscard]] Result<> read_frames(const BundledScan& scan, std::string_view light, std::vector<Frame>& frames) {
    for (const BundledFrame& frame : scan.frames) {
      if (frame.light != light) continue;
      if (frames.size() == setup_.camera_names.size() || frame.camera != setup_.camera_names[frames.size()])
        return fail(ErrorCode::kMalformed, "frames are not in the order of the cameras");
      auto image = decode_image(frame.png, "a frame of camera " + printable(frame.camera));
      if (!image) return tl::unexpected(image.error());
      images_.push_back(std::make_unique<GreyImage>(std::move(*image)));
      const GreyView view = std::visit([](const auto& pixels) -> GreyView { return pixels.view(); }, *images_.back());
      frames.emplace_back(view, frame.sequence, MonotonicTime(), MonotonicTime());
    }
    if (!frames.empty() && frames.size() != setup_.camera_names.size())
      return fail(ErrorCode::kMalformed, "the frame of a camera is missing");
    return {};
  }

  ScanSetup setup_;
  std::vector<std::unique_ptr<GreyImage>> images_;  // of the scan being decoded
};

/// Decodes a recording's scans, reports, and writes the results. @return the number of clouds that differ
Result<int> replay(const BundledRecording& recording, const path& folder) {
  auto decoder = Replay::of(recording);
  if (!decoder) return tl::unexpected(decoder.error());
  int different = 0;
  std::uint64_t framed = 0;
  for (const BundledScan& scan : recording.scans) {
    const std::string name = recording.name + "  scan " + scan.id;
    const std::string failed = scan.error.empty() ? "" : " failed (" + scan.error + ")";
    if (scan.frames.empty()) {
      std::cout << name << failed << ": without frames\n";
      continue;
    }
    const std::uint64_t number = framed++;
    const auto result = decoder->decode(scan);
    if (!result && result.error().code == ErrorCode::kMalformed) return tl::unexpected(result.error());
    if (!result) {
      const bool same = to_string(result.error().code) == scan.error;
      different += same ? 0 : 1;
      std::cout << name << failed << ": fails " << (same ? "again: " : "now: ") << to_string(result.error()) << "\n";
      continue;
    }
    const std::string ply = write_ply(result->cloud);
    const bool same = scan.cloud == ply;
    different += scan.cloud && !same ? 1 : 0;
    std::cout << fmt::format("{}{}: {} points{}, {}\n", name, failed, result->cloud.points.size(),
                             result->dense ? fmt::format(" and {} of pixels", result->dense->points()) : "",
                             !scan.cloud ? "no cloud to compare with"
                             : same      ? "the same cloud, byte for byte"
                                         : "DIFFERENT from the bundle's cloud");
    if (folder.empty()) continue;
    Result<> written = write_below(folder, recording.name + "/replayed/" + numbered(number, ".ply"), ply);
    if (written && result->dense) {
      StringSink dense;
      write_dense_ply(*result->dense, /*normals=*/false, nullptr, dense);
      written = write_below(folder, recording.name + "/replayed/" + numbered(number, ".dense.ply"), dense.bytes());
    }
    if (!written) return tl::unexpected(written.error());
  }
  return different;
}

}  // namespace

Result<> replay_bundle(const path& file, const path& folder) {
  const auto bytes = read_file(file, kBundleBytesMax);
  if (!bytes) return tl::unexpected(bytes.error());
  const auto bundle = read_bundle(*bytes);
  if (!bundle) return in_file(tl::unexpected(bundle.error()), file.string());
  std::cout << "bundle of slsd " << bundle->version << ", written " << bundle->written
            << (bundle->reason.empty() ? "" : ": " + bundle->reason) << "\n";
  std::error_code error;
  if (!folder.empty() && std::filesystem::exists(folder, error)) {
    return fail(ErrorCode::kAlreadyExists, "already exists: give a new folder", folder.string());
  }
  for (const TarFile& each : bundle->files) {
    if (folder.empty()) break;
    if (auto written = write_below(folder, each.name, each.bytes); !written) return written;
  }
  int different = 0;
  for (const BundledRecording& recording : bundle->recordings) {
    const auto replayed = replay(recording, folder);
    if (!replayed) return in_file(tl::unexpected(replayed.error()), file.string() + ", " + recording.name);
    different += *replayed;
  }
  if (different == 0) return {};
  return fail(ErrorCode::kMismatch,
              std::to_string(different) + " scan(s) differ from the bundle" +
                  (bundle->version == SLSD_VERSION ? "" : ", which slsd wrote in version " + bundle->version),
              file.string());
}

}  // namespace slsd
