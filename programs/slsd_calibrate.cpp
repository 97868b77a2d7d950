// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include <iostream>

#include <glog/logging.h>

#include "drivers/log/logging.hpp"
#include "programs/calibrate/calibrate_from_files.hpp"
#include "programs/calibrate/measure_extrinsics.hpp"
#include "programs/calibrate/session/session.hpp"
#include "programs/command_line.hpp"
#include "programs/verify/keep_correction.hpp"
#include "programs/verify/verify_from_files.hpp"
#include "programs/verify/verify_live.hpp"

namespace {

slsd::Result<> calibrate(const slsd::CommandLine& line) {
  if (line.latency) return slsd::calibrate_latency(line.configuration, line.request.output);
  return line.request.from.empty() ? slsd::calibrate_by_session(line.request)
                                   : slsd::calibrate_from_files(line.request);
}

slsd::Result<> carry_out(const slsd::CommandLine& line) {
  if (!line.print.file.empty()) return slsd::print_board(line.print);
  if (line.calibrate) return calibrate(line);
  if (!line.extrinsics.file.empty()) return slsd::measure_extrinsics(line.extrinsics, line.request);
  if (line.undo) return slsd::undo_correction(line.configuration);
  return line.request.from.empty() ? slsd::verify_live(line.request) : slsd::verify_from_files(line.request);
}

}  // namespace

// Carries out slsd's --calibrate, --verify, --correct, --extrinsics and --print-board.
int main(int argc, char** argv) {
  const auto line = slsd::parse_command_line(argc, argv);
  if (!line) return line.error();
  if (!line->calibrates()) {
    std::cerr << "slsd-calibrate: needs --calibrate, --verify, --correct, --extrinsics or --print-board; slsd is the "
                 "service\n";
    return slsd::kWrongUsage;
  }
  FLAGS_minloglevel = google::GLOG_FATAL;  // the result is judged anyway, so Ceres need not warn
  slsd::start_logging(spdlog::level::from_str(line->level));
  const int status = slsd::exit_status(carry_out(*line));
  slsd::flush_log(slsd::kLogTimeout);
  return status;
}
