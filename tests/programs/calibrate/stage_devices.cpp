// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
// In the place of daemon/scan/rig/devices.cpp: a service whose camera and projector are on a BoardStage, with a person
// who holds the board in one pose after the other, each until the pattern was shown on it and the sign after that.
#include "daemon/scan/rig/devices.hpp"

#include <algorithm>
#include <array>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

#include "drivers/camera/frame_pool.hpp"
#include "drivers/projector/headless_projector.hpp"
#include "tests/programs/calibrate/board_stage.hpp"

namespace slsd {
namespace {

const std::array<HeldBoard, 12> kPoses{{{{0, 0, 650}, 0, 0},
                                        {{0, 0, 650}, 0, 0.45},
                                        {{60, 30, 700}, -0.4, 0},
                                        {{-60, -30, 600}, 0, -0.45},
                                        {{-70, 40, 680}, 0.4, 0.2},
                                        {{70, -40, 640}, -0.3, -0.3},
                                        {{0, 50, 560}, 0.35, -0.2},
                                        {{0, -50, 760}, -0.2, 0.4},
                                        {{80, 50, 760}, 0.3, 0.3},
                                        {{-80, -50, 760}, -0.35, 0.3},
                                        {{-50, 60, 720}, 0.2, -0.4},
                                        {{40, 0, 540}, 0.1, 0.1}}};

/// What camera and projector share.
/// @thread thread-safe
class Stage {
 public:
  explicit Stage(const ImageSize& projector) : stage_(*parse_board("charuco:11x7:25:18.75:DICT_5X5_1000"), projector) {
    stage_.operate = [this](const BoardStage&) { return std::optional(kPoses.at(pose_ % kPoses.size())); };
  }

  void show(const Grey8& image) {
    const std::lock_guard lock(mutex_);
    const double mean =
        std::accumulate(image.data(), image.data() + image.size(), 0.0) / static_cast<double>(image.size());
    const bool is_sign = mean > 150 && mean < 255;
    if (is_sign && std::exchange(lit_, false)) ++pose_;
    if (!is_sign && mean > 0 && mean < 255) lit_ = true;
    stage_.show(image);
  }
  [[nodiscard]] GreyImage photograph() {
    const std::lock_guard lock(mutex_);
    return std::move(stage_.grab()->front());
  }

 private:
  std::mutex mutex_;
  BoardStage stage_;
  std::size_t pose_ = 0;
  bool lit_ = false;  ///< by the pattern, since the pose is held
};

std::unique_ptr<Stage>& stage() {
  static std::unique_ptr<Stage> made;
  return made;
}

class StageProjector final : public Projector {
 public:
  explicit StageProjector(const HeadlessProjectorOptions& options) : screen_(options) {
    stage() = std::make_unique<Stage>(ImageSize{options.width_px, options.height_px});
  }
  [[nodiscard]] const ProjectorDescription& description() const override { return screen_.description(); }
  [[nodiscard]] Result<> open(MonotonicTime deadline) override { return screen_.open(deadline); }
  [[nodiscard]] Result<MonotonicTime> show(const Grey8& image, MonotonicTime deadline) override {
    stage()->show(image);
    return screen_.show(image, deadline);
  }
  [[nodiscard]] Result<> check(MonotonicTime deadline) override { return screen_.check(deadline); }
  [[nodiscard]] std::vector<std::string> warnings() const override { return {}; }
  [[nodiscard]] Result<Grey8> read_back() override { return screen_.read_back(); }

 private:
  HeadlessProjector screen_;
};

class StageCamera final : public Camera {
 public:
  explicit StageCamera(std::string name) : description_{std::move(name), "stage", "stage"} {}
  [[nodiscard]] const CameraDescription& description() const override { return description_; }
  [[nodiscard]] Result<> open() override {
    const FrameFormat format = format_of(view(stage()->photograph()));
    description_.width_px = format.width_px;
    description_.height_px = format.height_px;
    pool_.emplace(format, 6);
    return {};
  }
  [[nodiscard]] Result<Frame> capture(MonotonicTime) override {
    const MonotonicTime begun = std::chrono::steady_clock::now();
    const GreyImage picture = stage()->photograph();
    auto frame = pool_->lend(view(picture), sequence_++, begun);
    if (!frame) return fail(ErrorCode::kBusy, "all frames are held");
    return std::move(*frame);
  }
  void cancel() override {}

 private:
  CameraDescription description_;
  std::optional<FramePool> pool_;
  std::uint64_t sequence_ = 0;
};

}  // namespace

Result<std::unique_ptr<Camera>> make_camera(const CameraOptions& options) {
  return std::make_unique<StageCamera>(options.name());
}

Result<std::unique_ptr<Projector>> make_projector(const ProjectorOptions& options) {
  HeadlessProjectorOptions headless;
  headless.width_px = options.width_px;
  headless.height_px = options.height_px;
  return std::make_unique<StageProjector>(headless);
}

}  // namespace slsd
