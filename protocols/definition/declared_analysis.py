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
        Field(max_length=20, description="Whose data are left out, and why, in sentences. Default: none declared."),
    ] = ()
