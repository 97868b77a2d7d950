# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Configures and builds a preset of CMakePresets.json.

# configure PRESET [OPTION OF CMAKE...]
configure() {
  if command -v ccache >/dev/null; then
    export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_BASEDIR=$PWD
    export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS-pch_defines,time_macros}  # or ccache keeps nothing that uses precompiled headers
  fi
  cmake --preset "$@" >/dev/null || die "cmake --preset $1 failed"
}

# build PRESET [TARGET...]: installs what the build needs, configures and builds.
build() {
  local preset=$1 targets=("${@:2}")
  case $preset in
    demo) need "${demo_packages[@]}" ;;
    *) need "${build_packages[@]}" ;;
  esac
  say "building into build/$preset"
  configure "$preset"
  cmake --build --preset "$preset" ${targets:+--target "${targets[@]}"}
}

# get_aravis_tools PRESET: unpacks Aravis' fake camera and its test of cameras, without the GTK that their package needs.
get_aravis_tools() {
  local folder=build/$1/aravis-tools
  [ ! -x "$folder/usr/bin/arv-fake-gv-camera-0.8" ] && ! command -v arv-fake-gv-camera-0.8 >/dev/null || return 0
  say "unpacking aravis-tools into $folder"
  mkdir -p "$folder"
  (cd "$folder" && apt-get -qq download aravis-tools && dpkg-deb -x aravis-tools_*.deb .) 2>/dev/null ||
    say "aravis-tools cannot be had; what needs it is skipped"
}

# From the Python package index: ROS 2's client library, its default middleware, and a reader of launch files. Tests of
# slsd-dds that lack them are skipped.
ros_wheels=(ros-kilted-rclpy ros-kilted-rmw-fastrtps-cpp ros-kilted-sensor-msgs ros-kilted-diagnostic-msgs ros-kilted-std-srvs
  numpy pyyaml)
launch_wheel=play_launch==0.16.0  # its dependencies serve other commands than reading launch files
get_ros() {
  local folder=build/ros-venv python=python3.11
  [ "$(cat $folder/wheels 2>/dev/null)" != "${ros_wheels[*]} $launch_wheel" ] || return 0
  say "fetching rclpy of ROS 2 into $folder (75 MB)"
  rm -rf $folder
  if "$python" -m venv $folder && timeout 300 $folder/bin/pip install -q --disable-pip-version-check "${ros_wheels[@]}"; then
    timeout 300 $folder/bin/pip install -q --disable-pip-version-check --no-deps "$launch_wheel" ||
      say "play_launch cannot be had; the test that needs it is skipped"
    echo "${ros_wheels[*]} $launch_wheel" >$folder/wheels
  else
    say "rclpy and play_launch cannot be had; the tests that need them are skipped"
  fi
} >&2

# From the Python package index: independent readers of meshes, for ./run report --model.
mesh_wheels=(numpy open3d==0.20.0 pymeshlab==2025.7.post1 trimesh==5.2.0)
get_mesh_readers() {
  local folder=build/mesh-venv
  [ "$(cat $folder/wheels 2>/dev/null)" != "${mesh_wheels[*]}" ] || return 0
  say "fetching Open3D, MeshLab and trimesh into $folder (500 MB)"
  rm -rf $folder
  python3 -m venv $folder
  $folder/bin/pip install -q --disable-pip-version-check "${mesh_wheels[@]}" ||
    die "Open3D, MeshLab and trimesh cannot be had from the Python package index"
  echo "${mesh_wheels[*]}" >$folder/wheels
} >&2
