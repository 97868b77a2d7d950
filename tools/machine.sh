# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Tests the packages on whole Debian systems.

# get_debian FOLDER: makes a Debian with what the packages depend on, and keeps it while that is the same.
get_debian() {
  local root=$1 wanted package
  # shellcheck disable=SC2119  # with no argument
  [ -n "$(ls out/package/slsd_*.deb 2>/dev/null)" ] || do_package
  wanted=systemd-sysv,dbus,apt,passwd,udev,kmod,iproute2,procps,psmisc,v4l-utils,xserver-xorg-core,x11-xserver-utils
  wanted+=,libgl1-mesa-dri,libegl1,libgles2,python3-numpy,$(for package in out/package/*.deb; do
    dpkg-deb --field "$package" Depends
  done | tr ',' '\n' | sed 's/[(|:].*//; s/[[:space:]]//g' | grep -vE '^$|slsd' | sort -u | paste -sd,)
  [ "$(cat "$root.packages" 2>/dev/null)" != "$wanted" ] || return 0
  say "making a Debian in $root (200 MB to fetch, 0.8 GB on disk)"
  make_debian "$root" --variant=minbase --include="$wanted" --aptopt='Apt::Install-Recommends "false"'
  echo "$wanted" >"$root.packages"
}

do_lifecycle() {
  need "${machine_packages[@]}"
  get_debian "$PWD/build/machine/root"
  as_root tests/machine/lifecycle.py build/machine/root out/package --rounds "${1:-1000}"
}

# get_guest FOLDER: makes the disk of a QEMU guest, and keeps it while its contents are the same.
get_guest() {
  local folder=$1 programs=(build/release/bin/{usb,gige}-camera tests/doubles/gige/camera.xml) made_of tool
  build release usb-camera gige-camera
  get_aravis_tools release
  tool=build/release/aravis-tools/usr/bin/arv-fake-gv-camera-0.8
  [ -x "$tool" ] || tool=$(command -v arv-fake-gv-camera-0.8) || die "aravis-tools cannot be had"
  programs+=("$tool")
  made_of=$(cat "$PWD/build/machine/root.packages" tests/machine/make_guest.sh tests/machine/agent.py "${programs[@]}" | sha256sum)
  [ "$(cat "$folder/made_of" 2>/dev/null)" != "$made_of" ] || return 0
  say "making the guest's disk in $folder (1 GB)"
  mkdir -p "$folder"
  as_root tests/machine/make_guest.sh build/machine/root "$folder" "${programs[@]}"
  echo "$made_of" >"$folder/made_of"
}

do_machine() {
  local guest=()
  need "${machine_packages[@]}"
  get_debian "$PWD/build/machine/root"
  if [ "${1:-}" = --quick ]; then
    shift
  else
    need "${build_packages[@]}" "${guest_packages[@]}"
    get_guest "$PWD/build/machine/guest"
    guest=(--guest build/machine/guest)
  fi
  as_root env PYTHONDONTWRITEBYTECODE=1 tests/machine/system.py build/machine/root out/package ${guest:+"${guest[@]}"} "$@"
}

# In an empty Debian, with a clone of the last commit.
do_newcomer() {
  local root=$PWD/build/machine/newcomer
  need "${machine_packages[@]}"
  if [ ! -e "$root.made" ]; then
    say "making an empty Debian in $root"
    # shellcheck disable=SC2016  # mmdebstrap sets $1
    make_debian "$root" --variant=minbase --include=systemd-sysv,dbus,sudo,passwd,ca-certificates,git \
      --customize-hook='chroot "$1" useradd -m -s /bin/bash newcomer' \
      --customize-hook='echo "newcomer ALL=(ALL) NOPASSWD: ALL" >"$1/etc/sudoers.d/newcomer"'
    touch "$root.made"
  fi
  rm -rf build/machine/clone
  git clone --quiet . build/machine/clone
  as_root env PYTHONDONTWRITEBYTECODE=1 tests/machine/newcomer.py "$root" build/machine/clone "$@"
}
