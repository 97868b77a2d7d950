# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(tl-expected REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(PNG REQUIRED)
find_package(TIFF 4.5 REQUIRED)
find_package(JPEG REQUIRED)
pkg_check_modules(systemd REQUIRED IMPORTED_TARGET libsystemd)
pkg_check_modules(yaml REQUIRED IMPORTED_TARGET yaml-0.1>=0.2.5)

if(SLSD_DEVICES)
  find_package(Boost 1.74 REQUIRED)  # Asio and Beast, which are headers alone
  find_package(Ceres REQUIRED)
  pkg_check_modules(aravis REQUIRED IMPORTED_TARGET aravis-0.8>=0.8.26)
  pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo>=1.16 cairo-pdf cairo-svg)
  pkg_check_modules(gles REQUIRED IMPORTED_TARGET egl>=1.5 glesv2)
  pkg_check_modules(glfw REQUIRED IMPORTED_TARGET glfw3>=3.3)
  pkg_check_modules(x11 REQUIRED IMPORTED_TARGET x11>=1.7 xext xrandr xcb xcb-present)
  pkg_check_modules(v4l REQUIRED IMPORTED_TARGET libv4l2)
endif()

# Debian ships OpenCV's CMake package only with all of OpenCV; these are the parts that slsd uses.
find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
set(opencv_parts core imgproc)
if(SLSD_DEVICES)
  list(APPEND opencv_parts imgcodecs calib3d features2d aruco structured_light)
endif()
foreach(part ${opencv_parts})
  find_library(OPENCV_${part}_LIBRARY opencv_${part} REQUIRED)
  add_library(opencv::${part} UNKNOWN IMPORTED)
  set_target_properties(opencv::${part} PROPERTIES
    IMPORTED_LOCATION ${OPENCV_${part}_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${OPENCV_INCLUDE_DIR})
endforeach()
