// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include <gmock/gmock.h>

#include "core/decode/centres/recover_symbols.hpp"
#include "core/decode/grid/cell_rays.hpp"
#include "core/geometry/epipolar/epipolar_gate.hpp"
#include "tests/core/decode/decoded_scene.hpp"
#include "tests/core/decode/shipped_pattern.hpp"

namespace slsd::test {

/// A plane that is seen whole: five symbols by five, each known but for the one in their middle, which is degraded.
class RecoveredPlane : public testing::Test {
 protected:
  static constexpr int kSide = 5, kRow = 20, kColumn = 30, kDegraded = kSide * kSide / 2;
  RecoveredPlane()
      : pattern_(shipped_pattern("16px-5.toml")),
        rig_(paper_rig()),
        frame_(simulate(draw_pattern(pattern_), rig_, kTilted, {.dark = 12, .lit = 170, .noise_sigma = 1})),
        prototypes_(pattern_.options.symbols.size()),
        cells_(pattern_, prototypes_, rig_.projector) {
    const EpipolarGate gate(rig_.cameras[0], rig_.projector, 400, 3200);
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column) {
        const Eigen::Vector2f centre = true_centre(row, column);
        GridNode node;
        node.centre_px = centre;
        node.frame.col(0) = (true_centre(row, column + 1) - centre) / pattern_.pitch_px();
        node.frame.col(1) = (true_centre(row + 1, column) - centre) / pattern_.pitch_px();
        const int at = row * kSide + column;
        node.links = {column + 1 < kSide ? at + 1 : -1, row + 1 < kSide ? at + kSide : -1, column > 0 ? at - 1 : -1,
                      row > 0 ? at - kSide : -1};
        seen_.nodes.push_back(node);
        seen_.region.push_back(at);
        GreyMoments moments{};
        moments.x = centre.x(), moments.y = centre.y(), moments.background = 12, moments.peak = 170;
        seen_.moments.push_back(moments);
        seen_.shapes.emplace_back();
        seen_.misfits.push_back(1);
        seen_.claims.push_back({.row = static_cast<std::int16_t>(kRow + row),
                                .column = static_cast<std::int16_t>(kColumn + column),
                                .status = RegionStatus::kDecoded});
        seen_.aligned.push_back(Aligned::kNot);
        segments_.push_back(gate.prepare(pixel_ray(rig_.cameras[0].lens, centre.cast<double>()).direction));
      }
    }
    // A centroid that has gone with what is missing.
    seen_.claims[kDegraded].status = RegionStatus::kDamagedShape;
    seen_.moments[kDegraded].x += 2, seen_.moments[kDegraded].y -= 3;
    seen_.nodes[kDegraded].centre_px += Eigen::Vector2f(2, -3);
  }

  [[nodiscard]] Eigen::Vector2f true_centre(int row, int column) const {
    const Eigen::Vector2d square(pattern_.symbol_centre_u_px(kColumn + column),
                                 pattern_.symbol_centre_v_px(kRow + row));
    return camera_from_projector(square, rig_, kTilted)->cast<float>();
  }

  /// Multiplies the grey values of the degraded symbol's cell by share(x, y), projector px from the middle of its
  /// square.
  void print(const std::function<double(double, double)>& share) {
    const Eigen::Vector2f centre = true_centre(kSide / 2, kSide / 2);
    const Eigen::Matrix2f inverse = seen_.nodes[kDegraded].frame.inverse();
    for (int y = -14; y <= 14; ++y) {
      for (int x = -14; x <= 14; ++x) {
        const int u = static_cast<int>(std::lround(centre.x())) + x, v = static_cast<int>(std::lround(centre.y())) + y;
        const Eigen::Vector2f at = inverse * (Eigen::Vector2f(u, v) - centre);
        if (at.cwiseAbs().maxCoeff() > 9) continue;
        frame_.at(u, v) = static_cast<std::uint8_t>(std::lround(share(at.x(), at.y()) * frame_.at(u, v)));
      }
    }
  }

  /// Leaves a symbol none that holds others.
  void hold_nothing(int node) { seen_.claims[node].status = RegionStatus::kClassDisagrees; }

  /// What look(scene) makes of all that is seen.
  template <class Look>
  auto look(const Look& look) {
    const GreyView view = frame_.view();
    const FrameNoise noise{.dark_variance = 1};
    const CellGate gate(cells_, segments_, 1.5);
    return look(LetterScene{view, 255, noise, letters_->at(blur_px_), gate, prototypes_, seen_});
  }
  [[nodiscard]] std::vector<std::int32_t> recover_all() {
    return look([&](const LetterScene& scene) -> std::vector<std::int32_t> {
      SerialExecutor alone;
      return SymbolRecovery(pattern_, letters_).recover(scene, alone);
    });
  }
  /// Distance of the recovered symbol from its true centre, camera px; empty if it is not recovered.
  std::optional<float> recover() {
    const auto recovered = recover_all();
    if (recovered.empty()) return std::nullopt;
    EXPECT_THAT(recovered, testing::ElementsAre(static_cast<std::int32_t>(kDegraded)));
    EXPECT_EQ(seen_.claims[kDegraded].status, RegionStatus::kDecoded);
    const GreyMoments& moments = seen_.moments[kDegraded];
    return (Eigen::Vector2f(moments.x, moments.y) - true_centre(kSide / 2, kSide / 2)).norm();
  }

  Pattern pattern_;
  std::shared_ptr<const LetterFields> letters_ = std::make_shared<const LetterFields>(pattern_.options);
  Calibration rig_;
  float blur_px_ = 0.7F;  // projector px, of the frame
  Grey8 frame_;
  std::vector<Prototype> prototypes_;  // centroids in the middle of the square
  CellRays cells_;
  std::vector<EpipolarSegment> segments_;
  Sightings seen_;
};

}  // namespace slsd::test
