// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/verify/keep_correction.hpp"

#include <chrono>
#include <iostream>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "core/calibration_file/calibration_file.hpp"
#include "core/utc_text.hpp"
#include "daemon/configuration/settings_over.hpp"
#include "drivers/files/file.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

constexpr std::size_t kMaxFileBytes = 1 << 20;
constexpr const char* kWhenInForce = "If slsd is running, run systemctl reload slsd to use this calibration";

path uncorrected(path file) {
  file += ".uncorrected";
  return file;
}

void print(const std::vector<DeviationAt>& deviations, bool corrected) {
  constexpr double kIn95Percent = 1.96;
  for (const DeviationAt& at : deviations) {
    const double within_mm = kIn95Percent * at.sigma_mm;
    std::cout << fmt::format("at {:.0f} mm: points are off by {:.2f} +- {:.2f} mm{}\n", at.depth_mm, at.before_mm,
                             within_mm, corrected ? fmt::format("; corrected, by at most {:.2f} mm", within_mm) : "");
  }
}

struct KeptCalibration {
  std::string text;
  Calibration calibration;
};

Result<KeptCalibration> read(const path& file) {
  auto text = read_file(file, kMaxFileBytes);
  if (!text) return tl::unexpected(text.error());
  auto calibration = read_calibration(*text, file.string());
  if (!calibration) return tl::unexpected(calibration.error());
  return KeptCalibration{std::move(*text), std::move(*calibration)};
}

}  // namespace

Result<> keep_correction(const Verifier& verifier, const path& file) {
  auto correction = verifier.find_correction();
  if (!correction) {
    return fail(correction.error().code, to_string(correction.error()) + ". Nothing was changed", file.string());
  }
  print(correction->deviations, correction->needed);
  if (!correction->needed) {
    std::cout << "the calibration holds: nothing was changed\n";
    return {};
  }
  std::cout << correction->drift << "\n";
  verifier.check_again(correction->calibration);
  const auto before = read(file);
  if (!before) return tl::unexpected(before.error());
  const auto& earlier = before->calibration.report.corrected;
  if (!earlier) {
    if (auto kept = write_file_atomically(uncorrected(file), before->text); !kept) return kept;
  }
  correction->calibration.report.corrected = fmt::format("{}{} {}", earlier ? *earlier + "; " : "",
                                                         utc_text(std::chrono::system_clock::now()), correction->drift);
  if (auto written = write_file_atomically(file, write_calibration(correction->calibration)); !written) return written;
  std::cout << fmt::format("corrected {}; slsd --correct --undo restores {}. {}\n", file.string(),
                           uncorrected(file).string(), kWhenInForce);
  return {};
}

Result<> undo_correction(const std::optional<path>& configuration_file) {
  const auto configuration = load_configuration_in_force(configuration_file, std::cout);
  if (!configuration) return tl::unexpected(configuration.error());
  const path& file = configuration->calibration_file;
  if (file.empty()) return fail(ErrorCode::kNotFound, "no calibration is configured, so there is nothing to undo");
  const auto now = read(file);
  if (!now) return tl::unexpected(now.error());
  if (!now->calibration.report.corrected) {
    return fail(ErrorCode::kNotFound, "was not corrected since it was calibrated, so there is nothing to undo",
                file.string());
  }
  const auto before = read(uncorrected(file));
  if (!before) return tl::unexpected(before.error());
  if (before->calibration.report.date != now->calibration.report.date) {
    return fail(ErrorCode::kMismatch, "differs in date from the calibration in force: nothing was changed",
                uncorrected(file).string());
  }
  if (auto written = write_file_atomically(file, before->text); !written) return written;
  std::error_code ignored;
  std::filesystem::remove(uncorrected(file), ignored);
  std::cout << fmt::format("{} is as it was calibrated{}. {}\n", file.string(),
                           now->calibration.report.date ? " on " + *now->calibration.report.date : "", kWhenInForce);
  return {};
}

}  // namespace slsd
