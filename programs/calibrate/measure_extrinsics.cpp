// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/measure_extrinsics.hpp"
#include "core/calibration_file/calibration_file.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <set>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <slsd/scanner.hpp>

#include "core/board/find_board.hpp"
#include "core/calibrate/solve/place_scanners.hpp"
#include "core/utc_text.hpp"
#include "drivers/files/file.hpp"
#include "programs/calibrate/board_request.hpp"

namespace slsd {
namespace {

using nlohmann::json;

constexpr auto kTimeout = std::chrono::seconds(60);
constexpr double kMovedMax = 0.2;         // limit of a cloud's white_differs
constexpr double kScalesDifferMax = 0.2;  // %: two scanners that differ more agree only at the board

struct Scanner {
  std::string name;
  client::Scanner service;
  std::string camera;  ///< the first; its frame is the scanner's
  CalibratedCamera calibrated;
  std::string calibration_date;  ///< empty: the file has none
};

bool is_plain(const std::string& name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !name.empty() && std::ranges::all_of(name, plain);
}

ErrorCode code_of(const client::ScannerError& error) {
  for (int code = 0; code <= static_cast<int>(ErrorCode::kFrameSkewed); ++code) {
    if (to_string(static_cast<ErrorCode>(code)) == error.name()) return static_cast<ErrorCode>(code);
  }
  return ErrorCode::kIo;
}

Result<Scanner> open_scanner(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  if (equals == std::string::npos || !is_plain(name) || equals + 1 == text.size()) {
    return fail(ErrorCode::kInvalidArgument, "must be NAME=SOCKET, such as left=/run/slsd/slsd.sock",
                "--scanner " + text);
  }
  try {
    client::Scanner service(text.substr(equals + 1));
    const json settings = json::parse(service.settings());
    const json cameras = settings.value("cameras", json::array());
    const auto calibration = read_calibration(settings.value("calibration", ""), name);
    if (!calibration || cameras.empty()) {
      return fail(ErrorCode::kNotFound, "this scanner is not calibrated: run slsd --calibrate", name);
    }
    const std::string camera = cameras[0].value("name", "");
    const CalibratedCamera* calibrated = calibration->camera(camera);
    if (!calibrated)
      return fail(ErrorCode::kNotFound, "its first camera is not calibrated: run slsd --calibrate", name);
    return Scanner{name, std::move(service), camera, *calibrated, calibration->report.date.value_or("")};
  } catch (const client::ScannerError& error) {
    return fail(code_of(error), error.what(), name);
  } catch (const json::exception&) {
    return fail(ErrorCode::kMalformed, "the program at this socket is not this version of slsd", name);
  }
}

GreyView view_of(const client::Frame& frame) {
  if (frame.bits > 8) {
    return ImageView<std::uint16_t>{reinterpret_cast<const std::uint16_t*>(frame.pixels.data()), frame.width_px,
                                    frame.height_px, frame.width_px};
  }
  return ImageView<std::uint8_t>{reinterpret_cast<const std::uint8_t*>(frame.pixels.data()), frame.width_px,
                                 frame.height_px, frame.width_px};
}

// Takes one scan with its white frame: the board in the frame, and its cloud.
Result<CloudView> take_view(Scanner& scanner, const Board& board) {
  client::Cloud cloud;
  json told;
  const client::Frame* white = nullptr;
  try {
    client::ScanOptions options;
    options.timeout = kTimeout;
    options.density = "pixels";
    options.coordinate_frame = "rig";
    options.texture = options.frames = true;
    cloud = scanner.service.scan(options);
    told = json::parse(cloud.description);
    for (const client::Frame& frame : cloud.frames) {
      const json about = json::parse(frame.description);
      if (about.value("light", "") == "white" && about.value("camera", "") == scanner.camera) white = &frame;
    }
  } catch (const client::ScannerError& error) {
    return fail(code_of(error), error.what(), scanner.name);
  } catch (const json::exception&) {
    return fail(ErrorCode::kMalformed, "the program at this socket is not this version of slsd", scanner.name);
  }
  if (!white) return fail(ErrorCode::kMalformed, "the scan lacks its white frame", scanner.name);
  if (const double moved = told.value("white_differs", 0.0); moved > kMovedMax) {
    return fail(ErrorCode::kMismatch, "the board moved during the scan: put it down", scanner.name);
  }
  const auto sighting = find_board(view_of(*white), board);
  if (!sighting) return tl::unexpected(sighting.error());
  std::vector<Eigen::Vector3d> points;
  for (const client::Point point : cloud) {
    if (point.camera == 0) points.emplace_back(point.x, point.y, point.z);
  }
  return view_in_cloud(points, *sighting, board, scanner.calibrated.lens);
}

std::string quoted(const std::string& text) {
  return json(text).dump(-1, ' ', false, json::error_handler_t::replace);  // TOML's basic strings use JSON's syntax
}

std::string file_text(const ExtrinsicsRequest& request, const std::vector<Scanner>& scanners, const Board& board,
                      const PlacedScanners& placed) {
  std::string text = fmt::format(
      "# Poses of scanners, measured by slsd --extrinsics. Lengths in mm.\nparent = {}\ndate = {}\nboard = {}\n",
      quoted(request.parent), quoted(utc_text(std::chrono::system_clock::now())), quoted(to_string(board)));
  for (std::size_t i = 0; i < scanners.size(); ++i) {
    const PlacedScanner& one = placed.scanners[i];
    const Eigen::Matrix3d& r = one.first_from_scanner.rotation;
    const Eigen::Vector3d& t = one.first_from_scanner.translation;
    text += fmt::format(
        "\n[scanner.{}]\nrotation = [{:.12g}, {:.12g}, {:.12g}, {:.12g}, {:.12g}, {:.12g}, {:.12g}, {:.12g}, {:.12g}]\n"
        "translation_mm = [{:.6f}, {:.6f}, {:.6f}]\n",
        scanners[i].name, r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2), t.x(), t.y(),
        t.z());
    if (!scanners[i].calibration_date.empty())
      text += "calibration_date = " + quoted(scanners[i].calibration_date) + "\n";
    if (i > 0) {
      text += fmt::format(
          "sigma_mm = {:.4f}      # of a point in the middle of the board's places\nsigma_far_mm = {:.4f}  # at the "
          "board's worst corner\nplaces = {}\n",
          one.sigma_mm, one.sigma_far_mm, one.places);
    }
  }
  return text;
}

// Scans with each scanner. Reports those that see the board, and those that do not.
Result<std::vector<CloudView>> look_at_place(std::vector<Scanner>& scanners, const Board& board) {
  std::vector<CloudView> views;
  for (std::size_t i = 0; i < scanners.size(); ++i) {
    auto seen = take_view(scanners[i], board);
    if (!seen && seen.error().code != ErrorCode::kNotFound && seen.error().code != ErrorCode::kMismatch)
      return tl::unexpected(seen.error());
    if (!seen) {
      std::cout << fmt::format("  {}: not used: {}\n", scanners[i].name, seen.error().message);
      continue;
    }
    seen->scanner = i;
    std::cout << fmt::format(
        "  {}: {} corners at {:.0f} mm; the board is flat to {:.3f} mm, and {:+.2f} % of its size\n", scanners[i].name,
        seen->corners.size(), seen->middle_mm.norm(), seen->bend_mm, seen->scale_percent);
    views.push_back(std::move(*seen));
  }
  return views;
}

// Scanners of different scales agree at the board and differ beside it.
Result<> check_scales(const std::vector<std::vector<CloudView>>& places, const std::vector<Scanner>& scanners) {
  for (const auto& views : places) {
    const auto [least, most] = std::ranges::minmax_element(views, {}, &CloudView::scale_percent);
    if (views.size() < 2 || most->scale_percent - least->scale_percent < kScalesDifferMax) continue;
    return fail(ErrorCode::kMismatch,
                fmt::format("{} measures the board {:.2f} % larger than {} does: calibrate both again, with one board",
                            scanners[most->scanner].name, most->scale_percent - least->scale_percent,
                            scanners[least->scanner].name));
  }
  return {};
}

}  // namespace

Result<> measure_extrinsics(const ExtrinsicsRequest& request, const CalibrateRequest& board_request) {
  const auto board = requested_board(board_request);
  if (!board) return tl::unexpected(board.error());
  std::vector<Scanner> scanners;
  std::set<std::string> names;
  for (const std::string& text : request.scanners) {
    auto scanner = open_scanner(text);
    if (!scanner) return tl::unexpected(scanner.error());
    if (!names.insert(scanner->name).second)
      return fail(ErrorCode::kInvalidArgument, "is given twice", "--scanner " + text);
    if (scanner->calibration_date.empty()) {
      std::cout << scanner->name << ": its calibration has no date, so a later calibration goes unnoticed\n";
    }
    scanners.push_back(std::move(*scanner));
  }
  if (scanners.size() < 2) return fail(ErrorCode::kInvalidArgument, "needs two scanners or more", "--scanner");
  if (request.parent.empty()) return fail(ErrorCode::kInvalidArgument, "is empty", "--parent");
  std::vector<std::vector<CloudView>> places;
  const auto wanted = static_cast<std::size_t>(request.places);
  std::string line;
  while (places.size() < wanted) {
    std::cout << fmt::format("Place {} of {}: put {} where at least two scanners see it, and press Enter.",
                             places.size() + 1, wanted, describe(*board))
              << std::endl;
    if (!std::getline(std::cin, line)) break;
    auto views = look_at_place(scanners, *board);
    if (!views) return tl::unexpected(views.error());
    if (views->size() > 1) {
      places.push_back(std::move(*views));
    } else {
      std::cout << "  this place does not count: fewer than two scanners see the board\n";
    }
  }
  if (places.empty()) {
    return fail(ErrorCode::kNotFound, "extrinsics_missing: no two scanners saw the board at the same place");
  }
  if (auto scales = check_scales(places, scanners); !scales) return scales;
  std::vector<std::string> in_order;
  for (const Scanner& scanner : scanners) in_order.push_back(scanner.name);
  auto placed = place_scanners(places, in_order);
  if (!placed) return tl::unexpected(placed.error());
  for (std::size_t i = 0; i < places.size(); ++i)
    std::cout << fmt::format("place {}: corners {:.3f} mm off their means\n", i + 1, placed->off_mm[i]);
  for (std::size_t i = 1; i < scanners.size(); ++i) {
    const PlacedScanner& one = placed->scanners[i];
    const Eigen::Vector3d& at = one.first_from_scanner.translation;
    std::cout << fmt::format(
        "{} is at ({:.2f}, {:.2f}, {:.2f}) mm in the frame of {}; the standard deviation of its points is {:.3f} mm, "
        "and {:.3f} mm at the board's worst corner\n",
        scanners[i].name, at.x(), at.y(), at.z(), scanners[0].name, one.sigma_mm, one.sigma_far_mm);
    if (one.places < 2) std::cout << "  measured at only one place of the board, so nothing checks it: use three\n";
  }
  auto written = write_file_atomically(request.file, file_text(request, scanners, *board, *placed));
  if (written) std::cout << "written to " << request.file.string() << "\n";
  return written;
}

}  // namespace slsd
