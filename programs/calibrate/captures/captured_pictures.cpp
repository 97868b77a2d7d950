// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/calibrate/captures/captured_pictures.hpp"

namespace slsd {

PosePictures CapturedPictures::views() const {
  PosePictures pictures{view(white), {}, std::nullopt};
  for (const GreyImage& image : coded) pictures.coded.push_back(view(image));
  if (black) pictures.black = view(*black);
  return pictures;
}

}  // namespace slsd
