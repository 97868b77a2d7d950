# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
set(SLSD_ROOMS "" CACHE STRING "Rooms of core, or picture, to build and test without all others, as core/geometry;core/code; empty: all rooms")

# Adds the rooms named that are not there yet. A room begins with those that it is built on.
function(slsd_use_rooms)
  foreach(room ${ARGN})
    get_property(is_there GLOBAL PROPERTY slsd_has_${room})
    if(NOT is_there)
      set_property(GLOBAL PROPERTY slsd_has_${room} YES)
      add_subdirectory(${PROJECT_SOURCE_DIR}/${room} ${PROJECT_BINARY_DIR}/${room})
    endif()
  endforeach()
endfunction()
