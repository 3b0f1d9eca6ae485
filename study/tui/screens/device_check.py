"""Screen with the findings of the device check, which measures before the trials whether the device is in order."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import DeviceFinding, DeviceReport
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.widgets.card import Sheet
from study.tui.widgets.literal_text import LiteralText


class DeviceCheckScreen(TranslatedScreen[bool]):
    """The findings about the device with advice, and a conclusion. Keys: Enter continues if the device is usable, g
    continues although it is not, c repeats the check. Result of the screen: True = continue, False = check again."""

    PAGE = "help_check"
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

    def __init__(self, report: DeviceReport, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._report = report

    def compose(self) -> ComposeResult:
        report, words = self._report, self.words
        name_width = max((len(finding.name) for finding in report.findings), default=0)
        with Sheet():
            yield LiteralText(
                words.fill("check_title", {"device": words.translate_fact(report.device)}), classes="title"
            )
            if report.simulated:
                yield LiteralText(words["simulation"])
            yield LiteralText(words["for_experimenter"] if report.findings else "")
            for finding in report.findings:
                yield LiteralText(_format_finding(finding, name_width), classes="fine" if finding.fine else "look")
                if finding.advice and not finding.fine:
                    yield LiteralText(finding.advice, classes="advice")
            yield LiteralText(_format_conclusion(report, words), classes="gap strong")
        yield Footer(show_command_palette=False)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Enable Enter only for a usable device, and g only for one that is not usable."""
        usable = self._report.usable
        return {"go_on": usable, "go_on_anyway": not usable}.get(action, True)

    def action_go_on(self) -> None:
        dismiss_screen(self, True)

    def action_go_on_anyway(self) -> None:
        dismiss_screen(self, True)

    def action_check_again(self) -> None:
        dismiss_screen(self, False)


def _format_conclusion(report: DeviceReport, words: Words) -> str:
    """Format the conclusion: the device is ready, ready with a warning, or needs attention."""
    if not report.usable:
        return words["check_look"]
    return f"{words['check_ready' if report.fine else 'check_ready_warning']} {words['enter_goes_on']}"


def _format_finding(finding: DeviceFinding, name_width: int) -> str:
    """Format a finding: verdict (LOOK where it is wrong, padded to 4 characters), name padded to `name_width`
    characters, result."""
    return f"{'LOOK' if finding.wrong else finding.verdict:<4}  {finding.name:<{name_width}}  {finding.value}"
