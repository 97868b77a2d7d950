// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/system/system_error.hpp"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace slsd {
namespace {

constexpr std::string_view kNoDescriptor =
    "no file descriptor is left: end programs that hold many, or raise LimitNOFILE";
constexpr std::string_view kNoMemory = "no memory is left: end other programs, or add memory";

constexpr SystemErrorMeaning kMeanings[] = {
    {ENOENT, ErrorCode::kNotFound, "check the path"},
    {ENOTDIR, ErrorCode::kNotFound, "check the path"},
    {EACCES, ErrorCode::kPermissionDenied, "give this user access to it"},
    {EPERM, ErrorCode::kPermissionDenied, "give this user access to it"},
    {EROFS, ErrorCode::kPermissionDenied, "choose a writable place"},
    {EEXIST, ErrorCode::kAlreadyExists, "choose another name, or remove it"},
    {ENOSPC, ErrorCode::kNoSpace, "free some space or choose another place"},
    {EDQUOT, ErrorCode::kNoSpace, "free some space or choose another place"},
    {EFBIG, ErrorCode::kNoSpace, "free some space or choose another place"},
    {ENOMEM, ErrorCode::kNoSpace, kNoMemory},
    {ENOBUFS, ErrorCode::kNoSpace, kNoMemory},
    {EMFILE, ErrorCode::kNoSpace, kNoDescriptor},
    {ENFILE, ErrorCode::kNoSpace, kNoDescriptor},
    {EISDIR, ErrorCode::kInvalidArgument, "name a file, not a folder"},
    {ENAMETOOLONG, ErrorCode::kInvalidArgument, "choose another path"},
    {ELOOP, ErrorCode::kInvalidArgument, "choose another path"},
    {EBUSY, ErrorCode::kBusy, "end the other program that uses it"},
    {EADDRINUSE, ErrorCode::kBusy, "end the other program that uses it"},
    {ENODEV, ErrorCode::kDisconnected, "check its cable"},
    {ENXIO, ErrorCode::kDisconnected, "check its cable"},
    {EPIPE, ErrorCode::kDisconnected, "connect again"},
    {ECONNRESET, ErrorCode::kDisconnected, "connect again"},
    {ETIMEDOUT, ErrorCode::kTimeout, "check its power and its cable"},
};

constexpr SystemErrorMeaning kAnyOther{0, ErrorCode::kIo, "check the disk or the device, and try again"};

const SystemErrorMeaning* find(std::span<const SystemErrorMeaning> meanings, int number) {
  const auto found = std::ranges::find(meanings, number, &SystemErrorMeaning::number);
  return found == meanings.end() ? nullptr : &*found;
}

const SystemErrorMeaning& meaning(int number, std::span<const SystemErrorMeaning> known) {
  if (const auto* found = find(known, number)) return *found;
  if (const auto* found = find(kMeanings, number)) return *found;
  const auto* other = find(known, 0);
  return other != nullptr ? *other : kAnyOther;
}

}  // namespace

Error system_error(int number, std::string_view doing, std::string where, std::span<const SystemErrorMeaning> known) {
  const SystemErrorMeaning& what = meaning(number, known);
  std::string message = std::string(doing) + ": " + std::generic_category().message(number);
  if (!what.remedy.empty()) message.append("; ").append(what.remedy);
  return {what.code, std::move(message), std::move(where)};
}

}  // namespace slsd
