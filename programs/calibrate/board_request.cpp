// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/board_request.hpp"

#include <charconv>
#include <iostream>
#include <optional>

#include <fmt/format.h>

namespace slsd {
namespace {

/// A print that is off by more than this was measured or entered wrongly.
constexpr double kScaleMin = 0.8, kScaleMax = 1.25;
/// A print that is off by more than this was scaled by the printer.
constexpr double kTrueScale = 0.005;

std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0)) return std::nullopt;
  return value;
}

Result<double> print_scale(std::string_view ruler, std::string_view option) {
  const std::size_t colon = ruler.find(':');
  const auto nominal = number(ruler.substr(0, colon));
  const auto measured = colon == std::string_view::npos ? std::nullopt : number(ruler.substr(colon + 1));
  if (!nominal || !measured) {
    return fail(ErrorCode::kInvalidArgument,
                "must be NOMINAL:MEASURED in mm, such as 200:194.2: the printed ruler's nominal and measured length",
                fmt::format("{} {}", option, ruler));
  }
  const double scale = *measured / *nominal;
  if (scale < kScaleMin || scale > kScaleMax) {
    return fail(
        ErrorCode::kInvalidArgument,
        fmt::format("says that the print is {:.2f} times as large as it should be: measure the ruler again, in mm",
                    scale),
        fmt::format("{} {}", option, ruler));
  }
  return scale;
}

Result<Board> as_printed(std::string_view text, std::string_view ruler, std::string_view option) {
  auto board = parse_board(text);
  if (!board || ruler.empty()) return board;
  const auto scale = print_scale(ruler, option);
  if (!scale) return tl::unexpected(scale.error());
  if (std::abs(*scale - 1) > kTrueScale) {
    std::cout << fmt::format(
        "the print's scale is {:.1f} % off, as after a printer's \"fit to page\"; slsd uses the measured scale\n",
        100 * (*scale - 1));
  }
  return board->scaled(*scale);
}

}  // namespace

Result<Board> requested_board(const CalibrateRequest& request) {
  return as_printed(request.board.empty() ? kDefaultBoard : std::string_view(request.board), request.ruler, "--ruler");
}

Result<std::optional<Board>> requested_plane(const CalibrateRequest& request) {
  if (!request.plane.empty()) return as_printed(request.plane, request.plane_ruler, "--plane-ruler");
  if (request.plane_ruler.empty()) return std::nullopt;
  return fail(ErrorCode::kInvalidArgument, "needs --plane, which names the print", "--plane-ruler");
}

}  // namespace slsd
