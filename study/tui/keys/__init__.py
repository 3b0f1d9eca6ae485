"""Keyboard input of the screens: which key events are presses, and in which order they are handled.

`key_presses` (rejects the auto-repeat of held keys) -> `input_queue` (handles keys, clicks and pastes one after
another). `answer_keys` holds the keys of the option `--keys`, `key_names` their names as printed on a keyboard. Used by
`study.tui.app`, `study.tui.screens`, `study.tui.line_mode` and `study.cli`. Begin at `input_queue.py`.
"""
