// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/model/places/shot.hpp"

#include <algorithm>
#include <utility>

namespace slsd::model {
namespace {

/// The mean colour of the measured pixels of each cell.
std::vector<Rgb> colours_of(const RangeImage& image, const CellGrid& grid) {
  std::vector<Rgb> colours;
  if (image.colours.empty()) return colours;
  colours.reserve(grid.cells.size());
  for (int top = 0; top < image.height; top += grid.step) {
    for (int left = 0; left < image.width; left += grid.step) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      float count = 0;
      for (int y = top; y < std::min(top + grid.step, image.height); ++y) {
        for (int x = left; x < std::min(left + grid.step, image.width); ++x) {
          if (std::isnan(image.depth_mm[image.index(x, y)])) continue;
          const Rgb& colour = image.colours[image.index(x, y)];
          sum += Eigen::Vector3f(colour[0], colour[1], colour[2]);
          ++count;
        }
      }
      colours.push_back(to_rgb(sum / std::max(1.0F, count)));
    }
  }
  return colours;
}

Shot make_shot(std::vector<RangeImage> images, bool has_edges) {
  Shot shot;
  for (RangeImage& image : images) {
    SurfaceView view;
    view.levels = fit_cells(image);
    if (has_edges) view.edges = surface_edges(image, view.levels.back());
    view.colours = colours_of(image, view.levels.back());
    view.image = std::move(image);
    shot.views.push_back(std::move(view));
  }
  return shot;
}

}  // namespace

std::size_t Shot::cells() const {
  std::size_t count = 0;
  for (const SurfaceView& view : views)
    count += static_cast<std::size_t>(
        std::ranges::count_if(view.levels.back().cells, [](const SurfaceCell& cell) { return cell.sigma_mm > 0; }));
  return count;
}

Eigen::Vector3d Shot::middle_mm() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SurfaceView& view : views)
    for (const SurfaceCell& cell : view.levels.back().cells)
      if (cell.sigma_mm > 0) sum += cell.place_mm.cast<double>();
  return sum / static_cast<double>(std::max<std::size_t>(1, cells()));
}

Shot make_shot(std::vector<RangeImage> images) {
  return make_shot(std::move(images), true);
}

Shot make_shot_to_fuse(std::vector<RangeImage> images) {
  return make_shot(std::move(images), false);
}

}  // namespace slsd::model
