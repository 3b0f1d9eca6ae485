"""Which screen shows what the engine asks. Loaded while nothing is asked yet: it loads them all."""

from collections.abc import Callable
from typing import Any

from textual.screen import Screen

from study.tui.engine.from_engine import Ask, Call
from study.tui.keys.answer_keys import AnswerKeys
from study.tui.screens.await_return import AwaitReturnScreen
from study.tui.screens.demo import DemoScreen
from study.tui.screens.device_check import DeviceCheckScreen
from study.tui.screens.form import FormScreen
from study.tui.screens.goodbye import GoodbyeScreen
from study.tui.screens.handle import HandleScreen
from study.tui.screens.instructions import InstructionsScreen
from study.tui.screens.pause import PauseScreen
from study.tui.screens.playing import PlayingScreen
from study.tui.screens.practice_over import PracticeOverScreen
from study.tui.screens.rest import RestScreen
from study.tui.trial_replies import LEAVING

SCREENS: dict[Call, Callable[[Any], Screen[Any]]] = {
    Call.FILL_IN: FormScreen,
    Call.DEVICE_CHECKED: DeviceCheckScreen,
    Call.SHOW_PLAYING: PlayingScreen,
    Call.AWAIT_HANDLE: HandleScreen,
    Call.PRACTICE_OVER: PracticeOverScreen,
    Call.REST: RestScreen,
    Call.AWAIT_RETURN: AwaitReturnScreen,
    Call.GOODBYE: GoodbyeScreen,
}


def screen_for(ask: Ask, keys: AnswerKeys) -> Screen[Any]:
    """Of all but the trial, whose one screen stays for the whole sitting. Each is dismissed with the reply."""
    if ask.call is Call.WELCOME:
        return InstructionsScreen(ask.shown, keys)
    if ask.call is Call.CHOOSE_DEMO:
        return DemoScreen(ask.shown, keys)
    if ask.call is Call.PAUSE:
        return PauseScreen(ask.shown, leaving=ask.shown.reason == LEAVING.reason)
    return SCREENS[ask.call](ask.shown)
