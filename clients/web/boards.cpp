// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "clients/web/boards.hpp"

#include <algorithm>
#include <sstream>
#include <system_error>
#include <tuple>
#include <utility>

#include "drivers/files/file.hpp"

namespace slsd::web {
namespace {

constexpr std::size_t kPdfBytesMax = 1 << 20;
constexpr std::size_t kBoardsMax = 50;
constexpr double kMmPerPoint = 25.4 / 72;

std::string between(const std::string& text, const std::string& before, char end) {
  const std::size_t begin = text.find(before);
  if (begin == std::string::npos) return "";
  const std::size_t from = begin + before.size(), to = text.find(end, from);
  return to == std::string::npos ? "" : text.substr(from, to - from);
}

bool is_board(const std::string& text) {
  return !text.empty() && text.find(':') != std::string::npos &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789:._") ==
             std::string::npos;
}

}  // namespace

PrintableBoard parse_board_pdf(std::string pdf) {
  PrintableBoard result;
  if (!pdf.starts_with("%PDF-")) return result;
  std::istringstream box(between(pdf, "/MediaBox [", ']'));
  double left = 0, bottom = 0, right = 0, top = 0;
  const std::string board = between(pdf, "/Title (", ')');
  if (!(box >> left >> bottom >> right >> top) || !(right > left && top > bottom) || !is_board(board)) return result;
  result.board = board;
  result.width_mm = (right - left) * kMmPerPoint;
  result.height_mm = (top - bottom) * kMmPerPoint;
  result.pdf = std::move(pdf);
  return result;
}

Result<std::vector<PrintableBoard>> read_boards(const std::filesystem::path& folder) {
  std::vector<PrintableBoard> boards;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() != ".pdf" || boards.size() == kBoardsMax) continue;
    auto pdf = read_file(at->path(), kPdfBytesMax);
    if (!pdf) continue;
    PrintableBoard board = parse_board_pdf(std::move(*pdf));
    board.name = at->path().stem().string();
    if (!board.board.empty()) boards.push_back(std::move(board));
  }
  if (boards.empty())
    return fail(ErrorCode::kNotFound,
                "there are no boards to print: install slsd-calibrate, or name their folder with --boards",
                folder.string());
  std::sort(boards.begin(), boards.end(), [](const PrintableBoard& a, const PrintableBoard& b) {
    return std::tuple(a.width_mm * a.height_mm, a.name) < std::tuple(b.width_mm * b.height_mm, b.name);
  });
  return boards;
}

}  // namespace slsd::web
