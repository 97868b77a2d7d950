// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/calibrate/observe/symbol_gap.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "core/geometry/homography.hpp"

namespace slsd {
namespace {

constexpr std::size_t kFoundMin = 20;  // fewer do not show where the others should be
/// Classes of cells with equal brightness under the white projector. Within a class, symbols are equally likely to be
/// read anywhere, on ink as on paper.
constexpr std::size_t kBrightnesses = 8;
constexpr int kWindow = 5;  // cells across and down, wider than the ink of most squares
/// Limits of a window with a gap: the largest share of expected symbols that are seen, the smallest number of expected
/// symbols, and the smallest lack in standard deviations of chance.
constexpr double kSeenShare = 0.2, kExpectedMin = 8, kDeviations = 4;
constexpr double kClippedShare = 0.5;

/// A symbol of the pattern that falls on the board.
struct Cell {
  bool on_board = false, seen = false, in_gap = false;
  double level = 0;   ///< grey level of the white picture at the symbol
  double likely = 0;  ///< probability of being read
};

/// The pattern's cells, row by row.
struct Cells {
  explicit Cells(const Pattern& pattern)
      : columns(pattern.whole_columns()),
        rows(pattern.whole_rows()),
        cells(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

  [[nodiscard]] Cell& at(int column, int row) {
    return cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)];
  }

  int columns, rows;
  std::vector<Cell> cells;
};

std::optional<double> level_at(const GreyView& picture, const Eigen::Vector2d& pixel) {
  return std::visit(
      [&](const auto& view) -> std::optional<double> {
        const long x = std::lround(pixel.x()), y = std::lround(pixel.y());
        if (x < 0 || y < 0 || x >= view.width || y >= view.height) return std::nullopt;
        return view.row(static_cast<int>(y))[x];
      },
      picture);
}

double brightest_of(const GreyView& picture) {
  return std::visit(
      [](const auto& view) {
        double brightest = 0;
        for (int y = 0; y < view.height; ++y)
          brightest =
              std::max(brightest, static_cast<double>(*std::max_element(view.row(y), view.row(y) + view.width)));
        return brightest;
      },
      picture);
}

void foretell(Cells& cells) {
  std::vector<Cell*> on_board;
  for (Cell& cell : cells.cells) {
    if (cell.on_board) on_board.push_back(&cell);
  }
  std::ranges::stable_sort(on_board, {}, &Cell::level);
  for (std::size_t i = 0; i < kBrightnesses; ++i) {
    const std::span<Cell*> alike(
        on_board.begin() + static_cast<std::ptrdiff_t>(i * on_board.size() / kBrightnesses),
        on_board.begin() + static_cast<std::ptrdiff_t>((i + 1) * on_board.size() / kBrightnesses));
    const auto seen = std::ranges::count_if(alike, &Cell::seen);
    for (Cell* cell : alike) cell->likely = static_cast<double>(seen) / static_cast<double>(alike.size());
  }
}

/// Marks the windows that have far fewer symbols than they should.
void find_windows(Cells& cells) {
  for (int top = 0; top + kWindow <= cells.rows; ++top) {
    for (int left = 0; left + kWindow <= cells.columns; ++left) {
      double expected = 0, variance = 0, seen = 0;
      const auto visit = [&](const auto& what) {
        for (int row = top; row < top + kWindow; ++row)
          for (int column = left; column < left + kWindow; ++column) what(cells.at(column, row));
      };
      visit([&](const Cell& cell) {
        expected += cell.likely, variance += cell.likely * (1 - cell.likely), seen += cell.seen ? 1 : 0;
      });
      if (expected < kExpectedMin || seen > kSeenShare * expected ||
          expected - seen < kDeviations * std::sqrt(variance))
        continue;
      visit([](Cell& cell) { cell.in_gap = cell.on_board && !cell.seen; });
    }
  }
}

}  // namespace

SymbolGap find_symbol_gap(const std::vector<SymbolMatch>& found, const Pattern& pattern, const BoardRegion& region,
                          const GreyView& white) {
  if (found.size() < kFoundMin) return {};
  Cells cells(pattern);
  std::vector<Eigen::Vector2d> projector, camera;
  for (const SymbolMatch& match : found) {
    projector.push_back(match.projector_px), camera.push_back(match.camera_px);
    const auto column =
        static_cast<int>(std::lround((match.projector_px.x() - pattern.symbol_centre_u_px(0)) / pattern.pitch_px()));
    const auto row =
        static_cast<int>(std::lround((match.projector_px.y() - pattern.symbol_centre_v_px(0)) / pattern.pitch_px()));
    if (column >= 0 && row >= 0 && column < cells.columns && row < cells.rows) cells.at(column, row).seen = true;
  }
  const Homography camera_from_projector = fit_robust_homography(projector, camera);
  for (int row = 0; row < cells.rows; ++row) {
    for (int column = 0; column < cells.columns; ++column) {
      const Eigen::Vector2d pixel =
          camera_from_projector.map({pattern.symbol_centre_u_px(column), pattern.symbol_centre_v_px(row)});
      const auto level = level_at(white, pixel);
      if (!level || !region.contains(pixel)) continue;
      Cell& cell = cells.at(column, row);
      cell.on_board = true, cell.level = *level;
    }
  }
  foretell(cells);
  find_windows(cells);
  const double full = brightest_of(white);
  const auto count = [&](const auto& which) {
    return static_cast<std::size_t>(std::ranges::count_if(cells.cells, which));
  };
  const std::size_t symbols = count([](const Cell& cell) { return cell.in_gap; });
  const std::size_t at_full = count([&](const Cell& cell) { return cell.in_gap && cell.level >= full; });
  return {symbols, static_cast<double>(at_full) > kClippedShare * static_cast<double>(symbols)};
}

}  // namespace slsd
