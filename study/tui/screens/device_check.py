"""Findings of the device check, with advice."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.widgets import Footer

from study.session.views.views import DeviceFinding, DeviceReport
from study.tui.take_off import take_off
from study.tui.widgets.card import Sheet
from study.tui.widgets.literal_text import LiteralText


class DeviceCheckScreen(Screen[bool]):
    """True: go on. False: check again."""

    HELP = """\
# Device check

- Each line is one finding: **ok**, **warn** or **LOOK**, with what to do about it.
- **c** checks again, after something was plugged in or mended.
- **Enter** goes on where all is well; **g** goes on although something needs a look.
- The findings are kept with the data.
"""
    DEFAULT_CSS = """
    DeviceCheckScreen { align: center top; }
    DeviceCheckScreen .advice { margin-left: 6; color: $text-warning; }
    DeviceCheckScreen .look { text-style: bold; color: $text-warning; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("enter", "go_on", "Go on", key_display="Enter"),
        Binding("g", "go_on_anyway", "Go on all the same"),
        Binding("c", "check_again", "Check again"),
    ]

    def __init__(self, report: DeviceReport) -> None:
        super().__init__()
        self._report = report

    def compose(self) -> ComposeResult:
        report = self._report
        names = max((len(finding.name) for finding in report.findings), default=0)
        with Sheet():
            yield LiteralText(f"Device check: {report.device}", classes="title")
            if report.simulated:
                yield LiteralText("The device is a simulation: nothing moves.")
            yield LiteralText()
            for finding in report.findings:
                yield LiteralText(_line(finding, names), classes="fine" if finding.fine else "look")
                if finding.advice and not finding.fine:
                    yield LiteralText(finding.advice, classes="advice")
            if report.conclusion:
                yield LiteralText(f"{report.conclusion} Press Enter to go on.", classes="gap strong")
            else:
                yield LiteralText(
                    "Something needs a look. Press c to check again, or g to go on all the same.", classes="gap strong"
                )
        yield Footer(show_command_palette=False)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        usable = bool(self._report.conclusion)
        return {"go_on": usable, "go_on_anyway": not usable}.get(action, True)

    def action_go_on(self) -> None:
        take_off(self, True)

    def action_go_on_anyway(self) -> None:
        take_off(self, True)

    def action_check_again(self) -> None:
        take_off(self, False)


def _line(finding: DeviceFinding, names: int) -> str:
    return f"{'LOOK' if finding.wrong else finding.verdict:<4}  {finding.name:<{names}}  {finding.value}"
