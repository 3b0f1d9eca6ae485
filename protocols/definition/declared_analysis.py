"""Preregistered analysis of a study protocol, as far as a program can check it. Part of `study_protocol`.

`study_contradictions` checks it against the other tables; `analysis.psychophysics.declared_result` evaluates it.
"""

from typing import Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from protocols.definition.staircase_rule import STRICT


@dataclass(frozen=True, config=STRICT)
class AnalysisSettings:
    """Analysis that is declared before the data are collected; `hapteq protocol lock` fixes it with the rest of the
    protocol."""

    primary: Literal["undeclared", "hierarchical", "published"] = Field(
        default="undeclared",
        description="The primary analysis, which decides. It determines how the interval of the contrast is "
        "computed. 'hierarchical': one psychometric model of all answers, 95 % interval over people's "
        "differences in dB (t); 'published': one-way analysis of reversal means with Tukey's 95 % intervals. "
        "Default: undeclared, which the report states.",
    )
    contrast_hz: tuple[float, ...] = Field(
        default=(),
        max_length=2,
        description="The primary contrast: the first frequency minus the second. Default: none declared.",
    )
    participants: int = Field(default=0, ge=0, le=10_000, description="Planned sample size. Default 0: none declared.")
    exclusions: tuple[str, ...] = Field(
        default=(), max_length=20, description="Which data are excluded, and why, in sentences. Default: none declared."
    )
    interval: Literal["undeclared", "paired_t", "tukey"] = Field(
        default="undeclared",
        description="Method of the 95 % interval of the primary contrast, declared by name. 'paired_t': over "
        "people's differences in dB (t), the interval of 'hierarchical'; 'tukey': Tukey's interval of means of "
        "runs in newtons, the interval of 'published'. Default: undeclared; the interval is then that of the "
        "primary analysis.",
    )


INTERVAL_BY_ANALYSIS = {"hierarchical": "paired_t", "published": "tukey"}
"""Method of the 95 % interval that each primary analysis computes; another one must not be declared with it."""
