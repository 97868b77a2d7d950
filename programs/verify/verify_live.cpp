// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/verify/verify_live.hpp"

#include <iostream>

#include "daemon/configuration/settings_over.hpp"
#include "daemon/scan/scan_setup.hpp"
#include "programs/calibrate/session/device_source.hpp"
#include "programs/verify/keep_correction.hpp"
#include "programs/verify/verifier.hpp"

namespace slsd {
namespace {

constexpr std::uint8_t kWhite = 255;

Result<std::vector<GreyImage>> look_under(const Grey8& image, PoseSource& source) {
  source.show(image);
  return source.grab();
}

}  // namespace

Result<> verify_live(const CalibrateRequest& request) {
  const auto configuration = load_configuration_in_force(request.configuration_file, std::cout);
  if (!configuration) return tl::unexpected(configuration.error());
  auto pattern = configured_pattern(*configuration);
  if (!pattern) return tl::unexpected(pattern.error());
  auto verifier = Verifier::create(request, *configuration, std::move(*pattern), false);
  if (!verifier) return tl::unexpected(verifier.error());
  const auto source = DeviceSource::create(*configuration);
  if (!source) return tl::unexpected(source.error());
  const ImageSize projector = (*source)->projector();
  auto white = look_under(Grey8(projector.width_px, projector.height_px, kWhite), **source);
  if (!white) return tl::unexpected(white.error());
  auto coded = look_under(draw_pattern(verifier->pattern()), **source);
  if (!coded) return tl::unexpected(coded.error());
  const std::vector<std::string>& cameras = (*source)->cameras();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    CapturedPictures pictures;
    pictures.white = std::move((*white)[i]);
    pictures.coded.push_back(std::move((*coded)[i]));
    if (auto looked = verifier->look("", cameras[i], pictures); !looked) return looked;
  }
  return request.correct ? keep_correction(*verifier, configuration->calibration_file) : verifier->finish();
}

}  // namespace slsd
