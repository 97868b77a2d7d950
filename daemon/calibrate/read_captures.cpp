// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/calibrate/read_captures.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "daemon/calibrate/captured_pictures.hpp"
#include "drivers/files/read_image.hpp"

namespace slsd {
namespace {

ImageSize size_of(const GreyImage& image) {
  return std::visit([](const auto& pixels) { return ImageSize{pixels.width(), pixels.height()}; }, image);
}

/// The size that all pictures of a camera have, known from the first.
Result<> check_size(const GreyImage& image, const std::filesystem::path& file, ImageSize& size) {
  const ImageSize own = size_of(image);
  if (size == ImageSize{}) size = own;
  if (own == size) return {};
  return fail(
      ErrorCode::kMismatch,
      fmt::format("has {}x{} pixels, the pictures before it {}x{}: all have to come from one camera in one mode",
                  own.width_px, own.height_px, size.width_px, size.height_px),
      file.string());
}

Result<CapturedPictures> load(const CaptureFiles& files, bool gray_code, ImageSize& size) {
  CapturedPictures pictures;
  const auto read = [&](const std::filesystem::path& file, GreyImage& image) -> Result<> {
    auto decoded = read_image(file);
    if (!decoded) return tl::unexpected(decoded.error());
    image = std::move(*decoded);
    return check_size(image, file, size);
  };
  if (auto white = read(files.white, pictures.white); !white) return tl::unexpected(white.error());
  const std::vector<std::filesystem::path> coded = gray_code ? files.gray : std::vector{files.pattern};
  for (const auto& file : coded) {
    if (auto image = read(file, pictures.coded.emplace_back()); !image) return tl::unexpected(image.error());
  }
  if (gray_code && !files.black.empty()) {
    if (auto black = read(files.black, pictures.black.emplace()); !black) return tl::unexpected(black.error());
  }
  return pictures;
}

Result<> check_files(const CaptureFiles& files, bool gray_code) {
  if (!(gray_code ? files.gray.empty() : files.pattern.empty())) return {};
  return fail(ErrorCode::kNotFound,
              gray_code ? "has no gray_00.png ..., unlike other poses" : "has no pattern.png, unlike other poses");
}

/// Reads one pose after the other.
class CaptureReader {
 public:
  CaptureReader(const std::vector<std::string>& names, bool gray_code, PoseObservers& observers,
                const std::function<void(const std::string&)>& report)
      : names_(names), gray_code_(gray_code), observers_(observers), report_(report) {
    for (const std::string& name : names) captures.observations.cameras.push_back({name, {}});
  }

  Result<> read_pose(const CapturedPose& pose) {
    PoseObservation observation{pose.name, {}, pose.subject};
    std::string reasons;
    for (const auto& [folder, files] : pose.cameras) {
      const auto at = folder.empty() ? names_.begin() : std::ranges::find(names_, folder);
      if (at == names_.end())
        return fail(ErrorCode::kNotFound, "is the folder of no camera", files.white.parent_path());
      const auto camera = static_cast<std::size_t>(at - names_.begin());
      const auto pictures = read_pictures(files, camera);
      if (!pictures && pictures.error().code == ErrorCode::kMismatch) return tl::unexpected(pictures.error());
      auto view = pictures ? observers_.of(pose.subject).observe(camera, pictures->views())
                           : Result<PoseView>(tl::unexpected(pictures.error()));
      tell(names_.size() > 1 ? pose.name + " " + *at : pose.name, view);
      if (!view) reasons += (reasons.empty() ? "" : "; ") + to_string(view.error());
      if (view) observation.views.push_back(std::move(*view));
    }
    if (observation.views.empty()) {
      PoseReport& refused = captures.refused.emplace_back();
      refused.name = pose.name, refused.subject = pose.subject;
      refused.fault = PoseFault::kNotSeen, refused.reason = reasons;
    } else {
      captures.observations.poses.push_back(std::move(observation));
    }
    return {};
  }

  ReadCaptures captures;

 private:
  Result<CapturedPictures> read_pictures(const CaptureFiles& files, std::size_t camera) {
    if (auto complete = check_files(files, gray_code_); !complete) return tl::unexpected(complete.error());
    return load(files, gray_code_, captures.observations.cameras[camera].size);
  }

  void tell(const std::string& who, const Result<PoseView>& view) const {
    report_(view ? fmt::format("{}: {} corners, {} symbols", who, view->corners.size(), view->symbols.size())
                 : fmt::format("{}: not used: {}", who, to_string(view.error())));
  }

  const std::vector<std::string>& names_;
  bool gray_code_;
  PoseObservers& observers_;
  const std::function<void(const std::string&)>& report_;
};

}  // namespace

Result<ReadCaptures> read_captures(const std::vector<CapturedPose>& poses, const std::vector<std::string>& names,
                                   const ImageSize& projector, bool gray_code, PoseObservers& observers,
                                   const std::function<void(const std::string&)>& report) {
  CaptureReader reader(names, gray_code, observers, report);
  reader.captures.observations.projector = projector;
  for (const CapturedPose& pose : poses) {
    if (auto read = reader.read_pose(pose); !read) return tl::unexpected(read.error());
  }
  return std::move(reader.captures);
}

}  // namespace slsd
