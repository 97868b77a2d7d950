// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/files/system_error.hpp"

#include <cerrno>
#include <system_error>

namespace slsd {
namespace {

struct Meaning {
  ErrorCode code;
  std::string_view remedy;
};

Meaning meaning(int error_number) {
  switch (error_number) {
    case ENOENT:
    case ENOTDIR:
      return {ErrorCode::kNotFound, "check the path"};
    case EACCES:
    case EPERM:
      return {ErrorCode::kPermissionDenied, "give this user access to it"};
    case EROFS:
      return {ErrorCode::kPermissionDenied, "choose a place that may be written"};
    case ENOSPC:
    case EDQUOT:
    case EFBIG:
      return {ErrorCode::kNoSpace, "free some space or choose another place"};
    case EISDIR:
      return {ErrorCode::kInvalidArgument, "name a file, not a folder"};
    case ENAMETOOLONG:
    case ELOOP:
      return {ErrorCode::kInvalidArgument, "choose another path"};
    default:
      return {ErrorCode::kIo, "check the disk and try again"};
  }
}

}  // namespace

Error system_error(int error_number, std::string_view doing, const std::filesystem::path& path) {
  const Meaning what = meaning(error_number);
  const std::string reason = std::generic_category().message(error_number);
  return {what.code, std::string(doing) + ": " + reason + "; " + std::string(what.remedy), path.string()};
}

}  // namespace slsd
