# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
"""Types of the options, so that a type checker finds misspelled ones."""
from __future__ import annotations

from typing import List, Literal, Optional, TypedDict

Density = Literal["symbols", "pixels"]
"""A point for each symbol of the pattern, or for each camera pixel."""

Picture = Literal["pattern", "idle", "black", "white", "focus", "grid", "image"]
"""The pictures that the projector can show."""

Code = Literal["pattern", "gray"]
"""The pictures that a calibration projects onto the board."""

_Method = Optional[Literal["default", "paper"]]


class DecodeSettings(TypedDict, total=False):
    """Keys of the table [decode]; None takes a setting back. slsd.toml(5) explains each."""

    depth_min_mm: Optional[float]
    depth_max_mm: Optional[float]
    wrong_cells_max: Optional[float]
    precision: Optional[Literal["standard", "fine"]]
    density: Optional[Density]
    dense_stride_px: Optional[int]
    dense_prune_px: Optional[float]
    binarize: _Method
    find_regions: _Method
    classify: _Method
    centre: _Method
    link_grid: _Method
    decode_windows: _Method
    correspond: _Method


class CloudSettings(TypedDict, total=False):
    """Keys of the table [cloud]: the part of the scene to measure."""

    box: Optional[List[float]]
    plane: Optional[List[float]]
    box_frame: Optional[Literal["rig", "robot_base"]]
    voxel_mm: Optional[float]
    stride: Optional[int]


class CalibrationSettings(TypedDict, total=False):
    """Keys of the table [calibration]. The file is on the scanner's machine, and the service reads it as its user."""

    file: Optional[str]
    other_hardware: Optional[Literal["error", "warn"]]


class PatternSettings(TypedDict, total=False):
    """Keys of the table [pattern]. They replace the whole table."""

    file: Optional[str]
    symbol_size_px: Optional[int]
    spacing_px: Optional[int]
    symbols: Optional[List[int]]
    seed: Optional[int]
    method: Optional[Literal["constructive", "no_repeats", "paper"]]
    minimum_distance: Optional[int]
    half_turn_unique: Optional[bool]
    row_reach: Optional[int]
    column_reach: Optional[int]


class CameraSettings(TypedDict, total=False):
    """Settings of a camera: its exposure time, and its gain in dB or in the camera's own steps."""

    exposure_us: Optional[float]
    gain_db: Optional[float]
    gain_steps: Optional[int]
