# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Makes a Debian system in a folder.

# make_debian FOLDER [OPTION OF MMDEBSTRAP...]
make_debian() {
  local root=$1
  as_root rm -rf "$root"
  mkdir -p "$(dirname "$root")"
  as_root mmdebstrap --mode=root --dpkgopt=force-unsafe-io "${@:2}" bookworm "$root" >"$root.log" 2>&1 ||
    { tail "$root.log" >&2; die "mmdebstrap failed; all that it wrote is in $root.log"; }
}
