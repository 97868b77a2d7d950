// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/adversary/scenes/scene_light.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <opencv2/imgproc.hpp>

namespace slsd::adversary {
namespace {

constexpr double kFullShare = 0.96, kBlackLevel = 3;
constexpr double kRoomAtMost = 0.75;  // of full level: an exposure that clips the room's light shows no pattern

cv::Mat1f blurred(const cv::Mat1f& image, double sigma_px) {
  cv::Mat1f result;
  cv::GaussianBlur(image, result, {}, sigma_px, 0, cv::BORDER_REPLICATE);
  return result;
}

/// On a smaller image: as good for a wide halo, and much faster.
cv::Mat1f widely_blurred(const cv::Mat1f& image, double sigma_px, int smaller) {
  cv::Mat1f small, result;
  cv::resize(image, small, image.size() / smaller, 0, 0, cv::INTER_AREA);
  cv::resize(blurred(small, sigma_px / smaller), result, image.size(), 0, 0, cv::INTER_LINEAR);
  return result;
}

cv::Mat1f spread(const cv::Mat1f& image, const SceneLight& light) {
  cv::Mat1f sum = blurred(image, light.blur_px);
  if (!light.halo) return sum;
  constexpr double kNear = 0.06, kWide = 0.11, kEverywhere = 0.05;
  sum *= 1 - kNear - kWide - kEverywhere;
  cv::scaleAdd(widely_blurred(image, 5, 2), kNear, sum, sum);
  cv::scaleAdd(widely_blurred(image, 30, 8), kWide, sum, sum);
  sum += kEverywhere * cv::mean(image)[0];
  return sum;
}

/// Share of full light that the projector shows between four of its pixels.
float between(const Grey8& shown, float u, float v) {
  const int left = std::min(static_cast<int>(u), shown.width() - 2),
            top = std::min(static_cast<int>(v), shown.height() - 2);
  return static_cast<float>(
      level_between(shown.view(), left, top, u - static_cast<float>(left), v - static_cast<float>(top)) / 255);
}

struct LightSums {
  cv::Mat1f frame, white, room;
};

LightSums sum_light(const SceneTruth& truth, const Grey8& shown, const SceneLight& light) {
  const int width = truth.depth_mm.width(), height = truth.depth_mm.height();
  LightSums sum{cv::Mat1f(height, width, 0.F), cv::Mat1f(height, width, 0.F), cv::Mat1f(height, width, 0.F)};
  const auto black = static_cast<float>(light.black), vignette = static_cast<float>(light.vignette);
  for (int y = 0; y < height; ++y) {
    const double down = static_cast<double>(y) / height - 0.5;
    const double band = 1 + light.bands * std::sin(2 * std::numbers::pi * (2.5 * down + light.band_phase));
    for (int x = 0; x < width; ++x) {
      const double across = static_cast<double>(x) / width - 0.5;
      sum.room(y, x) = static_cast<float>(light.room * band * truth.albedo.at(x, y) *
                                          (1 + light.room_slope[0] * across + light.room_slope[1] * down));
      const auto& [u, v] = truth.projector_px.at(x, y);
      if (u < 0) continue;
      const float off_x = 2 * u / static_cast<float>(shown.width()) - 1,
                  off_y = 2 * v / static_cast<float>(shown.height()) - 1;
      const float white = truth.shade.at(x, y) * (1 - vignette * (off_x * off_x + off_y * off_y) / 2);
      sum.white(y, x) = white;
      sum.frame(y, x) = white * (black + (1 - black) * between(shown, u, v));
    }
  }
  return sum;
}

/// Light that all but the brightest half percent of the places have under white.
double brightest(const LightSums& light) {
  std::vector<float> levels;
  for (int y = 0; y < light.white.rows; y += 3)
    for (int x = 0; x < light.white.cols; x += 3)
      if (light.white(y, x) > 0) levels.push_back(light.white(y, x) + light.room(y, x));
  if (levels.empty()) return 1;
  const auto at = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() * 995 / 1000);
  std::nth_element(levels.begin(), at, levels.end());
  return *at;
}

cv::Mat1f draw_noise(cv::Size size, double grain_px, const std::vector<float>& noise, Random& random) {
  cv::Mat1f drawn(size);
  for (int y = 0; y < size.height; ++y) {
    auto at = static_cast<std::uint32_t>(random());
    for (int x = 0; x < size.width; ++x, ++at) drawn(y, x) = noise[at & (kNoiseTable - 1)];
  }
  if (grain_px <= 0) return drawn;
  drawn = blurred(drawn, grain_px);
  cv::Scalar mean, deviation;
  cv::meanStdDev(drawn, mean, deviation);
  drawn *= 1 / deviation[0];
  return drawn;
}

}  // namespace

SceneLight SceneLight::draw(Random& random) {
  SceneLight light;
  light.blur_px = std::hypot(0.4, uniform(random, 0, 1.4));
  light.halo = true;
  light.room = log_uniform(random, 0.02, 1);
  light.gain = std::min(log_uniform(random, 0.3, 2.5), kRoomAtMost * (1 + light.room) / light.room);
  light.noise = log_uniform(random, 0.037, 0.094);
  light.floor = uniform(random, 0.2, 0.5);
  light.black = log_uniform(random, 0.001, 0.02);
  light.vignette = uniform(random, 0, 0.4);
  light.room_slope = {uniform(random, -0.6, 0.6), uniform(random, -0.6, 0.6)};
  if (whole(random, 0, 5) == 0)
    light.gamma = uniform(random, 0.6, 0.75), light.sharpen = 0.04, light.grain_px = 1.5, light.noise = 0.094;
  if (whole(random, 0, 5) == 0) light.bands = 0.3, light.band_phase = uniform(random, 0, 1);
  return light;
}

SceneLight SceneLight::clean() {
  return {.blur_px = 0.5, .halo = true, .room = 0.05};
}

Grey8 expose(const SceneTruth& truth, const Grey8& shown, const SceneLight& light, const std::vector<float>& noise,
             Random& random) {
  const LightSums sum = sum_light(truth, shown, light);
  cv::Mat1f grey = spread(sum.frame, light);
  grey += sum.room;
  grey *= 255 * kFullShare * light.gain / brightest(sum);
  const cv::Mat1f drawn = draw_noise(grey.size(), light.grain_px, noise, random);
  const auto per_level = static_cast<float>(light.noise), floor = static_cast<float>(light.floor);
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      grey(y, x) += drawn(y, x) * std::sqrt(std::max(0.F, grey(y, x)) * per_level + floor);
  if (light.gamma != 1) {
    grey = cv::max(cv::min(grey / 255, 1), 0);
    cv::pow(grey, light.gamma, grey);
    grey *= 255;
  }
  if (light.sharpen > 0) grey += 4 * light.sharpen * (grey - blurred(grey, 1.2));
  Grey8 image(grey.cols, grey.rows);
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      image.at(x, y) = cv::saturate_cast<std::uint8_t>(grey(y, x) + static_cast<float>(kBlackLevel));
  return image;
}

}  // namespace slsd::adversary
