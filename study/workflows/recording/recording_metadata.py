"""Metadata of a recording's file, and warnings for the experimenter about its pieces.

The metadata are the parameters of the virtual spring and a description of the kept take of each played piece.
"""

import math
from dataclasses import asdict
from typing import Any

from protocols.definition.apparatus import SpringSettings
from study.session.facts.sensor_facts import SensorFacts
from study.workflows.recording.play_pieces import RecordedTake, describe_piece_direction


def describe_spring(spring: SpringSettings, effective_mass_kg: float) -> dict[str, Any]:
    """Describe the virtual spring as JSON values: command = excitation - k (position - place) - b velocity, in N, with
    the stiffness k = m (2 pi f0)² from natural frequency f0 and effective mass m, and the damping b."""
    return {
        "kind": "virtual spring about the place",
        "natural_frequency_hz": spring.natural_frequency_hz,
        "stiffness_n_per_m": effective_mass_kg * (2 * math.pi * spring.natural_frequency_hz) ** 2,
        "damping_n_s_per_m": spring.damping_n_s_per_m,
        "effective_mass_kg": effective_mass_kg,
    }


def describe_segment(take: RecordedTake) -> dict[str, Any]:
    """Describe the kept take of one piece as JSON values. Clipping is counted in ticks; amplitudes are in N. `number`
    counts the segments of the protocol from 1, `tries` the takes."""
    piece = take.piece
    return {
        "number": piece.number,
        "frequency_hz": piece.frequency_hz,
        "band_hz": None if piece.band_hz is None else list(piece.band_hz),
        "along": piece.direction_name,
        "unit_vector": None if piece.unit_vector is None else list(piece.unit_vector),
        "realisation": piece.realisation,
        "requested_amplitude_n": take.requested_n,
        "played_amplitude_n": take.played_n,
        "tries": take.tries,
        "sensor_clipped": take.health.sensor_clipped,
        "total_clipped": take.health.total_clipped + take.health.feedback_clipped,
        "sensor": None if take.health.sensor is None else asdict(take.health.sensor),
    }


def list_warnings(take: RecordedTake) -> list[str]:
    """List warnings for the experimenter, as sentences: lowered amplitude, clipping of the accelerometer, the spring
    and the force, missed ticks, lost packets, slew limit. Empty without any of these."""
    health, piece_text = take.health, _describe_piece(take)
    warnings = []
    if take.played_n < take.requested_n:
        warnings.append(_describe_reduction(take))
    if health.sensor_clipped:
        warnings.append(
            f"The accelerometer clipped in {health.sensor_clipped} samples at {take.played_n:.3g} N ({piece_text})."
        )
    if health.feedback_clipped:
        warnings.append(f"The spring's pull was limited at its cap at {take.played_n:.3g} N ({piece_text}).")
    if health.total_clipped or health.stimulus_clipped:
        warnings.append(f"The force was limited at its cap at {take.played_n:.3g} N ({piece_text}).")
    if health.missed_ticks:
        warnings.append(f"{health.missed_ticks} ticks were missed ({piece_text}); they are NaN.")
    if health.sensor is not None and health.sensor.missing:
        warnings.append(_describe_lost_packets(health.sensor, piece_text))
    if health.slew_limited:
        warnings.append(f"The force was slowed by the slew limit ({piece_text}).")
    return warnings


def _describe_lost_packets(sensor: SensorFacts, piece_text: str) -> str:
    """Format the warning about missing acceleration. piece_text: the piece in words."""
    lost_packets_text = f"{sensor.lost} of {sensor.lost + sensor.packets} packets of the accelerometer were lost"
    return (
        f"{lost_packets_text} ({piece_text}); at {sensor.unplaced_ticks} of {sensor.ticks} ticks its acceleration is "
        "NaN."
    )


def _describe_piece(take: RecordedTake) -> str:
    """Describe the piece in words: its frequency, or the kind of its excitation, and its direction."""
    piece = take.piece
    kind = f"{piece.frequency_hz:g} Hz" if piece.frequency_hz else piece.segment.kind
    return f"{kind} along {describe_piece_direction(piece)}"


def _describe_reduction(take: RecordedTake) -> str:
    """Format the warning about a lowered amplitude. Its cause is clipping in a discarded take of this piece, or of an
    earlier repetition of the same segment ("as before")."""
    causes = []
    if take.sensor_clipped_before:
        causes.append(f"the accelerometer clipped in {take.sensor_clipped_before} samples")
    if take.total_clipped_before:
        causes.append(f"the force was at its cap for {take.total_clipped_before} ticks")
    reason = " and ".join(causes) if causes else "as before"
    return f"Played at {take.played_n:.3g} N instead of {take.requested_n:.3g} N ({_describe_piece(take)}): {reason}."
