// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "core/calibration_file/calibration_file.hpp"
#include "drivers/files/file.hpp"
#include "programs/calibrate/calibrate_from_files.hpp"
#include "tests/programs/calibrate/simulated_captures.hpp"

namespace slsd::test {

inline constexpr char kPlane[] = "plane:6x4:70:35:DICT_4X4_50";
inline constexpr int kPoses = 7, kPlanes = 2;

inline std::filesystem::path new_folder() {
  std::string name = testing::TempDir() + "slsd-calibrate-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) std::abort();
  return name;
}

inline void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
}

inline std::string configuration_text(int seed = 1, int width_px = 640) {
  return "[pattern]\nseed = " + std::to_string(seed) +
         "\n[projector]\ndriver = \"headless\"\nwidth_px = " + std::to_string(width_px) +
         "\nheight_px = 400\n[calibration]\nfile = \"calibration.yml\"\n";
}

/// Poses and views of the plane that all tests read: drawing them takes seconds.
struct Captures {
  std::filesystem::path poses = new_folder(), planes = new_folder();

  Captures() {
    PatternOptions options;
    options.projector_width_px = 640, options.projector_height_px = 400;
    const auto pattern = make_pattern(options);
    const auto board = parse_board(kSimulatedBoard);
    const auto plane = parse_board(kPlane);
    if (!pattern || !board || !plane) std::abort();
    for (int i = 0; i < kPoses; ++i)
      write_simulated_pose(poses / ("pose_0" + std::to_string(i)), small_rig(), *board, *pattern, simulated_pose(i));
    for (int i = 0; i < kPlanes; ++i)
      write_simulated_pose(planes / ("plane_0" + std::to_string(i)), small_rig(), *plane, *pattern,
                           simulated_pose(3 * i));
  }
  ~Captures() {
    std::filesystem::remove_all(poses);
    std::filesystem::remove_all(planes);
  }
  Captures(const Captures&) = delete;
  Captures& operator=(const Captures&) = delete;
};

class FromFiles : public testing::Test {
 protected:
  static const Captures& captures() {
    static const Captures drawn;
    return drawn;
  }
  void SetUp() override {
    home_ = new_folder();
    write_text(home_ / "slsd.toml", configuration_text());
    request_.configuration_file = home_ / "slsd.toml";
    request_.from = captures().poses;
    request_.board = kSimulatedBoard;
  }
  void TearDown() override { std::filesystem::remove_all(home_); }

  /// A copy of the captures, to be spoilt.
  void copy_captures() {
    request_.from = home_ / "captures";
    std::filesystem::copy(captures().poses, request_.from, std::filesystem::copy_options::recursive);
  }
  /// Poses and views of the plane.
  void copy_all() {
    copy_captures();
    std::filesystem::copy(captures().planes, request_.from, std::filesystem::copy_options::recursive);
  }
  Calibration kept() {
    const auto text = read_file(home_ / "calibration.yml", 1 << 20);
    return read_calibration(text ? *text : "", "calibration.yml").value_or(Calibration{});
  }
  /// The calibration in force and the one before it survive a failure, to the last byte.
  std::string refusal() {
    const std::filesystem::path in_force = home_ / "calibration.yml", before = home_ / "calibration.yml.old";
    if (!std::filesystem::exists(in_force)) write_text(in_force, "what is in force");
    const std::string bytes = *read_file(in_force, 1 << 20);
    write_text(before, "what was before it");
    const auto done = calibrate_from_files(request_);
    EXPECT_FALSE(done);
    EXPECT_EQ(*read_file(in_force, 1 << 20), bytes);
    EXPECT_EQ(*read_file(before, 1 << 20), "what was before it");
    return done ? std::string() : to_string(done.error());
  }

  std::filesystem::path home_;
  CalibrateRequest request_;
};

}  // namespace slsd::test
