// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/core/board/board_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "core/board/board_ink.hpp"

namespace slsd {
namespace {

// Samples of a pixel's area on a lattice whose rows and columns are all different: an edge along the pixels is seen to
// 1/89 of a pixel.
constexpr int kSamples = 89;
constexpr int kStep = 55;

// Tells black from white at any place of a board; shapes by the cells of a lattice that they touch.
class InkLookup {
 public:
  explicit InkLookup(const Board& board) : pitch_mm_(board.pitch_mm), columns_(lattice(board.width_mm())) {
    cells_.resize(columns_ * lattice(board.height_mm()));
    const BoardInk ink = ink_of(board);
    for (const auto& r : ink.rectangles) add({r.x_mm, r.y_mm}, {r.x_mm + r.width_mm, r.y_mm + r.height_mm}, 0);
    for (const auto& d : ink.discs) {
      const Eigen::Vector2d centre(d.x_mm, d.y_mm);
      const Eigen::Vector2d half = Eigen::Vector2d::Constant(d.diameter_mm / 2);
      add(centre - half, centre + half, d.diameter_mm / 2);
    }
  }

  [[nodiscard]] bool black(const Eigen::Vector2d& at) const {
    if (at.x() < 0 || at.y() < 0) return false;
    const auto column = static_cast<std::size_t>(at.x() / pitch_mm_);
    const auto cell = static_cast<std::size_t>(at.y() / pitch_mm_) * columns_ + column;
    if (column >= columns_ || cell >= cells_.size()) return false;
    return std::ranges::any_of(cells_[cell], [&](const Shape& shape) { return shape.holds(at); });
  }

 private:
  struct Shape {
    Eigen::AlignedBox2d box;
    double radius_mm;

    [[nodiscard]] bool holds(const Eigen::Vector2d& at) const {
      return radius_mm > 0 ? (at - box.center()).squaredNorm() < radius_mm * radius_mm : box.contains(at);
    }
  };

  [[nodiscard]] std::size_t lattice(double length_mm) const {
    return static_cast<std::size_t>(std::ceil(length_mm / pitch_mm_)) + 1;
  }

  void add(const Eigen::Vector2d& first, const Eigen::Vector2d& last, double radius_mm) {
    const auto cell = [&](double mm) { return static_cast<std::size_t>(std::max(0.0, mm / pitch_mm_)); };
    for (std::size_t row = cell(first.y()); row <= cell(last.y()); ++row) {
      for (std::size_t column = cell(first.x()); column <= cell(last.x()); ++column) {
        cells_.at(row * columns_ + column).push_back({{first, last}, radius_mm});
      }
    }
  }

  double pitch_mm_;
  std::size_t columns_;
  std::vector<std::vector<Shape>> cells_;
};

// The place on the board's plane that is seen at a pixel.
Eigen::Vector2d place_at(const BoardScene& scene, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d ray = scene.camera_from_board.transpose() * scene.camera.undistort(pixel).homogeneous();
  const Eigen::Vector3d eye = -(scene.camera_from_board.transpose() * scene.origin_mm);
  return (eye - ray * (eye.z() / ray.z())).head<2>();
}

double print_level(const BoardScene& scene, const InkLookup& ink, const Eigen::Vector2d& at) {
  const Eigen::Vector2d size(scene.board.width_mm(), scene.board.height_mm());
  const Eigen::Vector2d border = Eigen::Vector2d::Constant(scene.border_mm);
  if (!Eigen::AlignedBox2d(-border, size + border).contains(at)) return (scene.white + scene.black) / 3;
  if (!scene.legacy) return ink.black(at) ? scene.black : scene.white;
  // Of an even number of columns, where each two squares of a row change places.
  const double pitch = scene.board.pitch_mm;
  const bool second = static_cast<int>(std::floor(at.x() / pitch)) % 2 != 0;
  return ink.black({at.x() + (second ? -pitch : pitch), at.y()}) ? scene.black : scene.white;
}

double level_of_pixel(const BoardScene& scene, const InkLookup& ink, const std::array<Eigen::Vector2d, 4>& corners) {
  double sum = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double right = (i + 0.5) / kSamples;
    const double low = (i * kStep % kSamples + 0.5) / kSamples;
    const Eigen::Vector2d above = corners[0] * (1 - right) + corners[1] * right;
    const Eigen::Vector2d below = corners[2] * (1 - right) + corners[3] * right;
    sum += print_level(scene, ink, above * (1 - low) + below * low);
  }
  return sum / kSamples;
}

template <class T>
Image<T> quantised(const Image<float>& light, float scale, float full) {
  Image<T> image(light.width(), light.height());
  std::transform(light.data(), light.data() + light.size(), image.data(),
                 [&](float level) { return static_cast<T>(std::lround(std::clamp(level * scale, 0.0F, full))); });
  return image;
}

}  // namespace

Eigen::Vector2d BoardScene::pixel(int id) const {
  return camera.project(camera_from_board * board.point(id) + origin_mm);
}

BoardScene scene_of(const Board& board, double pitch_px, double tilt_rad) {
  BoardScene scene{.board = board, .camera = {640, 480, 1200, 1200, 321.3, 238.6, {}}};
  const double distance = scene.camera.fx * board.pitch_mm / pitch_px;
  scene.camera_from_board =
      (Eigen::AngleAxisd(0.06, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d(0.6, 0.8, 0)))
          .toRotationMatrix();
  const Eigen::Vector3d middle(board.width_mm() / 2, board.height_mm() / 2, 0);
  scene.origin_mm = Eigen::Vector3d(0, 0, distance) - scene.camera_from_board * middle;
  return scene;
}

Image<float> photograph_scene(const BoardScene& scene) {
  const InkLookup ink(scene.board);
  const int width = scene.camera.width_px;
  const int height = scene.camera.height_px;
  Image<Eigen::Vector2d> places(width + 1, height + 1, Eigen::Vector2d::Zero());
  for (int y = 0; y <= height; ++y) {
    for (int x = 0; x <= width; ++x) places.at(x, y) = place_at(scene, {x - 0.5, y - 0.5});
  }
  Image<float> light(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double level = level_of_pixel(
          scene, ink, {places.at(x, y), places.at(x + 1, y), places.at(x, y + 1), places.at(x + 1, y + 1)});
      const double lost = scene.falling_light * (static_cast<double>(x) / width + 0.5 * y / height);
      light.at(x, y) = static_cast<float>(level * (1 - lost));
    }
  }
  cv::Mat matrix(height, width, CV_32F, light.data());
  if (scene.blur_px > 0) cv::GaussianBlur(matrix, matrix, {}, scene.blur_px);
  std::mt19937 random(scene.seed);
  std::normal_distribution<float> noise(0, static_cast<float>(std::max(scene.noise_levels, 1e-9)));
  for (std::size_t i = 0; i < light.size(); ++i) light.data()[i] += noise(random);
  return light;
}

Grey8 photograph8(const BoardScene& scene) {
  return quantised<std::uint8_t>(photograph_scene(scene), 1, 255);
}

Grey16 photograph16(const BoardScene& scene) {
  return quantised<std::uint16_t>(photograph_scene(scene), 257, 65535);
}

}  // namespace slsd
