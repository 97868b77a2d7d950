// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "core/decode/decode_in_light.hpp"

#include "core/exposure/divide_light.hpp"

namespace slsd {

Result<const Decoding*> decode_in_light(Decoder& decoder, const GreyView& frame, const SceneLight& light,
                                        StageObserver* observer, Executor* executor) {
  auto plain = decoder.decode(frame, light.full, observer, executor);
  if (!plain || !light.white) return plain;
  const std::size_t points = (*plain)->points.size();
  const auto quotient = divide_light(frame, *light.white, light.dark);
  if (!quotient) return tl::unexpected(quotient.error());
  auto divided = decoder.decode(quotient->view(), kQuotientFull, observer, executor);
  if (!divided || (*divided)->points.size() >= points) return divided;
  return decoder.decode(frame, light.full, observer, executor);
}

}  // namespace slsd
