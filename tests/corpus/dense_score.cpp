// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "tests/corpus/dense_score.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "core/geometry/ray_table.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

constexpr std::size_t kLargestFileBytes = std::size_t{1} << 30;
constexpr double kGrossPx = 3, kGrossMm = 5, kJump = 0.004;

/// The values of a two-dimensional array of numpy, little-endian and row by row.
template <class T>
Result<Image<T>> read_npy(const std::filesystem::path& path, std::string_view type) {
  const auto bytes = read_file(path, kLargestFileBytes);
  if (!bytes) return tl::unexpected(bytes.error());
  const auto malformed = [&] {
    return fail(ErrorCode::kMalformed, "is no array as the renderer writes it", path.string());
  };
  if (bytes->size() < 10 || bytes->compare(0, 6, "\x93NUMPY") != 0) return malformed();
  const auto length = static_cast<std::size_t>(static_cast<unsigned char>((*bytes)[8])) +
                      256U * static_cast<std::size_t>(static_cast<unsigned char>((*bytes)[9]));
  const std::string header = bytes->substr(10, length);
  const std::size_t shape = header.find("'shape': (");
  int height = 0, width = 0;
  if (shape == std::string::npos || header.find(type) == std::string::npos ||
      header.find("'fortran_order': False") == std::string::npos ||
      std::sscanf(header.c_str() + shape, "'shape': (%d, %d)", &height, &width) != 2) {
    return malformed();
  }
  Image<T> image(width, height);
  const std::size_t wanted = sizeof(T) * static_cast<std::size_t>(width) * height;
  if (bytes->size() != 10 + length + wanted) return malformed();
  std::memcpy(image.row(0), bytes->data() + 10 + length, wanted);
  return image;
}

double median(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// How far each pixel is from a jump in depth.
cv::Mat distance_from_edges(const Image<float>& depth) {
  cv::Mat flat(depth.height(), depth.width(), CV_8U, cv::Scalar(1));
  const auto at = [&](int x, int y) { return std::isnan(depth.at(x, y)) ? 1e6F : depth.at(x, y); };
  const auto look = [&](int x, int y, int dx, int dy) {
    const float a = at(x, y), b = at(x + dx, y + dy);
    if (std::abs(a - b) <= kJump * std::min(a, b)) return;
    flat.at<std::uint8_t>(y, x) = flat.at<std::uint8_t>(y + dy, x + dx) = 0;
  };
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (x + 1 < depth.width()) look(x, y, 1, 0);
      if (y + 1 < depth.height()) look(x, y, 0, 1);
    }
  }
  cv::Mat distance;
  cv::distanceTransform(flat, distance, cv::DIST_L2, 5);
  return distance;
}

}  // namespace

Result<DenseTruth> read_dense_truth(const std::filesystem::path& folder) {
  auto depth = read_npy<float>(folder / "depth.npy", "'<f4'");
  if (!depth) return tl::unexpected(depth.error());
  auto lit = read_npy<std::uint8_t>(folder / "mask.npy", "'|b1'");
  if (!lit) return tl::unexpected(lit.error());
  return DenseTruth{std::move(*depth), std::move(*lit)};
}

DenseScore score_dense(const DenseTruth& truth, const Calibration& calibration, std::span<const float> depth_mm,
                       std::span<const float> sigma_mm) {
  const CalibratedCamera& camera = calibration.cameras[0];
  const RayTable rays(camera.lens);
  // The rectified axes: along the baseline, and as near to the optical axis as that allows.
  const Eigen::Vector3d base = camera.projector_from_camera.inverse().translation;
  const Eigen::Vector3d along = base.normalized(), ahead = (Eigen::Vector3d::UnitZ() - along * along.z()).normalized();
  const double unit = camera.lens.fx * base.norm();
  const cv::Mat distance = distance_from_edges(truth.depth_mm);
  const int width = truth.depth_mm.width(), height = truth.depth_mm.height();
  cv::Mat near_lit;
  cv::dilate(cv::Mat(height, width, CV_8U, const_cast<std::uint8_t*>(truth.lit.row(0))), near_lit,
             cv::Mat::ones(5, 5, CV_8U));
  DenseScore score;
  std::vector<double> px, mm;
  double squares_px = 0, squares_mm = 0, squares_z = 0, sum_z = 0;
  std::size_t good = 0, beyond = 0, unlit = 0, unlit_far = 0, gross = 0;
  std::array<std::array<std::size_t, 3>, 4> edges{};  // lit, measured, gross
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * width + x;
      const bool have = !std::isnan(depth_mm[pixel]);
      if (truth.lit.at(x, y) == 0 || std::isnan(truth.depth_mm.at(x, y))) {
        unlit += have, unlit_far += have && near_lit.at<std::uint8_t>(y, x) == 0;
        continue;
      }
      ++score.lit;
      const float from_edge = distance.at<float>(y, x);
      auto& edge = edges[from_edge < 2 ? 0 : from_edge < 4 ? 1 : from_edge < 6 ? 2 : 3];
      ++edge[0];
      if (!have) continue;
      ++score.measured, ++edge[1];
      const Eigen::Vector3d ray = rays.ray({static_cast<double>(x), static_cast<double>(y)}).direction.homogeneous();
      const double z = static_cast<double>(depth_mm[pixel]), true_z = static_cast<double>(truth.depth_mm.at(x, y));
      const double off_px = unit / ahead.dot(ray) * (1 / z - 1 / true_z), off_mm = (z - true_z) * ray.norm();
      px.push_back(std::abs(off_px)), mm.push_back(std::abs(off_mm));
      const double over_sigma = off_mm / static_cast<double>(sigma_mm[pixel]);
      beyond += !(std::abs(over_sigma) <= 3);
      if (std::abs(off_px) > kGrossPx || std::abs(off_mm) > kGrossMm) {
        ++gross, ++edge[2];
        continue;
      }
      ++good;
      squares_px += off_px * off_px, squares_mm += off_mm * off_mm;
      squares_z += over_sigma * over_sigma, sum_z += over_sigma;
    }
  }
  const auto share = [](std::size_t part, std::size_t all) {
    return all == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(all);
  };
  score.complete = share(score.measured, score.lit);
  score.gross = share(gross, score.measured);
  score.unlit = share(unlit, std::max<std::size_t>(1, score.measured));
  score.unlit_far = share(unlit_far, std::max<std::size_t>(1, score.measured));
  score.beyond_three = share(beyond, score.measured);
  score.median_px = median(px), score.median_mm = median(mm);
  if (good > 0) {
    const auto count = static_cast<double>(good);
    score.rms_px = std::sqrt(squares_px / count), score.rms_mm = std::sqrt(squares_mm / count);
    score.error_over_sigma = std::sqrt(std::max(0.0, squares_z / count - sum_z / count * sum_z / count));
  }
  for (std::size_t i = 0; i < edges.size(); ++i)
    score.edges[i] = {share(edges[i][1], edges[i][0]), share(edges[i][2], edges[i][1])};
  return score;
}

}  // namespace slsd
