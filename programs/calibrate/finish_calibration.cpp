// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/finish_calibration.hpp"
#include "core/utc_text.hpp"

#include <algorithm>
#include <iostream>
#include <utility>

#include <fmt/format.h>

#include "drivers/files/file.hpp"
#include "programs/calibrate/keep_calibration.hpp"
#include "programs/calibrate/outcome_text.hpp"
#include "programs/calibrate/report/report_html.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

path report_of(path file) {
  return file.replace_extension(".html");
}

// Reports an unwritable file before poses are taken, not after.
Result<path> checked(path file, const std::string& named_by) {
  if (report_of(file) == file) {
    return fail(ErrorCode::kInvalidArgument,
                "would be overwritten by the report, which has the same name with .html: choose another name, such as "
                "calibration.yml",
                named_by);
  }
  for (const path& written : {file, report_of(file)}) {
    if (auto place = check_writable(written); !place) {
      Error error = place.error();
      error.message +=
          "; slsd has not started to calibrate, because it writes the calibration and its report there: make it "
          "writable, or choose another place with --output";
      return tl::unexpected(std::move(error));
    }
  }
  return file;
}

Result<> write_report(const path& report, const std::string& html) {
  auto written = write_file_atomically(report, html);
  if (written) std::cout << "report: " << report.string() << "\n";
  return written;
}

/// The report of a refused calibration. It is beside the one in force, whose own report stays.
path report_of_refused(const path& file) {
  return file.parent_path() / (file.stem().string() + "-refused.html");
}

/// Checks that a calibration may replace the one in force without a request.
Result<> check_gain(const CalibrateRequest& request, const CalibrationOutcome& outcome, const Board& board,
                    const path& in_force) {
  const std::string nevertheless =
      request.socket.empty() ? ", or keep it anyway with --output " + in_force.string() : std::string();
  if (outcome.verdict.grade == Grade::kBad) {
    return fail(ErrorCode::kImpossible,
                "the calibration is bad and was not put in force; take the poses again as advised" + nevertheless,
                in_force.string());
  }
  const auto before = calibration_in_force(outcome.calibration, in_force);
  if (!before) return {};
  const auto changed = compare_with_force(outcome, board, *before, request.force);
  if (!changed) {
    const Error& error = changed.error();
    return fail(error.code, error.message + (error.code == ErrorCode::kImpossible ? nevertheless : ""),
                in_force.string());
  }
  if (!changed->empty()) std::cout << *changed << "\n";
  return {};
}

}  // namespace

Result<path> file_to_keep(const CalibrateRequest& request, const Configuration& configuration) {
  if (!request.output.empty()) return checked(request.output, "--output " + request.output.string());
  if (!configuration.calibration_file.empty()) {
    return checked(configuration.calibration_file, "[calibration] file " + configuration.calibration_file.string());
  }
  return fail(ErrorCode::kInvalidArgument,
              "no place to save the calibration: run slsctl calibrate, through which the service saves and uses it; or "
              "give a file with --output, or as [calibration] file");
}

CalibrateOptions calibrate_options(const Configuration& configuration, const Board& board) {
  return {configuration.decode.depth_min_mm, configuration.decode.depth_max_mm, board.sheet_mm()};
}

Error refused(const path& file, Error error, const std::vector<PoseReport>& poses) {
  const auto reported = write_report(report_of_refused(file), refusal_html(error.message, poses));
  if (!reported) std::cout << "cannot write the report: " << to_string(reported.error()) << "\n";
  return error;
}

Result<> finish_calibration(const CalibrateRequest& request, const path& file, const path& in_force, const Board& board,
                            const std::vector<PoseReport>& refused, CalibrationOutcome outcome) {
  outcome.poses.insert(outcome.poses.end(), refused.begin(), refused.end());
  std::ranges::sort(outcome.poses, {}, [](const PoseReport& pose) { return std::pair(pose.subject, pose.name); });
  outcome.calibration.report.board = to_string(board);
  outcome.calibration.report.date = utc_text(std::chrono::system_clock::now());
  std::cout << outcome_text(outcome) << std::flush;
  if (request.output.empty() || !request.socket.empty()) {
    if (auto gain = check_gain(request, outcome, board, in_force); !gain) {
      if (auto reported = write_report(report_of_refused(file), report_html(outcome, gain.error().message)); !reported)
        return reported;
      return gain;
    }
  }
  if (auto reported = write_report(report_of(file), report_html(outcome)); !reported) return reported;
  const auto kept = keep_calibration(outcome, file);
  if (!kept) return tl::unexpected(kept.error());
  std::cout << *kept << "\n";
  return {};
}

}  // namespace slsd
