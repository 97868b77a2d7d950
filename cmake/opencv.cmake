# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Debian ships OpenCV's CMake package only with all of OpenCV; this finds parts of it: slsd_find_opencv(core imgproc)
function(slsd_find_opencv)
  find_path(OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  foreach(part ${ARGN})
    if(TARGET opencv::${part})
      continue()
    endif()
    find_library(OPENCV_${part}_LIBRARY opencv_${part} REQUIRED)
    add_library(opencv::${part} UNKNOWN IMPORTED GLOBAL)
    set_target_properties(opencv::${part} PROPERTIES
      IMPORTED_LOCATION ${OPENCV_${part}_LIBRARY}
      INTERFACE_INCLUDE_DIRECTORIES ${OPENCV_INCLUDE_DIR})
  endforeach()
endfunction()
