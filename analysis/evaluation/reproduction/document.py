"""Document of a reproduction: the content of `reproduction.json`, format `hapteq-reproduction`, version 1.

Each published figure comes with its findings: what the paper reports, the reproduced value, and the rule by which it
counts as reproduced. Units are part of the names, or of the descriptions, which also appear in the JSON Schema.
"""

import json
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from equalizer.signals.listed_problems import ListedProblemsError

FORMAT, VERSION = "hapteq-reproduction", 1
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


class ReproductionError(ListedProblemsError):
    """A document that is not a reproduction. `problems`: one sentence each."""


@dataclass(frozen=True, config=STRICT)
class Finding:
    """One finding of the paper, beside the reproduced value."""

    what: str
    published: Annotated[str, Field(description="What the paper reports; empty where it reports nothing.")]
    here: Annotated[str, Field(description="What came out, in words.")]
    value: Annotated[float | None, Field(description="The number behind `here`; null where there is none.")]
    unit: Annotated[str, Field(description="Of `value`, SI or dB, deg, 1; empty without one.")]
    as_published: Annotated[
        bool | None,
        Field(description="By the rule that `rule` states; null where the paper gives nothing to compare with."),
    ]
    rule: Annotated[str, Field(description="When it counts as published; empty where nothing is compared.")] = ""


@dataclass(frozen=True, config=STRICT)
class FigureFindings:
    """One published figure beside its reproduction."""

    figure: Annotated[int, Field(ge=1, le=5)]
    title: str
    source: Annotated[str, Field(description="Place in the paper.")]
    published: Annotated[str, Field(description="What the figure shows there, in our words.")]
    findings: tuple[Finding, ...]
    differs: Annotated[tuple[str, ...], Field(description="What is different here, and why; one sentence or two each.")]
    remarks: Annotated[tuple[str, ...], Field(description="What the analyses themselves noted.")] = ()


@dataclass(frozen=True, config=STRICT)
class PlayedRow:
    """One way of driving the device, measured on its true acceleration over every line of the band."""

    name: str
    device: str
    place_mm: tuple[float, float, float]
    hand: Annotated[bool, Field(description="Whether a simulated hand held the handle.")]
    signal: Annotated[Literal["sweep", "multisine"], Field(description="What was wanted, along one axis at a time.")]
    flatness_db: Annotated[float, Field(description="Largest deviation of a wanted axis from the wanted level.")]
    coupling_db: Annotated[float, Field(description="Largest off-axis response over the wanted axis's, worst line.")]
    median_coupling_db: Annotated[float, Field(description="The same, of the median line.")]
    axis_error_deg: Annotated[float, Field(description="Largest angle between wanted and played axis.")]
    error: Annotated[float, Field(description="Root mean square of what differs from what was wanted, over it.")]
    peak_force_n: float
    clipped_ticks: Annotated[int, Field(description="At which a cap cut the force off.")]
    multiply_adds: Annotated[
        int | None, Field(description="Per sample, of a form that runs sample by sample; null where it is not counted.")
    ] = None


@dataclass(frozen=True, config=STRICT)
class UsedModel:
    """An identified model that drives the device, with the quality that its file stores."""

    name: str
    expected_error: Annotated[float, Field(description="Relative, with misfit and scatter; not below the others.")]
    held_out_error: Annotated[float | None, Field(description="On the held-out record; null without one.")]
    held_out_noise: Annotated[
        float | None, Field(description="Noise of the held-out record; null where it is not known.")
    ]


@dataclass(frozen=True, config=STRICT)
class Reproduction:
    """The whole document."""

    device: str
    subjects: int
    seed: int
    band_hz: Annotated[tuple[float, float], Field(description="In which the device was equalized.")]
    order: Annotated[int, Field(description="Of the identified models.")]
    figures: tuple[FigureFindings, ...]
    played: Annotated[tuple[PlayedRow, ...], Field(description="Rows of figure 5, and further rows for comparison.")]
    baselines: Annotated[
        tuple[PlayedRow, ...], Field(description="Other ways of driving the device: centre, edge, in a simulated hand.")
    ] = ()
    models: Annotated[
        tuple[UsedModel, ...], Field(description="That drive the device; none in files of earlier versions.")
    ] = ()


def reproduction_to_json(reproduction: Reproduction) -> dict[str, Any]:
    """The document as plain values for JSON, without format and version."""
    plain: dict[str, Any] = _ADAPTER.dump_python(reproduction, mode="json")
    return plain


def reproduction_from_json(document: dict[str, Any]) -> Reproduction:
    """Parse the document of a reproduction. document: plain values without format and version. Raises ReproductionError
    with a sentence per problem that begins with its place in the document."""
    try:
        return _ADAPTER.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        raise ReproductionError(
            tuple(f"{'.'.join(map(str, wrong['loc']))}: {wrong['msg']}" for wrong in error.errors())
        ) from error


def reproduction_schema() -> dict[str, Any]:
    """JSON Schema of the values that `reproduction_to_json` returns."""
    return _ADAPTER.json_schema(mode="serialization")


_ADAPTER: TypeAdapter[Reproduction] = TypeAdapter(Reproduction)
