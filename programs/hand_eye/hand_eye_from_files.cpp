// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/hand_eye/hand_eye_from_files.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/board/find_board.hpp"
#include "core/calibration_file/calibration_file.hpp"
#include "core/calibration_file/hand_eye_file.hpp"
#include "core/geometry/robust.hpp"
#include "core/hand_eye/diagnose_hand_eye.hpp"
#include "core/hand_eye/next_pose.hpp"
#include "core/image_size.hpp"
#include "core/utc_text.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "drivers/files/file.hpp"
#include "drivers/files/read_image.hpp"
#include "programs/calibrate/board_request.hpp"
#include "programs/calibrate/captures/capture_folder.hpp"
#include "programs/calibrate/captures/captured_pictures.hpp"
#include "programs/calibrate/session/socket_source.hpp"
#include "programs/hand_eye/poses_file.hpp"
#include "programs/hand_eye/take_view.hpp"

namespace slsd {
namespace {

constexpr std::size_t kCalibrationBytes = 1 << 20;
constexpr double kPrintUnmeasured = 2e-3, kPrintMeasured = 3e-4;  // one standard deviation of the print's scale
constexpr double kPointsPerPx = 100;                              // a drawn point needs no more
constexpr double kDegreesOfRad = 180 / std::numbers::pi;

double degrees_of(double rad) {
  return rad * kDegreesOfRad;
}

double rounded(double value, double parts) {
  return std::round(value * parts) / parts;
}

void print_line(const nlohmann::json& told) {
  std::cout << told.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) << std::endl;
}

Result<Calibration> scanner_calibration(const Configuration& configuration) {
  auto calibration = configured_calibration(configuration);
  if (!calibration) return tl::unexpected(calibration.error());
  if (*calibration) return std::move(**calibration);
  return fail(ErrorCode::kNotFound,
              "the scanner has no calibration: calibrate it first, or name its configuration with --config");
}

/// The requested board; else the calibration's, if its file names one.
Result<Board> board_of(const HandEyeRequest& request, const Calibration& calibration) {
  if (request.board.empty() && calibration.report.board) {
    if (auto board = parse_board(*calibration.report.board)) return board;
  }
  CalibrateRequest as_for_calibrating;
  as_for_calibrating.board = request.board, as_for_calibrating.ruler = request.ruler;
  return requested_board(as_for_calibrating);
}

/// Reads the views of a folder.
class ViewReader {
 public:
  ViewReader(const Calibration& calibration, const Board& board, std::string first_camera,
             const HandEyeRequest& request)
      : calibration_(calibration), board_(board), first_camera_(std::move(first_camera)), request_(request) {}

  /// @param needed  an invisible board is an error
  /// @return  nothing if the board is not visible
  Result<std::optional<LocatedBoard>> read(const CapturedPose& pose, bool needed) {
    std::vector<CameraSighting> sightings;
    std::string reasons;
    for (const auto& [folder, files] : pose.cameras) {
      const CalibratedCamera* const camera = calibration_.camera(folder.empty() ? first_camera_ : folder);
      if (camera == nullptr) return fail(ErrorCode::kNotFound, "the calibration has no camera of this name", folder);
      if (files.white.empty()) return tl::unexpected(*files.lack);
      const auto image = read_image(files.white);
      if (!image) return tl::unexpected(image.error());
      const ImageSize size = size_of(*image);
      if (size != ImageSize{camera->lens.width_px, camera->lens.height_px}) {
        return fail(ErrorCode::kMismatch,
                    fmt::format("has {} px, but the calibration is for {}: take pictures with the calibrated camera",
                                size_text(size.width_px, size.height_px),
                                size_text(camera->lens.width_px, camera->lens.height_px)),
                    files.white.string());
      }
      auto sighting = look_for_board(*image);
      if (!sighting) {
        reasons += (reasons.empty() ? "" : "; ") + sighting.error().message;
        continue;
      }
      sightings.push_back({static_cast<std::size_t>(camera - calibration_.cameras.data()), std::move(*sighting)});
    }
    const auto located =
        sightings.empty() ? fail(ErrorCode::kNotFound, reasons) : locate_board(sightings, board_, calibration_);
    if (!located) {
      if (needed) return fail(ErrorCode::kNotFound, located.error().message, pose.name);
      std::cerr << fmt::format("{}: not used: {}\n", pose.name, located.error().message);
      if (shows_points()) print_line({{"look", pose.name}, {"unused", located.error().message}});
      return std::nullopt;
    }
    tell(pose.name, *located, sightings);
    return *located;
  }

 private:
  [[nodiscard]] bool shows_points() const { return request_.json && request_.looks; }

  void tell(const std::string& name, const LocatedBoard& located, const std::vector<CameraSighting>& sightings) const {
    const double distance_mm = (located.rig_from_board * located.middle_mm).norm();
    const double error_px = std::sqrt(located.squares_px2 / located.degrees_of_freedom());
    if (!request_.json) {
      std::cout << fmt::format("{}: {} corners at {:.0f} mm, {:.3f} px\n", name, located.corners, distance_mm, error_px)
                << std::flush;
    }
    if (!shows_points()) return;
    nlohmann::json cameras = nlohmann::json::array();
    for (const CameraSighting& each : sightings) {
      nlohmann::json points = nlohmann::json::array();
      for (const SeenPoint& point : each.sighting.points)
        points.push_back({rounded(point.pixel.x(), kPointsPerPx), rounded(point.pixel.y(), kPointsPerPx)});
      cameras.push_back({{"name", calibration_.cameras[each.camera].name}, {"points_px", std::move(points)}});
    }
    print_line({{"look", name},
                {"corners", located.corners},
                {"distance_mm", distance_mm},
                {"error_px", error_px},
                {"cameras", std::move(cameras)}});
  }

  Result<BoardSighting> look_for_board(const GreyImage& image) {
    const auto view = std::visit([](const auto& pixels) -> GreyView { return pixels.view(); }, image);
    auto sighting = find_board(view, board_);
    const auto other = rows_by_columns(board_);
    if (sighting || seen_ || !other) {
      seen_ = seen_ || sighting;
      return sighting;
    }
    auto turned = find_board(view, *other);
    if (!turned) return sighting;
    seen_ = true;
    board_ = *other;
    return turned;
  }

  const Calibration& calibration_;
  Board board_;
  std::string first_camera_;
  const HandEyeRequest& request_;
  bool seen_ = false;  // so the board's orientation is known
};

/// Lines of poses.csv, without those to leave out.
Result<std::vector<PoseLine>> lines_of(const HandEyeRequest& request) {
  const auto file = request.from / "poses.csv";
  const auto text = read_file(file, kPosesFileMaxBytes);
  if (!text) return tl::unexpected(text.error());
  auto lines = read_poses(*text, file.string());
  if (!lines) return lines;
  for (const std::string& name : request.without) {
    if (std::erase_if(*lines, [&](const PoseLine& line) { return line.name == name; }) == 0)
      return fail(ErrorCode::kInvalidArgument, "matches no line of poses.csv", "--without " + name);
  }
  return lines;
}

/// A calibrated scanner and the board that it looks at.
struct Scanner {
  Calibration calibration;
  Board board;
  std::string first_camera;
};

/// @param added  the view that must show the board; empty: none
Result<HandEyeRecord> read_record(const HandEyeRequest& request, const Scanner& scanner, const std::string& added) {
  HandEyeRecord record;
  record.mounted = request.mounted == "arm" ? Mounted::kArm : Mounted::kCell;
  const auto notation = pose_notation(request.poses);
  if (!notation) return tl::unexpected(notation.error());
  record.notation = *notation;
  const auto lines = lines_of(request);
  if (!lines) return tl::unexpected(lines.error());
  const auto captures = list_captures(request.from, WhitePicture::kNeeded);
  if (!captures) return tl::unexpected(captures.error());
  for (const PoseLine& line : *lines) {
    if (std::ranges::find(*captures, line.name, &CapturedPose::name) != captures->end()) continue;
    return fail(ErrorCode::kNotFound, "poses.csv names it, but there is no such folder",
                (request.from / line.name).string());
  }
  ViewReader reader(scanner.calibration, scanner.board, scanner.first_camera, request);
  std::vector<LocatedBoard> boards;
  for (const CapturedPose& capture : *captures) {
    const auto line = std::ranges::find(*lines, capture.name, &PoseLine::name);
    if (line == lines->end()) {
      if (std::ranges::find(request.without, capture.name) == request.without.end())
        std::cerr << fmt::format("{}: not used: poses.csv has no line of this name\n", capture.name);
      continue;
    }
    auto seen = reader.read(capture, capture.name == added);
    if (!seen) return tl::unexpected(seen.error());
    if (!*seen) continue;
    record.views.push_back({capture.name, line->numbers, **seen});
    boards.push_back(**seen);
  }
  record.shared = SharedErrors::of(scanner.calibration, request.ruler.empty() ? kPrintUnmeasured : kPrintMeasured);
  record.corner_px = corner_noise_px(boards);
  if (request.measured_mm.size() == 3)
    record.measured_mm = Eigen::Vector3d(request.measured_mm[0], request.measured_mm[1], request.measured_mm[2]);
  return record;
}

double usual_distance_mm(const HandEyeRecord& record) {
  constexpr double kWithoutViews = 1000;
  std::vector<double> distances;
  for (const RecordedView& view : record.views)
    distances.push_back((view.board.rig_from_board * view.board.middle_mm).norm());
  return distances.empty() ? kWithoutViews : median_in_place(distances);
}

std::string result_text(const HandEyeResult& result) {
  const HandEyeFit& fit = *result.fit;
  const Eigen::Vector3d& place = fit.places.mount_from_rig.translation;
  const bool arm = result.session.mounted == Mounted::kArm;
  return fmt::format(
      "the robot's poses have a noise of {:.3f} mm and {:.3f}°; the print's scale is {:+.3f} % off\nthe scanner is at "
      "({:.2f}, {:.2f}, {:.2f}) mm {}, to {:.2f} mm and {:.3f}° (one standard deviation)\n{}: 95 % of points at {:.0f} "
      "mm are placed within {:.2f} mm\n",
      fit.noise.place_mm, degrees_of(fit.noise.turn_rad), 100 * fit.shared[SharedErrors::kPrintScale], place.x(),
      place.y(), place.z(), arm ? "from the flange" : "from the robot's base", result.verdict.place_sigma_mm,
      degrees_of(result.verdict.turn_sigma_rad), to_string(grade(result.verdict)), result.verdict.distance_mm,
      result.verdict.error_mm);
}

HandEyeCalibration to_keep(const HandEyeResult& result, const Board& board, const Calibration& calibration) {
  const HandEyeFit& fit = *result.fit;
  HandEyeCalibration kept;
  kept.mounted = result.session.mounted;
  kept.mount_from_rig = fit.places.mount_from_rig;
  kept.covariance = fit.covariance.topLeftCorner<6, 6>();
  kept.distance_mm = result.verdict.distance_mm, kept.error_mm = result.verdict.error_mm;
  kept.verdict = to_string(grade(result.verdict));
  kept.robot_place_mm = fit.noise.place_mm, kept.robot_turn_rad = fit.noise.turn_rad;
  kept.poses = static_cast<int>(result.session.views.size());
  kept.board = to_string(board), kept.date = utc_text(std::chrono::system_clock::now());
  kept.calibration_date = calibration.report.date.value_or("");
  return kept;
}

/// Tells whether further poses cure it.
bool lacks_poses(const HandEyeFinding& finding) {
  using Fault = HandEyeFinding::Fault;
  return finding.fault == Fault::kTooFewPoses || finding.fault == Fault::kOneAxis ||
         finding.fault == Fault::kLittleMotion;
}

/// A proposal of the next pose.
struct Proposal {
  std::string text;
  std::vector<double> numbers;  ///< as the robot writes them; empty: too few views to place the scanner
};

constexpr double kNumbersPerUnit = 1e4;  // so that neither mm nor m loses what a robot can do

Proposal propose(const HandEyeResult& result, const HandEyeRecord& record, const Scanner& scanner) {
  if (!result.fit)
    return {"next pose: tilt the flange by 20° to 35° to another side, with the whole board in the picture", {}};
  const auto next =
      propose_pose(result.session, *result.fit, scanner.calibration, scanner.board, result.verdict.distance_mm);
  if (!next) return {};
  Proposal proposal{{}, robot_numbers(next->base_from_flange, record.notation)};
  for (double& number : proposal.numbers) number = rounded(number, kNumbersPerUnit);
  proposal.text = fmt::format("next pose: {}, to {:.10g}; then points are placed within about {:.2f} mm",
                              describe(*next, result.session), fmt::join(proposal.numbers, ", "), next->error_mm);
  return proposal;
}

Result<> refuse(const HandEyeResult& result, const Proposal& next) {
  std::string text;
  for (const HandEyeFinding& finding : result.findings) text += (text.empty() ? "" : "\n  also: ") + finding.text;
  if (!next.text.empty()) text += "\n  " + next.text;
  return fail(ErrorCode::kMismatch, text);
}

/// @param file  empty: not written, as poses are missing
void tell(const HandEyeRequest& request, const HandEyeResult& result, std::size_t poses, const Proposal& next,
          const std::string& file) {
  if (!request.json) {
    if (!file.empty()) std::cout << result_text(result);
    for (const HandEyeFinding& finding : result.findings) std::cout << finding.text << "\n";
    if (!next.text.empty()) std::cout << next.text << "\n";
    if (!file.empty()) std::cout << "written to " << file << "\n";
    std::cout << std::flush;
    return;
  }
  nlohmann::json told{{"poses", poses}};
  if (!next.text.empty()) told["next"] = next.text;
  if (!next.numbers.empty()) told["next_pose"] = next.numbers;
  if (!result.findings.empty()) told["missing"] = result.findings.front().text;
  if (!file.empty()) {
    told["file"] = file, told["verdict"] = to_string(grade(result.verdict));
    told["distance_mm"] = result.verdict.distance_mm, told["error_mm"] = result.verdict.error_mm;
    told["robot_place_sigma_mm"] = result.fit->noise.place_mm;
    told["robot_turn_sigma_rad"] = result.fit->noise.turn_rad;
  }
  print_line(told);
}

/// Tells whether more views may follow: then too few poses or too little motion are no faults.
bool may_go_on(const HandEyeRequest& request) {
  return request.from_service || !request.pose.empty();
}

/// @param added  the view that was just taken; empty: none
Result<> evaluate(const HandEyeRequest& request, const Scanner& scanner, const std::string& added) {
  const auto output = request.output.empty() ? request.from / "hand_eye.yml" : request.output;
  if (auto writable = check_writable(output); !writable) return writable;
  const auto record = read_record(request, scanner, added);
  if (!record) return tl::unexpected(record.error());
  const auto result = diagnose_hand_eye(*record, request.distance_mm.value_or(usual_distance_mm(*record)));
  if (!result) return tl::unexpected(result.error());
  const bool more = std::ranges::all_of(result->findings, &lacks_poses);
  const bool good = result->findings.empty() && grade(result->verdict) == HandEyeGrade::kGood;
  const Proposal next = more && !good ? propose(*result, *record, scanner) : Proposal();
  if (!result->findings.empty()) {
    if (!may_go_on(request) || !more) return refuse(*result, next);
    tell(request, *result, record->views.size(), next, {});
    return {};
  }
  auto written = write_file_atomically(output, write_hand_eye(to_keep(*result, scanner.board, scanner.calibration)));
  if (written) tell(request, *result, record->views.size(), next, output.string());
  return written;
}

Result<Calibration> calibration_in_force(const std::filesystem::path& file) {
  if (file.empty()) return fail(ErrorCode::kNotFound, "the scanner is not calibrated: run slsctl calibrate first");
  const auto text = read_file(file, kCalibrationBytes);
  if (!text) return tl::unexpected(text.error());
  return read_calibration(*text, file.string());
}

}  // namespace

Result<> hand_eye_from_files(const HandEyeRequest& request) {
  const auto configuration =
      load_configuration_in_force(request.configuration_file, request.json ? std::cerr : std::cout);
  if (!configuration) return tl::unexpected(configuration.error());
  auto calibration = scanner_calibration(*configuration);
  if (!calibration) return tl::unexpected(calibration.error());
  const auto board = board_of(request, *calibration);
  if (!board) return tl::unexpected(board.error());
  const std::string first_camera = configuration->cameras.empty() ? "" : configuration->cameras.front().name();
  return evaluate(request, {std::move(*calibration), *board, first_camera}, {});
}

Result<> hand_eye_by_socket(const HandEyeRequest& request) {
  const auto notation = pose_notation(request.poses);
  if (!notation) return tl::unexpected(notation.error());
  const auto source = SocketSource::create(request.socket);
  if (!source) return tl::unexpected(source.error());
  auto calibration = calibration_in_force((*source)->calibration());
  if (!calibration) return tl::unexpected(calibration.error());
  const auto board = board_of(request, *calibration);
  if (!board) return tl::unexpected(board.error());
  const Scanner scanner{std::move(*calibration), *board, (*source)->cameras().front()};
  if (request.pose.empty()) return evaluate(request, scanner, {});
  const auto view = take_view(**source, request.from, request.pose, *notation);
  if (!view) return tl::unexpected(view.error());
  auto done = evaluate(request, scanner, view->name);
  if (done) return done;
  done.error().message += fmt::format("\n  {} is not kept", view->name);
  if (auto dropped = drop_view(request.from, *view); !dropped) return dropped;
  return done;
}

}  // namespace slsd
