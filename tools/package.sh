# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Builds the Debian packages.

# package_sources FOLDER: copies the files that git knows, as they are now.
package_sources() {
  rm -rf "$1"
  mkdir -p "$1"
  git ls-files -z | tar --create --null --files-from=- --ignore-failed-read 2>/dev/null | tar --extract --directory "$1"
}

# build_packages_in FOLDER LOG [VARIABLE=VALUE...]: builds the packages of these sources into the folder above. An object's
# debug information names its folder. With a base folder, ccache would return objects of other folders.
build_packages_in() {
  local folder=$1 log=$2
  if command -v ccache >/dev/null; then
    set -- "$@" CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_BASEDIR= \
      CCACHE_DIR="$(ccache --get-config cache_dir)"
  fi
  (cd "$folder" && env "${@:3}" dpkg-buildpackage --build=binary --no-sign --jobs=2) >"$log" 2>&1 ||
    { tail -n 30 "$log" >&2; die "dpkg-buildpackage failed; all that it wrote is in $log"; }
}

look_over() {
  say "looking them over by lintian"
  lintian --fail-on error,warning --tag-display-limit 0 "$@" || die "lintian finds fault with the packages"
}

# get_arm64_builder FOLDER: makes a Debian with the cross-compiler and arm64's libraries, and keeps it while
# debian/control is the same. The packages of this machine stay as they are.
get_arm64_builder() {
  local root=$1
  ! cmp -s debian/control "$root.control" || return 0
  say "making a Debian for cross-building in $root (700 MB to fetch, 3 GB on disk)"
  # shellcheck disable=SC2016  # mmdebstrap sets $1
  make_debian "$root" --variant=buildd --architectures=amd64,arm64 --include=crossbuild-essential-arm64 \
    --aptopt='Apt::Install-Recommends "false"' --dpkgopt='path-exclude=/usr/share/doc/*' \
    --customize-hook='mkdir "$1/build"' --customize-hook='copy-in debian /build' \
    --customize-hook='chroot "$1" sh -c "cd /build && apt-get -y --no-install-recommends --host-architecture arm64 --build-profiles cross,nocheck build-dep ./"'
  cp debian/control "$root.control"
}

do_package_arm64() {
  local folder=$PWD/build/package-arm64
  local root=$folder/root
  need "${package_packages[@]}" "${machine_packages[@]}"
  get_arm64_builder "$root"
  package_sources "$folder/slsd"
  as_root rm -rf "$root/build"
  as_root mkdir "$root/build"
  as_root cp -r --no-preserve=ownership "$folder/slsd" "$root/build/"
  say "cross-building the packages, log in $folder/log"
  # shellcheck disable=SC2016
  as_root unshare --mount sh -c 'mount -t proc proc "$0/proc" && exec chroot "$0" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C \
    DEB_BUILD_PROFILES="cross nocheck" DEB_BUILD_OPTIONS="parallel=2 nocheck" \
    sh -c "cd /build/slsd && dpkg-buildpackage --host-arch arm64 --build=any --no-sign"' "$root" >"$folder/log" 2>&1 ||
    { tail -n 30 "$folder/log" >&2; die "dpkg-buildpackage failed; all that it wrote is in $folder/log"; }
  look_over "$root"/build/*.changes
  rm -rf out/package-arm64
  mkdir -p out/package-arm64
  cp "$root"/build/*_arm64.deb out/package-arm64/
  say "wrote $(echo out/package-arm64/*.deb)"
}

# do_package [--twice | arm64]
# shellcheck disable=SC2120  # ./run passes the arguments
do_package() {
  local twice=no
  case ${1:-} in
    '') ;;
    --twice) twice=yes ;;
    arm64) do_package_arm64; return ;;
    *) refuse ;;
  esac
  need "${build_packages[@]}" "${package_packages[@]}"
  local folder=$PWD/build/package
  mkdir -p "$folder"
  rm -f "$folder"/*.deb "$folder"/*.changes "$folder"/*.buildinfo
  package_sources "$folder/slsd"
  say "building the packages in $folder/slsd, log in $folder/log"
  build_packages_in "$folder/slsd" "$folder/log"
  look_over "$folder"/*.changes
  mkdir -p out/package
  rm -f out/package/*
  cp "$folder"/*.deb out/package/
  if [ $twice = yes ]; then
    say "building them again, every object anew"
    mv "$folder/slsd" "$folder/first"
    package_sources "$folder/slsd"
    (umask 027 && build_packages_in "$folder/slsd" "$folder/log-2" CCACHE_DISABLE=1 TZ=Asia/Tokyo LC_ALL=C LANG=C)
    rm -rf "$folder/first"
    local package
    for package in out/package/*.deb; do
      cmp "$package" "$folder/$(basename "$package")" || die "$(basename "$package") is another at each build"
    done
    say "the same bytes both times"
  fi
  (cd out/package && sha256sum ./*.deb)
  say "wrote $(echo out/package/*.deb)"
}
