// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/verify/verify_from_files.hpp"

#include <iostream>

#include "daemon/configuration/settings_over.hpp"
#include "drivers/files/read_image.hpp"
#include "programs/calibrate/captures/captured_pattern.hpp"
#include "programs/verify/keep_correction.hpp"
#include "programs/verify/verifier.hpp"

namespace slsd {
namespace {

using std::filesystem::path;

Result<> load(const path& file, GreyImage& image) {
  if (file.empty()) return {};
  auto read = read_image(file);
  if (!read) return tl::unexpected(read.error());
  image = std::move(*read);
  return {};
}

Result<CapturedPictures> load(const CaptureFiles& files, bool gray_code) {
  if (files.lack) return tl::unexpected(*files.lack);
  CapturedPictures pictures;
  const std::vector<path> coded = gray_code ? files.gray : std::vector{files.pattern};
  if (coded.empty() || coded.front().empty()) {
    return fail(ErrorCode::kNotFound, gray_code ? "has no gray_00.png ..." : "has no pattern.png");
  }
  if (auto read = load(files.white, pictures.white); !read) return tl::unexpected(read.error());
  for (const path& file : coded) {
    if (auto read = load(file, pictures.coded.emplace_back()); !read) return tl::unexpected(read.error());
  }
  if (!gray_code || files.black.empty()) return pictures;
  if (auto read = load(files.black, pictures.black.emplace()); !read) return tl::unexpected(read.error());
  return pictures;
}

}  // namespace

Result<> verify_from_files(const CalibrateRequest& request) {
  const auto configuration = load_configuration_in_force(request.configuration_file, std::cout);
  if (!configuration) return tl::unexpected(configuration.error());
  const auto poses = list_captures(request.from, WhitePicture::kOptional);
  if (!poses) return tl::unexpected(poses.error());
  auto pattern = captured_pattern(request.from, *configuration);
  if (!pattern) return tl::unexpected(pattern.error());
  const bool gray_code = captured_in_gray(*poses);
  auto verifier = Verifier::create(request, *configuration, std::move(*pattern), gray_code);
  if (!verifier) return tl::unexpected(verifier.error());
  for (const CapturedPose& pose : *poses) {
    for (const auto& [camera, files] : pose.cameras) {
      const auto pictures = load(files, gray_code);
      if (!pictures) return fail(pictures.error().code, to_string(pictures.error()), pose.name + " " + camera);
      if (auto looked = verifier->look(pose.name, camera, *pictures); !looked) return looked;
    }
  }
  return request.correct ? keep_correction(*verifier, configuration->calibration_file) : verifier->finish();
}

}  // namespace slsd
