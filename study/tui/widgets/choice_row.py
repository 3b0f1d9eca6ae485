"""Selection of a single choice among a few (radio buttons), side by side if they fit, otherwise listed vertically."""

from dataclasses import dataclass
from typing import ClassVar

from rich.cells import cell_len
from rich.text import Text
from textual.binding import Binding, BindingType
from textual.events import Click, Key
from textual.geometry import Size
from textual.message import Message
from textual.reactive import reactive
from textual.widget import Widget

from study.session.views.form_entry import find_choice, move_mark

CHOICE_GAP_CELLS = 3
"""Character cells between two choices that are side by side (chosen)."""


class ChoiceRow(Widget, can_focus=True):
    """Row or list of choices. Arrow keys move the cursor; Space or a click selects, Enter selects and posts
    `Submitted`, a digit or first letter selects (`find_choice`). Nothing is selected at first unless `chosen`, the
    index of an earlier answer, is given. Moving the cursor does not select, because consent must be deliberate."""

    DEFAULT_CSS = """
    ChoiceRow { height: auto; width: 1fr; }
    ChoiceRow > .choice-row--cursor { background: $block-cursor-background; color: $block-cursor-foreground; }
    ChoiceRow > .choice-row--chosen { text-style: bold; }
    """
    COMPONENT_CLASSES = {"choice-row--cursor", "choice-row--chosen"}  # noqa: RUF012  Textual's own type
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left", "move(-1)", "Move", key_display="← →"),
        Binding("right", "move(1)", "Move", show=False),
        Binding("space", "choose", "Choose", key_display="Space"),
        Binding("enter", "choose_and_leave", "Choose, next", key_display="Enter"),
    ]

    cursor: reactive[int | None] = reactive[int | None](None)
    """Index of the choice under the cursor, from 0; None: no choice."""
    chosen: reactive[int | None] = reactive[int | None](None)
    """Index of the selected choice, from 0; None: no choice."""
    is_current: reactive[bool] = reactive(False)
    """Whether the cursor of a form is on this row: then the row shows its cursor although the form's screen has the
    focus."""

    @dataclass
    class Chosen(Message):
        """A choice was made; also posted when the same choice is made again."""

        row: "ChoiceRow"

    @dataclass
    class Submitted(Message):
        """Enter was pressed with a choice selected: the next question follows."""

        row: "ChoiceRow"

    def __init__(self, choices: tuple[str, ...], chosen: int | None = None, id: str | None = None) -> None:
        super().__init__(id=id)
        self._choices = choices
        # Choices are numbered unless one of them is itself a number: then a digit selects the choice of that name.
        self._is_numbered = not any(choice.isdigit() for choice in choices)
        self.set_reactive(ChoiceRow.chosen, chosen)
        self.set_reactive(ChoiceRow.cursor, chosen)

    @property
    def answer(self) -> str:
        """The chosen answer; empty where nothing is chosen."""
        return "" if self.chosen is None else self._choices[self.chosen]

    def on_key(self, event: Key) -> None:
        if event.key in ("up", "down") and self._move_vertically(1 if event.key == "down" else -1):
            event.stop()
        elif event.character and (index := find_choice(self._choices, event.character)) is not None:
            event.stop()
            self._select_choice(index)

    def on_click(self, event: Click) -> None:
        index = self.find_choice_at(event.x, event.y)
        if index is not None:
            self._select_choice(index)

    def find_choice_at(self, x: int, y: int) -> int | None:
        """Find the index of the choice drawn in the cell at column x and row y; None where there is none."""
        for index, (column, row) in enumerate(self._place_choices(self.size.width)):
            if row == y and column <= x < column + cell_len(self._format_label(index)):
                return index
        return None

    @property
    def stacked(self) -> bool:
        """Whether the choices are listed vertically at this width."""
        return len({y for _, y in self._place_choices(self.size.width)}) > 1

    def action_move(self, step: int) -> None:
        self.cursor = move_mark(self.cursor, step, len(self._choices))

    def action_choose(self) -> None:
        if self.cursor is not None:
            self._select_choice(self.cursor)

    def action_choose_and_leave(self) -> None:
        self.action_choose()
        if self.chosen is not None:
            self.post_message(self.Submitted(self))

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        return max((y for _, y in self._place_choices(width)), default=0) + 1

    def render(self) -> Text:
        text = Text(no_wrap=True)
        text_column = text_row = 0
        for index, choice_position in enumerate(self._place_choices(self.size.width)):
            if choice_position[1] > text_row:
                text.append("\n")
                text_column, text_row = 0, choice_position[1]
            text.append(" " * (choice_position[0] - text_column))
            text.append(self._format_label(index), self._get_label_style(index))
            text_column = choice_position[0] + cell_len(self._format_label(index))
        return text

    def _get_label_style(self, index: int) -> str:
        """Get the style of a choice: under the cursor, selected, or plain."""
        if (self.has_focus or self.is_current) and index == self.cursor:
            return str(self.get_component_rich_style("choice-row--cursor"))
        return "bold" if index == self.chosen else ""

    def _format_label(self, index: int) -> str:
        """Format a choice with its number, where choices are numbered, and its radio button."""
        number_text = f"{index + 1} " if self._is_numbered else ""
        return f" {number_text}{'●' if index == self.chosen else '○'} {self._choices[index]} "

    def _place_choices(self, width: int) -> list[tuple[int, int]]:
        """Compute column and row of each choice (character cells, from 0) at this width: side by side if all fit,
        otherwise one below the other."""
        label_widths = [cell_len(self._format_label(index)) for index in range(len(self._choices))]
        if sum(label_widths) + CHOICE_GAP_CELLS * (len(label_widths) - 1) > width:
            return [(0, index) for index in range(len(label_widths))]
        return [(sum(label_widths[:index]) + CHOICE_GAP_CELLS * index, 0) for index in range(len(label_widths))]

    def _move_vertically(self, step: int) -> bool:
        """Move the cursor through vertically listed choices. Returns False beyond their ends, for Up without a cursor,
        and for choices side by side."""
        new_cursor = move_mark(self.cursor, step, len(self._choices), stop_at_ends=False) if self.stacked else None
        if new_cursor is None:
            return False
        self.cursor = new_cursor
        return True

    def _select_choice(self, index: int) -> None:
        """Select the choice, and post `Chosen`."""
        self.cursor = self.chosen = index
        self.post_message(self.Chosen(self))
