"""Classifies the spectral lines of a periodic excitation: driven ones, and silent ones that detect distortion.

A linear device responds on driven lines only. Where all driven lines are odd multiples of one, odd distortion falls on
odd lines and even distortion on even ones (Schoukens, Vaes and Pintelon 2016). The lines are taken from the measured
excitation, so that any multisine with silent lines is suitable.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.types import Mask
from equalizer.signals.signal import ComplexArray

_SILENT = 3e-3
"""Largest amplitude of a silent line, relative to the strongest line of its input."""


@dataclass(frozen=True, slots=True, eq=False)
class DetectionLines:
    """Masks (lines,), within the driven band."""

    driven: Mask
    odd: Mask
    """Silent lines that only odd distortion reaches."""
    even: Mask
    """Silent lines that only even distortion reaches."""
    either: Mask
    """Silent lines that both reach, because even lines were driven, too."""
    step: int
    """Greatest common divisor of the driven lines' numbers: lines between its multiples detect noise only."""

    @property
    def any_silent(self) -> bool:
        return bool((self.odd | self.even | self.either).any())


def detection_lines(excitation: ComplexArray, held: int = 1) -> DetectionLines | None:
    """Driven lines of a periodic excitation, and silent ones on which distortion shows. excitation: (lines, inputs),
    line k in row k - 1. held: samples for which each value of the command is held; above half of the command's own rate
    there are only images. None where nothing is driven."""
    size = np.abs(excitation)
    size[(len(size) + 1) // held :] = 0
    strongest = size.max()
    if strongest == 0:
        return None
    driven = np.asarray((size > _SILENT * np.maximum(size.max(axis=0), 0.1 * strongest)).any(axis=1))
    numbers = np.arange(1, len(driven) + 1)
    step = int(np.gcd.reduce(numbers[driven]))
    lowest, highest = numbers[driven][[0, -1]]
    silent = ~driven & (numbers >= lowest) & (numbers <= highest) & (numbers % step == 0)
    multiple = numbers // step
    odd_only = bool((multiple[driven] % 2 == 1).all()) and highest > lowest
    none = np.zeros(len(driven), dtype=np.bool_)
    if not odd_only:
        return DetectionLines(driven, none, none, np.asarray(silent), step)
    return DetectionLines(
        driven, np.asarray(silent & (multiple % 2 == 1)), np.asarray(silent & (multiple % 2 == 0)), none, step
    )


def hold_length(command: npt.NDArray[np.float64]) -> int:
    """Number of samples for which each value of the command is held. command: (n, inputs)"""
    moves = np.flatnonzero(np.any(np.diff(command, axis=0) != 0, axis=1))
    return int(np.gcd.reduce(np.diff(moves))) if len(moves) > 16 else 1
