// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors

// Writes what a service needs to scan without hardware: make_scene DIR makes frame.png, black.png, white.png,
// grey.png, dim.png, small.png, pattern.toml and calibration.yml of a plane at 2 m that the simulator drew.
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>

#include "core/calibration_file/calibration_file.hpp"
#include "core/code/pattern.hpp"
#include "core/geometry/calibration.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "tests/simulator/simulator.hpp"

namespace {

using namespace slsd;

void write(const std::filesystem::path& file, const Result<std::string>& bytes) {
  const Result<> written = bytes ? write_file_atomically(file, *bytes) : tl::unexpected(bytes.error());
  if (written) return;
  std::cerr << to_string(written.error()) << "\n";
  std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  const auto pattern = make_pattern({});
  if (!pattern) return 1;
  const Calibration calibration = paper_rig();
  const Surface wall = plane({0, 0, 2000}, {0, 0, 1});
  write(folder / "frame.png", encode_png(simulate(draw_pattern(*pattern), calibration, wall)));
  write(folder / "black.png", encode_png(Grey8(1600, 1200, 0)));
  write(folder / "white.png", encode_png(Grey8(1600, 1200, 255)));
  write(folder / "grey.png", encode_png(Grey8(1600, 1200, 90)));
  write(folder / "dim.png", encode_png(Grey8(1600, 1200, 30)));
  write(folder / "small.png", encode_png(Grey8(640, 480, 90)));
  write(folder / "pattern.toml", write_pattern(*pattern));
  write(folder / "calibration.yml", write_calibration(calibration));
}
