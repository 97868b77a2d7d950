// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/calibrate/finish_calibration.hpp"
#include "core/utc_text.hpp"

#include <algorithm>
#include <iostream>
#include <utility>

#include <fmt/format.h>

#include "daemon/calibrate/keep_calibration.hpp"
#include "daemon/calibrate/outcome_text.hpp"
#include "daemon/calibrate/report/report_html.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

path report_of(path file) {
  return file.replace_extension(".html");
}

// What cannot be written is told before poses are taken, not after.
Result<path> checked(path file, const std::string& named_by) {
  if (report_of(file) == file) {
    return fail(
        ErrorCode::kInvalidArgument,
        "is where the report goes, which is written beside the calibration as .html: name it otherwise, such as "
        "calibration.yml",
        named_by);
  }
  for (const path& written : {file, report_of(file)}) {
    if (auto place = check_writable(written); !place) {
      Error error = place.error();
      error.message +=
          "; nothing was begun: the calibration and its report are to be written there, or where --output says";
      return tl::unexpected(std::move(error));
    }
  }
  return file;
}

Result<> write_report(const path& file, const CalibrationOutcome& outcome) {
  const path report = report_of(file);
  auto written = write_file_atomically(report, report_html(outcome));
  if (written) std::cout << "report: " << report.string() << "\n";
  return written;
}

/// Whether a calibration may replace the one in force without being asked to.
Result<> check_gain(const CalibrateRequest& request, const CalibrationOutcome& outcome, const path& file) {
  const Grade grade = outcome.verdict.grade;
  const std::string nevertheless =
      request.socket.empty() ? ", or keep it nevertheless by --output " + file.string() : std::string();
  if (grade == Grade::kBad) {
    return fail(ErrorCode::kImpossible,
                "the calibration is bad and was not put in force; take the poses again as advised" + nevertheless,
                file.string());
  }
  const auto in_force = grade_in_force(outcome.calibration, file);
  if (!in_force || *in_force >= grade) return {};
  return fail(
      ErrorCode::kImpossible,
      fmt::format("the calibration is {}, and the one in force is {}: that stays; take more poses, as advised{}, "
                  "such as where the rig has changed since",
                  to_string(grade), to_string(*in_force), nevertheless),
      file.string());
}

}  // namespace

Result<path> file_to_keep(const CalibrateRequest& request, const Configuration& configuration) {
  if (!request.output.empty()) return checked(request.output, "--output " + request.output.string());
  if (!configuration.calibration_file.empty()) {
    return checked(configuration.calibration_file, "[calibration] file " + configuration.calibration_file.string());
  }
  return fail(
      ErrorCode::kInvalidArgument,
      "nowhere to keep the calibration: run slsctl calibrate while the service runs, which keeps it and takes it "
      "into force; or name a file by --output, or in [calibration] of the configuration");
}

CalibrateOptions calibrate_options(const Configuration& configuration) {
  return {configuration.decode.depth_min_mm, configuration.decode.depth_max_mm};
}

Result<> finish_calibration(const CalibrateRequest& request, const path& file, const path& in_force, const Board& board,
                            const std::vector<PoseReport>& refused, CalibrationOutcome outcome) {
  outcome.poses.insert(outcome.poses.end(), refused.begin(), refused.end());
  std::ranges::sort(outcome.poses, {}, [](const PoseReport& pose) { return std::pair(pose.subject, pose.name); });
  outcome.calibration.report.board = to_string(board);
  outcome.calibration.report.date = utc_text(std::chrono::system_clock::now());
  std::cout << outcome_text(outcome) << std::flush;
  if (request.output.empty() || !request.socket.empty()) {
    const std::string scale = request.force ? "" : other_scale(outcome, board, in_force);
    if (!scale.empty()) {
      return fail(
          ErrorCode::kMismatch,
          scale + ". Where the new one is right, replace that in force by --force, or keep it elsewhere by --output",
          in_force.string());
    }
    if (auto gain = check_gain(request, outcome, in_force); !gain) return gain;
  }
  if (auto reported = write_report(file, outcome); !reported) return reported;
  const auto kept = keep_calibration(outcome, file);
  if (!kept) return tl::unexpected(kept.error());
  std::cout << *kept << "\n";
  return {};
}

}  // namespace slsd
