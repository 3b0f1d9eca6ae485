"""Devices of a bank, each of which takes seconds to draw and is drawn again and again."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import pytest


@pytest.fixture(scope="session", autouse=True)
def drawn_once() -> Iterator[None]:
    """For all names: `test_seal_cases.py`. That a draw repeats from its seed: `challenge/test_draw_case.py`."""
    from study.evaluation.bank import seal_cases

    draws = seal_cases.generate_case
    kept = cache(lambda each: draws(each, "kept"))

    def generate_case(each, name):
        case = kept(each)
        recording, model = replace(case.recording, device=name), replace(case.model, name=name)
        return replace(case, recording=recording, model=model)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(seal_cases, "generate_case", generate_case)
        yield
