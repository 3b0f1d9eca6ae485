"""Style sheet of the experimenter's view (`study.tui.watch.watch_screen`): two columns in a narrow terminal, three in a
wide one.

The classes `-narrow` and `-wide` depend on the width of the terminal. The key for details sets the class `details`,
which in a narrow terminal shows the third column in place of the other two, and in a wide terminal hides it. Further
classes: `said` where the line of keys shows a reply, `any` where there are alarms, `seen` where none is new.
`#standing` is the status line, `#aside` the third column.
"""

STYLE = """
WatchScreen #standing, WatchScreen #guide { height: auto; min-height: 1; padding: 0 1; }
WatchScreen #guide { color: $text-muted; }
WatchScreen #guide.said { color: $text; text-style: bold; }
WatchScreen #alarms { height: auto; max-height: 7; padding: 0 1; border: heavy $error; display: none; }
WatchScreen #alarms.any { display: block; }
WatchScreen #alarms.seen { border: round $panel; }
WatchScreen .panel { border-top: solid $foreground 40%; border-title-color: $text; padding: 0 1; }
WatchScreen #left { width: 1fr; }
WatchScreen #right { width: 32; }
WatchScreen #levels { height: 1fr; min-height: 6; }
WatchScreen #trials { height: 8; }
WatchScreen #runs { height: 1fr; min-height: 3; }
WatchScreen #gauges { height: 8; }
WatchScreen #aside { width: 42; display: none; }
WatchScreen.details #aside { display: block; }
WatchScreen.-narrow.details #right { display: none; }
WatchScreen.-narrow.details #left { display: none; }
WatchScreen.-narrow.details #aside { width: 1fr; }
WatchScreen.-wide #aside { display: block; width: 38; }
WatchScreen.-wide #right { width: 34; }
WatchScreen.-wide #trials { height: 14; }
WatchScreen.-wide.details #aside { display: none; }
"""
"""Layout and colours, in Textual's CSS. Widths and heights are in character cells."""
