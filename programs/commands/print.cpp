// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>

#include "core/print/draw_sheet.hpp"
#include "drivers/files/encode_png.hpp"
#include "drivers/files/file.hpp"
#include "programs/commands/commands.hpp"

namespace slsd {
namespace {

constexpr double kLeastDpi = 20;
constexpr double kGreatestDpi = 2400;

Result<std::string> sheet_png(const Sheet& sheet, double dpi) {
  if (!(dpi >= kLeastDpi && dpi <= kGreatestDpi)) {
    return fail(ErrorCode::kInvalidArgument, "--dpi must be 20 to 2400");
  }
  return sheet_image(sheet, dpi).and_then([&](const Grey8& image) { return encode_png(image, dpi); });
}

Result<std::string> sheet_bytes(const Sheet& sheet, const PrintRequest& request) {
  const std::string extension = lower_extension(request.file);
  if (extension == ".pdf") return sheet_pdf(sheet);
  if (extension == ".svg") return sheet_svg(sheet);
  if (extension == ".png") return sheet_png(sheet, request.dpi);
  return fail(ErrorCode::kInvalidArgument, "the file of a board must end in .pdf, .svg or .png", request.file.string());
}

Result<Sheet> sheet_for(const PrintRequest& request) {
  const auto paper = parse_paper(request.paper);
  if (!paper) return tl::unexpected(paper.error());
  const auto board = request.board.empty() ? board_for(*paper) : parse_board(request.board);
  if (!board) return tl::unexpected(board.error());
  return lay_out(*board, *paper);
}

}  // namespace

Result<> print_board(const PrintRequest& request) {
  const auto sheet = sheet_for(request);
  if (!sheet) return tl::unexpected(sheet.error());
  const auto bytes = sheet_bytes(*sheet, request);
  if (!bytes) return tl::unexpected(bytes.error());
  auto written = write_file_atomically(request.file, *bytes);
  if (!written) return written;
  std::cout << "board: " << to_string(sheet->board) << "\npaper: " << sheet->paper.name
            << "\nprint it at 100 %, not \"fit to page\", and measure both rulers on it\n";
  return {};
}

}  // namespace slsd
