// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include "core/image.hpp"
#include "core/result.hpp"
#include "daemon/client/connection.hpp"

namespace slsd {

/// The raw frame that came with a reply or an event, as a view of its bytes.
/// @param about     its description, as docs/protocol.md says
/// @param received  outlives the view
/// @errors kMalformed: not as many bytes as its size asks for
/// @thread reentrant
[[nodiscard]] Result<GreyView> image_of(const nlohmann::json& about, const Received& received);

}  // namespace slsd
