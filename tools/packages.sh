# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# The Debian packages that each command needs, and their installation.

# For slsd and slsctl on recorded frames
demo_packages=(g++ cmake ninja-build pkg-config libexpected-dev libtomlplusplus-dev nlohmann-json3-dev libfmt-dev
  libspdlog-dev libcli11-dev libasio-dev libsystemd-dev libeigen3-dev libopencv-core-dev libopencv-imgproc-dev
  libpng-dev libtiff-dev libjpeg-dev libyaml-dev libseccomp-dev)
build_packages=("${demo_packages[@]}"
  libopencv-imgcodecs-dev libopencv-calib3d-dev libopencv-features2d-dev libopencv-contrib-dev
  libcairo2-dev libgtest-dev libgmock-dev librapidcheck-dev libceres-dev
  libbenchmark-dev libv4l-dev libfuse3-dev libaravis-dev libusb-1.0-0-dev
  libegl-dev libgles-dev libgl1-mesa-dri libegl-mesa0 libglfw3-dev libx11-dev libxext-dev libxrandr-dev libxcb1-dev
  libxcb-present-dev libboost-dev libfastrtps-dev libfastcdr-dev libopenvdb-dev lib3mf-dev)
# For every room that is built alone; room_packages has the rest
core_packages=(g++ cmake ninja-build pkg-config libeigen3-dev libfmt-dev libexpected-dev libgtest-dev libgmock-dev
  librapidcheck-dev python3 tzdata)
test_packages=(tzdata cyclonedds-dev cyclonedds-tools python3 python3-venv python3-numpy python3-prometheus-client python3-yaml mypy
  systemd poppler-utils librsvg2-bin fuse3 xvfb xserver-xorg-core xserver-xorg-video-dummy x11-xserver-utils
  chromium chromium-driver libjs-three python3-markdown python3-matplotlib mandoc zsh fish
  liburdfdom-tools python3-setuptools assimp-utils)
site_packages=(python3 python3-markdown mandoc)
lint_packages=(git clang-format clang-tidy shellcheck)
fuzz_packages=(clang libclang-rt-14-dev)
coverage_packages=(gcovr)
profile_packages=("${build_packages[@]}" linux-perf python3)
package_packages=(build-essential debhelper dh-python dpkg-dev lintian)
machine_packages=(mmdebstrap systemd-container util-linux python3)
guest_packages=(qemu-system-x86 busybox-static cpio kmod e2fsprogs)
arm64_packages=(g++-aarch64-linux-gnu qemu-user)
all_packages=("${build_packages[@]}" "${test_packages[@]}" "${lint_packages[@]}" "${fuzz_packages[@]}"
  "${coverage_packages[@]}" "${profile_packages[@]}" "${package_packages[@]}" "${machine_packages[@]}" "${guest_packages[@]}"
  "${arm64_packages[@]}")

# room_packages ROOM: prints what the room needs besides core_packages.
room_packages() {
  local pictures='libpng-dev libtiff-dev libjpeg-dev'
  local decoder='libtomlplusplus-dev libopencv-core-dev libopencv-imgproc-dev'
  case $1 in
    core/text | core/cloud | core/mesh | core/geometry) echo ;;
    core/code) echo libtomlplusplus-dev ;;
    core/calibration_file) echo libyaml-dev libopencv-core-dev ;;
    core/exposure) echo "$pictures" ;;
    core/appearance | core/regions | core/paper | core/decode | core/dense | picture | simulator) echo "$decoder" ;;
    *) echo "$decoder $pictures" libopencv-{calib3d,features2d,contrib}-dev libceres-dev libcairo2-dev ;;
  esac
}

installed() { [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

# need PACKAGE...: installs those that are missing.
need() {
  command -v dpkg-query >/dev/null || die "this is not Debian; install the equivalents of: $*"
  local missing=() package
  for package; do installed "$package" || missing+=("$package"); done
  [ ${#missing[@]} -gt 0 ] || return 0
  say "installing from Debian$([ "$(id -u)" -eq 0 ] || echo ' (by sudo)'): ${missing[*]}"
  apt_get update
  apt_get install --no-install-recommends -y "${missing[@]}"
}

# Reads apt's status lines and shows its progress: one line on a terminal, otherwise a line for every quarter.
show_progress() {
  local kind percent what='' before='' quarter
  while IFS=: read -r kind _ percent _; do
    case $kind in
      dlstatus) what=downloading ;;
      pmstatus) what=installing ;;
      *) continue ;;
    esac
    percent=${percent%%.*}
    quarter="$what $((percent / 25 * 25)) %"
    if [ -t 1 ]; then
      printf '\rrun: %s %d %%    ' "$what" "$percent"
    elif [ "$quarter" != "$before" ]; then
      say "$quarter"
    fi
    before=$quarter
  done
  if [ -t 1 ] && [ -n "$what" ]; then echo; fi
}

# apt_get ARGUMENT...: waits for apt's lock, and shows the errors of apt and dpkg if they fail.
apt_get() {
  local log
  log=$(mktemp)
  if as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300 -o APT::Status-Fd=1 "$@" 2>&1 |
    tee "$log" | show_progress; then
    rm -f "$log"
    return 0
  fi
  grep -E '^(E:|W:|dpkg:|Err:)' "$log" >&2 || tail -n 20 "$log" >&2
  die "apt-get $1 failed; all that it wrote is in $log"
}
