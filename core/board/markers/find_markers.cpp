// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/board/markers/find_markers.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "core/geometry/robust.hpp"
namespace slsd {
namespace {

constexpr double kLeastPerimeterPx = 36;
constexpr double kSmallSidePx = 30;  // OpenCV misreads bits of smaller markers
constexpr double kLargeSidePx = 150;
constexpr int kReducibleWidthPx = 900;
constexpr int kMaxMagnifiedPixels = 16 << 20;
constexpr int kCellPx = 8;

using Corners = std::vector<std::vector<cv::Point2f>>;

cv::Mat matrix_of(const Grey8& image) {
  return {image.height(), image.width(), CV_8UC1, const_cast<std::uint8_t*>(image.data())};
}

cv::Ptr<cv::aruco::Dictionary> dictionary_of(const MarkerFamily& family) {
  return cv::aruco::getPredefinedDictionary(family.opencv_number);
}

cv::Ptr<cv::aruco::DetectorParameters> parameters_for(const cv::Mat& image) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->minMarkerPerimeterRate = kLeastPerimeterPx / std::max(image.cols, image.rows);
  parameters->minDistanceToBorder = 1;
  parameters->perspectiveRemovePixelPerCell = kCellPx;
  return parameters;
}

// Pixel centres of an image that was resized by `scale`, converted to the original image.
Quad original(const std::vector<cv::Point2f>& corners, double scale) {
  Quad quad;
  for (std::size_t i = 0; i < quad.size(); ++i) {
    quad[i] = (Eigen::Vector2d(corners[i].x, corners[i].y).array() + 0.5) / scale - 0.5;
  }
  return quad;
}

SeenMarkers detect(const cv::Mat& image, const MarkerFamily& family, double scale) {
  cv::Mat resized = image;
  if (scale != 1) cv::resize(image, resized, {}, scale, scale, scale > 1 ? cv::INTER_CUBIC : cv::INTER_AREA);
  Corners corners;
  Corners rejected;
  std::vector<int> ids;
  cv::aruco::detectMarkers(resized, dictionary_of(family), corners, ids, parameters_for(resized), rejected);
  SeenMarkers seen;
  for (std::size_t i = 0; i < ids.size(); ++i) seen.markers.push_back({ids[i], original(corners[i], scale)});
  for (const auto& quad : rejected) seen.unknown.push_back(original(quad, scale));
  return seen;
}

double median_side(const SeenMarkers& seen) {
  std::vector<double> sides;
  for (const SeenMarker& marker : seen.markers) sides.push_back(marker.side_px());
  return median_in_place(sides);
}

// Adds the markers that are not yet there. A second marker with the same id is false, or another board's, and is
// dropped.
void add(SeenMarkers& all, SeenMarkers more) {
  if (more.unknown.size() > all.unknown.size()) all.unknown = std::move(more.unknown);
  for (const SeenMarker& marker : more.markers) {
    if (std::ranges::find(all.markers, marker.id, &SeenMarker::id) == all.markers.end()) all.markers.push_back(marker);
  }
  std::ranges::sort(all.markers, {}, &SeenMarker::id);
}

// The cells of a quadrangle, 1 white, 0 black; empty if its border is not black.
cv::Mat read_cells(const cv::Mat& image, const Quad& quad, int cells) {
  const auto side = static_cast<float>(cells * kCellPx);
  std::vector<cv::Point2f> from;
  for (const auto& corner : quad) from.emplace_back(static_cast<float>(corner.x()), static_cast<float>(corner.y()));
  const std::vector<cv::Point2f> onto{{0, 0}, {side, 0}, {side, side}, {0, side}};
  cv::Mat flat;
  cv::warpPerspective(image, flat, cv::getPerspectiveTransform(from, onto), {cells * kCellPx, cells * kCellPx});
  cv::threshold(flat, flat, 0, 1, cv::THRESH_BINARY | cv::THRESH_OTSU);
  cv::Mat bits(cells, cells, CV_8UC1);
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) {
      const cv::Rect inner(x * kCellPx + 2, y * kCellPx + 2, kCellPx - 4, kCellPx - 4);
      bits.at<unsigned char>(y, x) = cv::sum(flat(inner))[0] * 2 > inner.area() ? 1 : 0;
    }
  }
  const cv::Mat inside = bits(cv::Rect(1, 1, cells - 2, cells - 2));
  return cv::sum(bits)[0] > cv::sum(inside)[0] ? cv::Mat() : inside.clone();
}

int count_of_family(const cv::Mat& image, std::span<const Quad> quads, const MarkerFamily& family) {
  int count = 0;
  for (const Quad& quad : quads) {
    const cv::Mat bits = read_cells(image, quad, family.cells());
    int id = 0;
    int turns = 0;
    if (!bits.empty() && dictionary_of(family)->identify(bits, id, turns, 0)) ++count;
  }
  return count;
}

}  // namespace

double SeenMarker::side_px() const {
  double least = (corners[3] - corners[0]).norm();
  for (std::size_t i = 0; i < 3; ++i) least = std::min(least, (corners[i + 1] - corners[i]).norm());
  return least;
}

SeenMarkers find_markers(const Grey8& image, const MarkerFamily& family) {
  const cv::Mat whole = matrix_of(image);
  SeenMarkers seen;
  add(seen, detect(whole, family, 1));
  const double side = median_side(seen);
  if (side < kSmallSidePx && 4 * whole.total() <= kMaxMagnifiedPixels) add(seen, detect(whole, family, 2));
  if ((side == 0 || side > kLargeSidePx) && image.width() > kReducibleWidthPx) add(seen, detect(whole, family, 0.5));
  return seen;
}

const MarkerFamily* find_other_family(const Grey8& image, std::span<const Quad> unknown, const MarkerFamily& family) {
  constexpr std::size_t kMaxQuads = 100;
  const auto quads = unknown.first(std::min(unknown.size(), kMaxQuads));
  const MarkerFamily* best = nullptr;
  int most = 2;
  for (const MarkerFamily& other : marker_families()) {
    if (other.name == family.name) continue;
    const int count = count_of_family(matrix_of(image), quads, other);
    if (count > most) best = &other;
    most = std::max(most, count);
  }
  return best;
}

}  // namespace slsd
