# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Cross-builds core for arm64.

# get_arm64_sysroot FOLDER: unpacks the arm64 packages of build_packages. It installs nothing, and apt and dpkg of this
# machine stay as they are.
get_arm64_sysroot() {
  local sysroot=$1 apt=$PWD/build/arm64/apt wanted=(libc6-dev libstdc++-12-dev libblas-dev liblapack-dev) package archive
  for package in "${build_packages[@]}"; do
    case $package in *-dev) wanted+=("$package") ;; esac
  done
  [ "$(cat "$sysroot/.packages" 2>/dev/null)" != "${wanted[*]}" ] || return 0
  say "unpacking arm64 packages into $sysroot (300 MB to fetch, 1.3 GB on disk)"
  rm -rf "$sysroot" "$apt"
  mkdir -p "$sysroot" "$apt/lists/partial" "$apt/cache/archives/partial"
  : >"$apt/status"
  cat >"$apt/apt.conf" <<CONF
APT::Architecture "arm64";
APT::Architectures { "arm64"; };
APT::Sandbox::User "";
Dir::State "$apt";
Dir::State::lists "$apt/lists";
Dir::State::status "$apt/status";
Dir::Cache "$apt/cache";
Acquire::Languages "none";
Debug::NoLocking "true";
CONF
  { APT_CONFIG=$apt/apt.conf apt-get -q update &&
    APT_CONFIG=$apt/apt.conf apt-get -q -y --no-install-recommends --download-only install "${wanted[@]}"; } \
    >"$apt/log" 2>&1 || die "the arm64 packages cannot be had; all that apt-get wrote is in $apt/log"
  for archive in "$apt"/cache/archives/*.deb; do dpkg-deb -x "$archive" "$sysroot"; done
  rm -rf "$apt/cache"
  # As an installation would: links that begin at the root, alternatives, and paths in Ceres' CMake files.
  local link library
  while read -r link; do ln -srfn "$sysroot$(readlink "$link")" "$link"; done < <(find "$sysroot" -type l -lname '/*')
  for library in blas lapack; do
    (cd "$sysroot/usr/lib/aarch64-linux-gnu" && ln -sf $library/lib$library.so* .)
  done
  # shellcheck disable=SC2016  # CMake sets CMAKE_SYSROOT
  sed -i 's#\([;"]\)/usr/lib/aarch64-linux-gnu/#\1${CMAKE_SYSROOT}/usr/lib/aarch64-linux-gnu/#g' \
    "$sysroot"/usr/lib/aarch64-linux-gnu/cmake/Ceres/*.cmake
  echo "${wanted[*]}" >"$sysroot/.packages"
}

do_arm64() {
  need "${build_packages[@]}" "${arm64_packages[@]}"
  get_arm64_sysroot "$PWD/build/arm64/sysroot"
  build arm64 core_tests
  local program failed=()
  for program in build/arm64/bin/*_tests; do
    say "running $(basename "$program") under emulation"
    (cd build/arm64 && RC_PARAMS=seed=1 qemu-aarch64 -L sysroot "bin/$(basename "$program")" --gtest_brief=1 "$@") ||
      failed+=("$(basename "$program")")
  done
  [ ${#failed[@]} -eq 0 ] || die "failed on arm64: ${failed[*]}"
  say "all of core's unit tests passed on arm64"
}
