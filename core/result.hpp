// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <tl/expected.hpp>

namespace slsd {

/// Kind of a failure. Callers act on the code; users act on the message. Add new codes at the end: clients know each by
/// its number.
enum class ErrorCode {
  kInvalidArgument,  ///< a value outside its range: a configuration key, an option, a request's parameter
  kMalformed,        ///< a file or message that does not parse, or lacks a required part
  kMismatch,         ///< two things that are each correct but do not belong together
  kImpossible,       ///< the request cannot exist; the message names the bound that forbids it
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
  kFrameLate,     ///< not received by its deadline
  kFrameSkewed,   ///< the cameras' frames are from different exposures
};

/// "frame_stale": the name that outside programs compare, so it never changes.
[[nodiscard]] constexpr std::string_view to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return "invalid_argument";
    case ErrorCode::kMalformed:
      return "malformed";
    case ErrorCode::kMismatch:
      return "mismatch";
    case ErrorCode::kImpossible:
      return "impossible";
    case ErrorCode::kNotFound:
      return "not_found";
    case ErrorCode::kPermissionDenied:
      return "permission_denied";
    case ErrorCode::kAlreadyExists:
      return "already_exists";
    case ErrorCode::kNoSpace:
      return "no_space";
    case ErrorCode::kIo:
      return "io";
    case ErrorCode::kUnsupported:
      return "unsupported";
    case ErrorCode::kBusy:
      return "busy";
    case ErrorCode::kTimeout:
      return "timeout";
    case ErrorCode::kCancelled:
      return "cancelled";
    case ErrorCode::kDisconnected:
      return "disconnected";
    case ErrorCode::kFrameDropped:
      return "frame_dropped";
    case ErrorCode::kFrameTorn:
      return "frame_torn";
    case ErrorCode::kFrameStale:
      return "frame_stale";
    case ErrorCode::kFrameLate:
      return "frame_late";
    case ErrorCode::kFrameSkewed:
      return "frame_skewed";
  }
  return {};
}

/// A failure outside the program: a code, a message that says what to do, and its origin (file:line:column, key,
/// device, or empty).
struct Error {
  ErrorCode code;
  std::string message;
  std::string where;
};

template <class T = void>
using Result = tl::expected<T, Error>;

/// Makes the error state of any Result<T>.
inline tl::unexpected<Error> fail(ErrorCode code, std::string message, std::string where = {}) {
  return tl::unexpected<Error>(Error{code, std::move(message), std::move(where)});
}

/// "where: message", or the message alone.
inline std::string to_string(const Error& error) {
  return error.where.empty() ? error.message : error.where + ": " + error.message;
}

}  // namespace slsd
