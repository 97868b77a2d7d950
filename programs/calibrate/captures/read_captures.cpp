// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/captures/read_captures.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "core/image_size.hpp"
#include "drivers/files/read_image.hpp"
#include "programs/calibrate/captures/captured_pictures.hpp"

namespace slsd {
namespace {

bool is_jpeg(const std::filesystem::path& file) {
  const std::string extension = extension_of(file);
  return extension == ".jpg" || extension == ".jpeg";
}

std::string size_text(const ImageSize& size) {
  return slsd::size_text(size.width_px, size.height_px);
}

Result<CapturedPictures> load(const CaptureFiles& files, bool gray_code) {
  CapturedPictures pictures;
  ImageSize size;
  const auto read = [&](const std::filesystem::path& file, GreyImage& image) -> Result<> {
    auto decoded = read_image(file);
    if (!decoded) return tl::unexpected(decoded.error());
    image = std::move(*decoded);
    const ImageSize own = size_of(image);
    if (size == ImageSize{}) size = own;
    if (own == size) return {};
    return fail(ErrorCode::kMismatch,
                fmt::format("has {} pixels, but the pictures before it have {}: take all with one camera in one mode",
                            size_text(own), size_text(size)),
                file.string());
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
  if (files.lack) return tl::unexpected(*files.lack);
  if (!(gray_code ? files.gray.empty() : files.pattern.empty())) return {};
  return fail(ErrorCode::kNotFound,
              gray_code ? "has no gray_00.png ..., unlike other poses" : "has no pattern.png, unlike other poses");
}

/// Reads the poses one by one.
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
      if (at == names_.end()) {
        return fail(ErrorCode::kNotFound, "matches no configured camera", files.white.parent_path().string());
      }
      const auto camera = static_cast<std::size_t>(at - names_.begin());
      auto view = look(pose, camera, files);
      tell(names_.size() > 1 ? pose.name + " " + *at : pose.name, view);
      if (!view) reasons += (reasons.empty() ? "" : "; ") + to_string(view.error());
      if (view) observation.views.push_back(std::move(*view));
    }
    if (observation.views.empty()) {
      refuse(observation, PoseFault::kNotSeen, reasons);
    } else {
      captures.observations.poses.push_back(std::move(observation));
    }
    return {};
  }

  /// Checks what only all poses together show: the sizes of a camera's pictures, and patterns that belong to other
  /// poses.
  void compare() {
    take_usual_sizes();
    name_swapped();
    name_copied();
    if (jpegs_ == 0) return;
    report_(
        fmt::format("warning: {} of the pictures are JPEG, whose compression shifts edges: calibrate with PNG or raw "
                    "pictures if the camera supports them",
                    jpegs_));
  }

  ReadCaptures captures;

 private:
  static constexpr std::size_t kDoubtsMax = 12;  // with more, the light hides the print
  struct Look {
    std::string pose;
    std::size_t camera;
    PoseSubject subject;
    const CaptureFiles* files;
  };

  Result<PoseView> look(const CapturedPose& pose, std::size_t camera, const CaptureFiles& files) {
    if (auto complete = check_files(files, gray_code_); !complete) return tl::unexpected(complete.error());
    const auto pictures = load(files, gray_code_);
    if (!pictures) return tl::unexpected(pictures.error());
    std::vector<std::filesystem::path> all = gray_code_ ? files.gray : std::vector{files.pattern};
    all.push_back(files.white);
    jpegs_ += static_cast<std::size_t>(std::ranges::count_if(all, [](const auto& file) { return is_jpeg(file); }));
    sizes_[{pose.name, camera}] = size_of(pictures->white);
    auto view = observers_.of(pose.subject).observe(camera, pictures->views());
    if (!gray_code_) looks_.push_back({pose.name, camera, pose.subject, &files});
    if (!gray_code_ && !shows_own_print(pose.subject, view, *pictures)) doubts_.push_back(looks_.back());
    return view;
  }

  /// Also a camera that reads nothing of the pattern may show that the picture belongs to the pose.
  [[nodiscard]] bool shows_own_print(PoseSubject subject, const Result<PoseView>& seen,
                                     const CapturedPictures& pictures) {
    if (seen) return seen->shift_px.has_value();
    return observers_.of(subject).print_shift(view(pictures.white), view(pictures.coded.front())).certain();
  }

  void refuse(const PoseObservation& pose, PoseFault fault, const std::string& reason) {
    PoseReport& refused = captures.refused.emplace_back();
    refused.name = pose.name, refused.subject = pose.subject, refused.fault = fault, refused.reason = reason;
  }

  /// Rules a pose out, for a reason that replaces any earlier one.
  void rule_out(const std::string& name, PoseFault fault, const std::string& reason) {
    const auto refused = std::ranges::find(captures.refused, name, &PoseReport::name);
    if (refused != captures.refused.end()) refused->fault = fault, refused->reason = reason;
    auto& poses = captures.observations.poses;
    const auto at = std::ranges::find(poses, name, &PoseObservation::name);
    if (at != poses.end()) refuse(*at, fault, reason), poses.erase(at);
    report_(fmt::format("{}: not used: {}", name, reason));
  }

  /// Takes the size of most poses; a pose with another size is left out.
  void take_usual_sizes() {
    auto& cameras = captures.observations.cameras;
    for (std::size_t camera = 0; camera < cameras.size(); ++camera) {
      std::map<std::pair<int, int>, int> counts;
      for (const auto& [look, size] : sizes_) {
        if (look.second == camera) ++counts[{size.width_px, size.height_px}];
      }
      const auto most = std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; });
      if (most != counts.end()) cameras[camera].size = {most->first.first, most->first.second};
    }
    for (const auto& [look, own] : sizes_) {
      const std::string& name = look.first;
      const std::size_t camera = look.second;
      if (own == cameras[camera].size) continue;
      const std::string reason = fmt::format(
          "its pictures have {} pixels, but those of the other poses have {}: take all with one camera in one mode",
          size_text(own), size_text(cameras[camera].size));
      const auto at = std::ranges::find(captures.observations.poses, name, &PoseObservation::name);
      const bool taken = at != captures.observations.poses.end();
      if (taken) std::erase_if(at->views, [&](const PoseView& view) { return view.camera == camera; });
      if (taken && !at->views.empty()) {
        report_(fmt::format("{} {}: not used: {}", name, names_[camera], reason));
      } else {
        rule_out(name, PoseFault::kNotSeen, reason);
      }
    }
  }

  /// Rules out poses whose pattern picture belongs to another doubtful pose: its print lies where that pose's white
  /// picture has it.
  void name_swapped() {
    if (doubts_.size() < 2 || doubts_.size() > kDoubtsMax) return;
    for (const Look& doubt : doubts_) {
      const auto white = read_image(doubt.files->white);
      for (const Look& other : doubts_) {
        if (&other == &doubt || other.camera != doubt.camera || !white) continue;
        const auto pattern = read_image(other.files->pattern);
        if (!pattern) continue;
        if (!observers_.of(doubt.subject).print_shift(view(*white), view(*pattern)).certain()) continue;
        const std::string reason = fmt::format(
            "its pattern picture belongs to another pose, and {} has the one of this pose: swap them back", other.pose);
        rule_out(doubt.pose, PoseFault::kSwapped, reason);
      }
    }
  }

  /// Rules out poses whose pattern picture is a copy: its print lies where another pose, with a pattern of its own, has
  /// it.
  void name_copied() {
    if (doubts_.size() > kDoubtsMax) return;
    for (const Look& doubt : doubts_) {
      if (is_explained(doubt.pose)) continue;
      const auto pattern = read_image(doubt.files->pattern);
      for (const Look& other : looks_) {
        if (other.pose == doubt.pose || other.camera != doubt.camera || !pattern) continue;
        const auto white = read_image(other.files->white);
        if (!white || !observers_.of(doubt.subject).print_shift(view(*white), view(*pattern)).certain()) continue;
        rule_out(doubt.pose, PoseFault::kSwapped,
                 fmt::format("its pattern picture copies that of {}, or shows the same pose: take the pose again",
                             other.pose));
        break;
      }
    }
  }

  /// Light that hides the pattern hides the print too.
  [[nodiscard]] bool is_explained(const std::string& pose) const {
    return std::ranges::any_of(captures.refused, [&](const PoseReport& report) {
      return report.name == pose && (report.fault == PoseFault::kSwapped || report.reason.starts_with("clipped"));
    });
  }

  void tell(const std::string& who, const Result<PoseView>& view) const {
    report_(view ? fmt::format("{}: {} corners, {} symbols", who, view->corners.size(), view->symbols.size())
                 : fmt::format("{}: not used: {}", who, to_string(view.error())));
  }

  const std::vector<std::string>& names_;
  bool gray_code_;
  PoseObservers& observers_;
  const std::function<void(const std::string&)>& report_;
  std::map<std::pair<std::string, std::size_t>, ImageSize> sizes_;  // of each view
  std::vector<Look> looks_;                                         // of a pattern
  std::vector<Look> doubts_;  // those whose print does not show in their own pattern picture
  std::size_t jpegs_ = 0;
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
  reader.compare();
  return std::move(reader.captures);
}

}  // namespace slsd
