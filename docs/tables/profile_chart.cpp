// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "docs/tables/profile_chart.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace slsd {
namespace {

constexpr int kWidth_px = 1000, kHeight_px = 560;
constexpr int kLeft_px = 90, kRight_px = 640, kTop_px = 30, kBottom_px = 500;
constexpr int kDecades = 5;  // from 0.001 % to 100 %

const cv::Scalar kInk(60, 60, 60);
const cv::Scalar kRule(220, 220, 220);
const cv::Scalar kColours[] = {{40, 40, 200},  {40, 140, 240}, {60, 170, 60}, {180, 120, 30},
                               {170, 60, 150}, {150, 150, 20}, {90, 90, 90},  {200, 60, 60}};

int x_of(std::size_t distance) {
  return kLeft_px + static_cast<int>(distance) * (kRight_px - kLeft_px) / kWindowCells;
}

int y_of(double share) {
  const double decades = std::clamp(-std::log10(std::max(share, 1e-12)), 0.0, static_cast<double>(kDecades));
  return kTop_px + static_cast<int>(decades * (kBottom_px - kTop_px) / kDecades);
}

void write_text(cv::Mat& chart, const std::string& text, int left_px, int base_px) {
  cv::putText(chart, text, {left_px, base_px}, cv::FONT_HERSHEY_SIMPLEX, 0.42, kInk, 1, cv::LINE_AA);
}

void draw_axes(cv::Mat& chart) {
  for (int decade = 0; decade <= kDecades; ++decade) {
    const int y = y_of(std::pow(10.0, -decade));
    cv::line(chart, {kLeft_px, y}, {kRight_px, y}, kRule);
    write_text(chart,
               decade <= 2 ? std::to_string(static_cast<int>(std::pow(10, 2 - decade))) + " %"
                           : "1e-" + std::to_string(decade - 2) + " %",
               20, y + 4);
  }
  for (std::size_t distance = 0; distance <= kWindowCells; ++distance) {
    cv::line(chart, {x_of(distance), kTop_px}, {x_of(distance), kBottom_px}, kRule);
    write_text(chart, std::to_string(distance), x_of(distance) - 4, kBottom_px + 20);
  }
  write_text(chart, "cells in which two windows differ", kLeft_px + 150, kBottom_px + 44);
}

void draw_profile(cv::Mat& chart, const NamedProfile& named, const cv::Scalar& colour) {
  const auto comparisons = static_cast<double>(named.profile.comparisons());
  cv::Point last(-1, -1);
  for (std::size_t distance = 0; distance < named.profile.pairs.size(); ++distance) {
    if (named.profile.pairs[distance] == 0) continue;
    const cv::Point at(x_of(distance), y_of(static_cast<double>(named.profile.pairs[distance]) / comparisons));
    cv::circle(chart, at, 4, colour, cv::FILLED, cv::LINE_AA);
    if (last.x >= 0) cv::line(chart, last, at, colour, 2, cv::LINE_AA);
    last = at;
  }
}

}  // namespace

bool write_profile_chart(const std::vector<NamedProfile>& profiles, const std::string& file) {
  cv::Mat chart(kHeight_px, kWidth_px, CV_8UC3, cv::Scalar(255, 255, 255));
  draw_axes(chart);
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const cv::Scalar& colour = kColours[i % std::size(kColours)];
    draw_profile(chart, profiles[i], colour);
    const int y = kTop_px + 20 + 24 * static_cast<int>(i);
    cv::line(chart, {kRight_px + 20, y - 4}, {kRight_px + 44, y - 4}, colour, 2, cv::LINE_AA);
    write_text(chart, profiles[i].name, kRight_px + 52, y);
  }
  return cv::imwrite(file, chart);
}

}  // namespace slsd
