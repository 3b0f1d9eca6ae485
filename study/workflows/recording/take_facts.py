"""Metadata of a recording: parameters of the feedback, and facts and warnings about each played piece (a take)."""

import math
from dataclasses import asdict
from typing import Any

from protocols.definition.apparatus import SpringSettings
from study.session.facts.sensor_facts import SensorFacts
from study.workflows.recording.play_pieces import PlayedPiece, direction_text


def spring_facts(spring: SpringSettings, effective_mass_kg: float) -> dict[str, Any]:
    """Parameters of the virtual spring: command = excitation - k (position - place) - b velocity, in N, with the
    stiffness k = m (2 pi f0)² from natural frequency f0 and effective mass m, and the damping b."""
    return {
        "kind": "virtual spring about the place",
        "natural_frequency_hz": spring.natural_frequency_hz,
        "stiffness_n_per_m": effective_mass_kg * (2 * math.pi * spring.natural_frequency_hz) ** 2,
        "damping_n_s_per_m": spring.damping_n_s_per_m,
        "effective_mass_kg": effective_mass_kg,
    }


def segment_facts(take: PlayedPiece) -> dict[str, Any]:
    """Metadata of one played piece. Clipped values are counted in ticks; amplitudes in N."""
    piece = take.piece
    return {
        "number": piece.number,
        "frequency_hz": piece.frequency_hz,
        "band_hz": None if piece.band_hz is None else list(piece.band_hz),
        "along": piece.along,
        "unit_vector": None if piece.unit_vector is None else list(piece.unit_vector),
        "realisation": piece.realisation,
        "requested_amplitude_n": take.requested_n,
        "played_amplitude_n": take.played_n,
        "tries": take.tries,
        "sensor_clipped": take.health.sensor_clipped,
        "total_clipped": take.health.total_clipped + take.health.feedback_clipped,
        "sensor": None if take.health.sensor is None else asdict(take.health.sensor),
    }


def warnings_of(take: PlayedPiece) -> list[str]:
    """Sentences for the experimenter on lowered amplitude, clipping, missed ticks, lost packets and the slew limit."""
    health, what = take.health, _piece_text(take)
    found = []
    if take.played_n < take.requested_n:
        found.append(_reduction_warning(take))
    if health.sensor_clipped:
        found.append(f"The accelerometer clipped in {health.sensor_clipped} samples at {take.played_n:.3g} N ({what}).")
    if health.feedback_clipped:
        found.append(f"The spring's pull was limited at its cap at {take.played_n:.3g} N ({what}).")
    if health.total_clipped or health.stimulus_clipped:
        found.append(f"The force was limited at its cap at {take.played_n:.3g} N ({what}).")
    if health.missed_ticks:
        found.append(f"{health.missed_ticks} ticks were missed ({what}); they are NaN.")
    if health.sensor is not None and health.sensor.missing:
        found.append(_sensor_warning(health.sensor, what))
    if health.slew_limited:
        found.append(f"The force was slowed by the slew limit ({what}).")
    return found


def _sensor_warning(sensor: SensorFacts, what: str) -> str:
    """Sentence on lost packets of the accelerometer. what: the piece in words."""
    packets = f"{sensor.lost} of {sensor.lost + sensor.packets} packets of the accelerometer were lost"
    return f"{packets} ({what}); at {sensor.unplaced_ticks} of {sensor.ticks} ticks its acceleration is NaN."


def _piece_text(take: PlayedPiece) -> str:
    """The piece in words: its frequency, or the kind of its excitation, and its direction."""
    piece = take.piece
    kind = f"{piece.frequency_hz:g} Hz" if piece.frequency_hz else piece.segment.kind
    return f"{kind} along {direction_text(piece)}"


def _reduction_warning(take: PlayedPiece) -> str:
    """Sentence on an amplitude that was lowered, here or in an earlier round of the same segment ("as before")."""
    why = []
    if take.sensor_clipped_before:
        why.append(f"the accelerometer clipped in {take.sensor_clipped_before} samples")
    if take.total_clipped_before:
        why.append(f"the force was at its cap for {take.total_clipped_before} ticks")
    reason = " and ".join(why) if why else "as before"
    return f"Played at {take.played_n:.3g} N instead of {take.requested_n:.3g} N ({_piece_text(take)}): {reason}."
