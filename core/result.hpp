// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <utility>

#include <tl/expected.hpp>

namespace slsd {

/// What failed. A caller may act on the code; a person acts on the message.
enum class ErrorCode {
  kInvalidArgument,  ///< a value outside its range: a configuration key, an option, a request's parameter
  kMalformed,        ///< a file or message that does not parse, or lacks a required part
  kMismatch,         ///< two things that are each right and do not belong together
  kImpossible,       ///< what was asked for cannot exist; the message names the bound that forbids it
  kNotFound,
  kPermissionDenied,
  kAlreadyExists,
  kNoSpace,
  kIo,
  kUnsupported,
  kBusy,
  kTimeout,
  kCancelled,
  kDisconnected,  ///< the device is gone
  kFrameDropped,  ///< the device reports, or the sequence numbers show, that a frame was lost
  kFrameTorn,     ///< fewer bytes than a frame, or parts of two frames
  kFrameStale,    ///< exposed before the pattern was visible
  kFrameLate,     ///< not there by its deadline
  kFrameSkewed,   ///< the cameras' frames are not of the same exposure
};

/// The world failed: a code, a message that says what to do, and where it arose (file:line:column, key, device, or
/// empty).
struct Error {
  ErrorCode code;
  std::string message;
  std::string where;
};

template <class T = void>
using Result = tl::expected<T, Error>;

/// Makes the failed state of any Result<T>.
inline tl::unexpected<Error> fail(ErrorCode code, std::string message, std::string where = {}) {
  return tl::unexpected<Error>(Error{code, std::move(message), std::move(where)});
}

/// "where: message", or the message alone.
inline std::string to_string(const Error& error) {
  return error.where.empty() ? error.message : error.where + ": " + error.message;
}

}  // namespace slsd
