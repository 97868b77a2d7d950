// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <fstream>
#include <iomanip>
#include <string>

#include "core/cloud/pcd.hpp"
#include "core/cloud/ply.hpp"
#include "tests/core/cloud/any_cloud.hpp"

namespace {

void save(const std::string& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

// The points as text, for a reader that shares no code with the writers.
void save_text(const std::string& file, const slsd::Cloud& cloud) {
  std::ofstream text(file);
  text << std::setprecision(9);
  for (const auto& point : cloud.points) {
    text << point.x << ' ' << point.y << ' ' << point.z << ' ' << int{point.intensity} << ' ' << point.camera_u << ' '
         << point.camera_v << ' ' << point.projector_u << ' ' << point.projector_v << ' ' << int{point.camera} << ' '
         << int{point.symbol} << ' ' << point.sigma_mm << ' ' << point.column << ' ' << point.row << '\n';
  }
}

}  // namespace

// write_clouds FOLDER: one cloud as cloud.ply, cloud.pcd and cloud.txt, for read_cloud.py.
int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const std::string folder = argv[1];
  const slsd::Cloud cloud = slsd::any_cloud(11, 23, 17);
  save(folder + "/cloud.ply", slsd::write_ply(cloud));
  save(folder + "/cloud.pcd", slsd::write_pcd(cloud));
  save_text(folder + "/cloud.txt", cloud);
}
