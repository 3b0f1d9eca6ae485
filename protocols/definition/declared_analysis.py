"""Declared analysis: the part of a preregistration that a program can check, fixed before data are collected."""

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from protocols.definition.staircase_rule import STRICT


@dataclass(frozen=True, config=STRICT)
class AnalysisSettings:
    """Declared before the data. Fixed, with all else, by `hapteq protocol lock`."""

    primary: Annotated[
        Literal["undeclared", "hierarchical", "published"],
        Field(
            description="Which analysis decides, and with it how the interval of the contrast is computed. "
            "'hierarchical': one psychometric model of all answers, 95 % interval over people's differences in dB (t); "
            "'published': one-way analysis of reversal means with Tukey's 95 % intervals. Default: undeclared, and the "
            "report says so."
        ),
    ] = "undeclared"
    contrast_hz: Annotated[
        tuple[float, ...],
        Field(
            max_length=2,
            description="The primary contrast: the first frequency minus the second. Default: none declared.",
        ),
    ] = ()
    participants: Annotated[
        int, Field(ge=0, le=10_000, description="Planned sample size. Default 0: none declared.")
    ] = 0
    exclusions: Annotated[
        tuple[str, ...],
        Field(max_length=20, description="Whose data are excluded, and why, in sentences. Default: none declared."),
    ] = ()
    interval: Annotated[
        Literal["undeclared", "paired_t", "tukey"],
        Field(
            description="How the 95 % interval of the primary contrast is computed, declared by name. 'paired_t': "
            "over people's differences in dB (t), the interval of 'hierarchical'; 'tukey': Tukey's of means of "
            "runs in newtons, the interval of 'published'. Default: undeclared; the interval is then the one "
            "that belongs to primary."
        ),
    ] = "undeclared"


INTERVALS = {"hierarchical": "paired_t", "published": "tukey"}
"""The interval that each primary analysis computes."""
