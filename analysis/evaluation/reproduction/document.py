"""Document of a reproduction: the content of `reproduction.json`, format `hapteq-reproduction`, version 1.

Each published figure comes with its findings: what the paper reports, the reproduced value, and the rule by which it
counts as reproduced.
"""

import json
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from equalizer.signals.listed_problems import ListedProblemsError, format_validation_problems

FORMAT, VERSION = "hapteq-reproduction", 1
"""Name of the file format, and its version; a change of a field's name or meaning increases the version."""
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
"""Validation: unknown fields, NaN and infinity are refused."""


class ReproductionError(ListedProblemsError):
    """A document that is not a reproduction. `problems`: one sentence each."""


@dataclass(frozen=True, config=STRICT)
class Finding:
    """One finding of the paper, with the reproduced value."""

    what: str
    published: Annotated[str, Field(description="Value in the paper, in words; empty where the paper reports none.")]
    here: Annotated[str, Field(description="Reproduced value, in words.")]
    value: Annotated[float | None, Field(description="Number on which `here` is based; null where there is none.")]
    unit: Annotated[str, Field(description="Unit of `value`: SI, dB, deg or 1; empty without a value.")]
    as_published: Annotated[
        bool | None,
        Field(
            description="Whether the finding agrees with the paper by `rule`; null where the paper reports nothing "
            "to compare with."
        ),
    ]
    rule: Annotated[
        str, Field(description="Rule by which the finding counts as published; empty where nothing is compared.")
    ] = ""


@dataclass(frozen=True, config=STRICT)
class FigureFindings:
    """One published figure, with its reproduction."""

    figure: Annotated[int, Field(ge=1, le=5)]
    title: str
    source: Annotated[str, Field(description="Place in the paper.")]
    published: Annotated[str, Field(description="Content of the published figure, in our words.")]
    findings: tuple[Finding, ...]
    differs: Annotated[
        tuple[str, ...],
        Field(description="Differences from the publication, with their reasons; one or two sentences each."),
    ]
    remarks: Annotated[tuple[str, ...], Field(description="Remarks of the analyses.")] = ()


@dataclass(frozen=True, config=STRICT)
class PlayedRow:
    """One method of driving the device, measured by its true acceleration at all lines of the band."""

    name: str
    device: str
    place_mm: tuple[float, float, float]
    hand: Annotated[bool, Field(description="Whether a simulated hand held the handle.")]
    signal: Annotated[Literal["sweep", "multisine"], Field(description="Target signal, along one axis at a time.")]
    flatness_db: Annotated[float, Field(description="Largest deviation of a target axis from the target level.")]
    coupling_db: Annotated[
        float,
        Field(description="Largest ratio of off-axis response to response along the target axis, at the worst line."),
    ]
    median_coupling_db: Annotated[float, Field(description="The same at the median line.")]
    axis_error_deg: Annotated[float, Field(description="Largest angle between target and delivered axis.")]
    error: Annotated[
        float,
        Field(description="Root mean square of the difference from the target signal, relative to the target signal."),
    ]
    peak_force_n: float
    clipped_ticks: Annotated[int, Field(description="Number of ticks at which a cap limited the force.")]
    multiply_adds: Annotated[
        int | None,
        Field(
            description="Operations per sample of a form that runs sample by sample; null where they are not counted."
        ),
    ] = None


@dataclass(frozen=True, config=STRICT)
class UsedModel:
    """An identified model that drives the device, with the quality that its file stores."""

    name: str
    expected_error: Annotated[
        float, Field(description="Relative error, with misfit and scatter; not below the other errors.")
    ]
    held_out_error: Annotated[
        float | None, Field(description="Error on the held-out record; null without such a record.")
    ]
    held_out_noise: Annotated[
        float | None, Field(description="Noise of the held-out record; null where it is not known.")
    ]


@dataclass(frozen=True, config=STRICT)
class Reproduction:
    """The complete document: the findings on the published figures, and how the device was driven."""

    device: str
    subjects: int
    seed: int
    band_hz: Annotated[tuple[float, float], Field(description="Band in which the device was equalized.")]
    order: Annotated[int, Field(description="Order of the identified models.")]
    figures: tuple[FigureFindings, ...]
    played: Annotated[tuple[PlayedRow, ...], Field(description="Rows of figure 5, and further rows for comparison.")]
    baselines: Annotated[
        tuple[PlayedRow, ...], Field(description="Other ways of driving the device: centre, edge, in a simulated hand.")
    ] = ()
    models: Annotated[
        tuple[UsedModel, ...], Field(description="Models that drive the device; empty in files of earlier versions.")
    ] = ()


def reproduction_to_json(reproduction: Reproduction) -> dict[str, Any]:
    """Convert the document to plain values for JSON, without format and version."""
    values: dict[str, Any] = _ADAPTER.dump_python(reproduction, mode="json")
    return values


def reproduction_from_json(document: dict[str, Any]) -> Reproduction:
    """Parse the document of a reproduction. document: plain values without format and version. Raises ReproductionError
    with a sentence per problem that begins with its place in the document."""
    try:
        return _ADAPTER.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        raise ReproductionError(format_validation_problems(error.errors())) from error


def make_reproduction_schema() -> dict[str, Any]:
    """Make the JSON Schema of the values that `reproduction_to_json` returns."""
    return _ADAPTER.json_schema(mode="serialization")


_ADAPTER: TypeAdapter[Reproduction] = TypeAdapter(Reproduction)
