"""Maps and what is built with them."""

from pathlib import Path

import numpy as np
import pytest

from study.importing.build_recording import build_recording
from study.importing.map_format.map_errors import ImportRefusedError
from study.importing.map_format.map_toml import parse_map

N = 400


U = np.random.default_rng(1).standard_normal(N)


Y = np.cumsum(U) / 50


NOISE_ON_ONE_AXIS = """
device = "one axis"
title = "Noise on one axis"
files = ["run.npz"]

[[clock]]
rate_hz = 500

[[channel]]
role = "command"
name = "fx"
value = "u"
unit = "N"

[[channel]]
role = "response"
name = "ax"
value = "y"
unit = "m/s^2"
"""
"""A map of one recording; segments and diagnosis are left to the test."""

ONE = """
device = "rig"
[[clock]]
{clock}
[[channel]]
role = "command"
name = "fx"
value = "u"
unit = "N"
{command}
[[channel]]
role = "response"
name = "ax"
value = "y"
unit = "g"
{response}
"""


def map_text(clock="rate_hz = 1000", command="", response="", top="", end=""):
    return top + ONE.format(clock=clock, command=command, response=response) + end


def built(text, *paths):
    return build_recording(parse_map(text, Path("m.toml")), paths)


def refusal(text, *paths):
    with pytest.raises(ImportRefusedError) as refused:
        built(text, *paths)
    assert refused.value.saved == "Nothing was written."
    assert refused.value.title.endswith("cannot be imported")
    return refused.value.happened
