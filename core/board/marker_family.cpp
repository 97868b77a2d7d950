// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/marker_family.hpp"

#include <algorithm>
#include <array>

#include <opencv2/aruco/dictionary.hpp>

namespace slsd {
namespace {

constexpr std::array kFamilies{
    MarkerFamily{"DICT_4X4_50", cv::aruco::DICT_4X4_50, 4, 50},
    MarkerFamily{"DICT_4X4_100", cv::aruco::DICT_4X4_100, 4, 100},
    MarkerFamily{"DICT_4X4_250", cv::aruco::DICT_4X4_250, 4, 250},
    MarkerFamily{"DICT_4X4_1000", cv::aruco::DICT_4X4_1000, 4, 1000},
    MarkerFamily{"DICT_5X5_50", cv::aruco::DICT_5X5_50, 5, 50},
    MarkerFamily{"DICT_5X5_100", cv::aruco::DICT_5X5_100, 5, 100},
    MarkerFamily{"DICT_5X5_250", cv::aruco::DICT_5X5_250, 5, 250},
    MarkerFamily{"DICT_5X5_1000", cv::aruco::DICT_5X5_1000, 5, 1000},
    MarkerFamily{"DICT_6X6_50", cv::aruco::DICT_6X6_50, 6, 50},
    MarkerFamily{"DICT_6X6_100", cv::aruco::DICT_6X6_100, 6, 100},
    MarkerFamily{"DICT_6X6_250", cv::aruco::DICT_6X6_250, 6, 250},
    MarkerFamily{"DICT_6X6_1000", cv::aruco::DICT_6X6_1000, 6, 1000},
    MarkerFamily{"DICT_7X7_50", cv::aruco::DICT_7X7_50, 7, 50},
    MarkerFamily{"DICT_7X7_100", cv::aruco::DICT_7X7_100, 7, 100},
    MarkerFamily{"DICT_7X7_250", cv::aruco::DICT_7X7_250, 7, 250},
    MarkerFamily{"DICT_7X7_1000", cv::aruco::DICT_7X7_1000, 7, 1000},
    MarkerFamily{"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL, 5, 1024},
    MarkerFamily{"DICT_APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5, 4, 30},
    MarkerFamily{"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9, 5, 35},
    MarkerFamily{"DICT_APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10, 6, 2320},
    MarkerFamily{"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11, 6, 587},
};

}  // namespace

std::span<const MarkerFamily> marker_families() {
  return kFamilies;
}

const MarkerFamily* find_marker_family(std::string_view name) {
  const auto* found = std::ranges::find(kFamilies, name, &MarkerFamily::name);
  return found == kFamilies.end() ? nullptr : found;
}

bool is_black(const MarkerFamily& family, int id, int column, int row) {
  const auto inside = [&](int i) { return i >= 1 && i <= family.bits; };
  if (!inside(column) || !inside(row)) return true;
  const cv::Mat codes = cv::aruco::getPredefinedDictionary(family.opencv_number)->bytesList;
  const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(codes.row(id), family.bits);
  return bits.at<unsigned char>(row - 1, column - 1) == 0;
}

}  // namespace slsd
