// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "core/decode/grid/lattice_frame.hpp"

namespace slsd {

/// Curvature of the map from the pattern to the camera around a symbol: its second derivatives, camera px per projector
/// px squared.
struct Bend {
  Eigen::Vector2f uu{0, 0}, uv{0, 0}, vv{0, 0};
};

/// A symbol of known cell, and the map from the pattern to the camera around it: camera = centre_px + frame d + (uu
/// du^2 + 2 uv du dv + vv dv^2) / 2, d = (du, dv) from its centroid, projector px.
struct LatticeSymbol {
  std::int32_t sighting;                   ///< index in Sightings
  std::int16_t row, column;                ///< cell of the pattern
  Eigen::Vector2f centre_px;               ///< image of the point that the symbol's centroid lights
  LatticeFrame frame;                      ///< camera px for one projector px
  Bend bend;                               ///< zero if no neighbours show it
  float background, gain;                  ///< grey levels of the frame: the dark, and what light adds to it
  float misfit;                            ///< distance of its shape from its letter, standard deviations
  float weight;                            ///< its lit area, camera px squared
  float sigma_px;                          ///< one standard deviation of the centre, in x and in y
  float damage_px;                         ///< possible shift of its centre by an edge that cuts it
  std::array<std::int32_t, 4> neighbours;  ///< by Direction: symbols of the cells beside, linked to it, or -1
};

/// The visible part of the pattern. Points, pictures and alignments are made from it.
struct Lattice {
  std::vector<LatticeSymbol> symbols;
};

}  // namespace slsd
