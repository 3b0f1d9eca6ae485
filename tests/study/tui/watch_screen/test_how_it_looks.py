"""The screen of one who watches: how it looks, in every size."""

import os
from pathlib import Path

import pytest

from study.tui.watch.watch_panels import format_trials
from tests.slow_instances import slow, slow_after
from tests.study.tui.watch_screen.watched import ALARM, view

HERE = Path(__file__).parents[1]


def test_the_screen_says_how_it_stands_and_that_it_only_watches(seated):
    async def story(seat):
        assert seat.lines[0].strip() == "● RUNNING  P01_001  trial 14 at 0.631 N: waiting for the answer, 4 s"
        assert "You only watch: S stops, p pauses, n notes." in seat.lines[1]
        assert "test 1, 25 Hz, 3 of 13 reversals, now 0.631 N" in seat.text
        assert "hidden until it is answered" in seat.text

    seated(story)


@pytest.mark.parametrize("size", [(80, 24), (132, 40)])
@pytest.mark.parametrize("theme", slow_after(1, ["hapteq-dark", "hapteq-light"]))
@pytest.mark.parametrize("alarms", [(), (ALARM,)])
def test_the_screen_looks_as_it_did(seated, size, theme, alarms):
    """With HAPTEQ_WRITE_SCREENS set the pictures are written anew. Words are the same in every theme."""
    picture = HERE / f"watch_{size[0]}x{size[1]}{'_alarm' if alarms else ''}.txt"

    async def story(seat):
        shown = "\n".join(seat.lines) + "\n"
        if "HAPTEQ_WRITE_SCREENS" in os.environ:
            picture.write_text(shown, "utf-8")
        assert shown == picture.read_text("utf-8")

    seated(story, view(alarms=alarms), size, theme)


@pytest.mark.parametrize("size", [(40, 10), (80, 24), *slow((60, 15), (200, 60))])
def test_no_size_breaks_it(seated, size):
    async def story(seat):
        await seat.press("d", "d")
        assert "P01_001" in seat.text

    seated(story, view(alarms=(ALARM,)), size)


@pytest.mark.parametrize("columns", [53, 54, 55])
def test_the_header_names_the_remark_wherever_a_row_has_one(columns):
    header, _, _, void, *_ = format_trials(view(), 20, columns).plain.splitlines()
    assert "void" in void
    assert ("remark" in header) == ("the han" in void)
