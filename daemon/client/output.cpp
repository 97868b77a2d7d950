// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "daemon/client/output.hpp"

#include "drivers/files/file.hpp"

namespace slsd {

tl::expected<void, Failure> write_output(const std::filesystem::path& file, std::string_view bytes) {
  if (auto written = write_file_atomically(file, bytes); !written) {
    return tl::unexpected(Failure{kRequestFailed, rpc_error(written.error())});
  }
  return {};
}

}  // namespace slsd
