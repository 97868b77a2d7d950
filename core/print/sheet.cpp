// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/print/sheet.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace slsd {
namespace {

constexpr double kMarginMm = 8;  // white margin of printers
constexpr double kRulerMm = 6;
constexpr double kTextMm = 5;
constexpr int kColumns = 11;
constexpr int kRows = 7;
constexpr double kMarkerOfSquare = 0.75;
constexpr int kLeastSquareMm = 5;

double clear_around(const Board& board) {
  return std::clamp(board.pitch_mm / 2, 4.0, 10.0);
}

Eigen::Vector2d size_needed(const Board& board) {
  const double around = 2 * (kMarginMm + clear_around(board));
  return {board.width_mm() + around + kRulerMm, board.height_mm() + around + kRulerMm + kTextMm};
}

bool fits(const Board& board, const Paper& paper) {
  const Eigen::Vector2d size = size_needed(board);
  return size.x() <= paper.width_mm && size.y() <= paper.height_mm;
}

std::string size_text(double width_mm, double height_mm) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%g x %g mm", width_mm, height_mm);
  return text.data();
}

std::string advice(const Board& board) {
  for (const char* name : {"A4", "A3", "A2", "A1", "A0"}) {
    const Paper paper = *parse_paper(name);
    if (fits(board, paper) || fits(board, paper.turned())) return std::string("give --paper ") + name;
  }
  return "give a smaller --board, or --paper WIDTHxHEIGHT of that size";
}

Board charuco_of(int square_mm) {
  const double marker_mm = kMarkerOfSquare * square_mm;
  return {BoardKind::kCharuco,
          kColumns,
          kRows,
          static_cast<double>(square_mm),
          marker_mm,
          find_marker_family("DICT_5X5_1000")};
}

}  // namespace

Result<Sheet> lay_out(const Board& board, const Paper& paper) {
  if (!fits(board, paper) && fits(board, paper.turned())) return lay_out(board, paper.turned());
  const Eigen::Vector2d size = size_needed(board);
  if (!fits(board, paper)) {
    return fail(ErrorCode::kImpossible, describe(board) + " needs " + size_text(size.x(), size.y()) +
                                            " with its border and rulers, but " + paper.name + " has " +
                                            size_text(paper.width_mm, paper.height_mm) + "; " + advice(board));
  }
  const double clear = clear_around(board);
  const Eigen::Vector2d spare = (Eigen::Vector2d(paper.width_mm, paper.height_mm) - size) / 2;
  const Eigen::Vector2d corner(kMarginMm + kRulerMm + clear, kMarginMm + clear);
  return Sheet{board, paper, spare + corner, clear};
}

Result<Board> board_for(const Paper& paper) {
  const Paper lying = paper.width_mm < paper.height_mm ? paper.turned() : paper;
  int square_mm = static_cast<int>(lying.width_mm / kColumns);
  while (square_mm >= kLeastSquareMm && !fits(charuco_of(square_mm), lying)) --square_mm;
  if (square_mm >= kLeastSquareMm) return charuco_of(square_mm);
  return fail(ErrorCode::kImpossible,
              "no board with squares of 5 mm fits on " + paper.name + " with its rulers; give a larger --paper");
}

}  // namespace slsd
