"""The language of laws, in docs/formats.md."""

from equalizer.laws.parse import FUNCTIONS, LARGEST, LONGEST, MEMORY
from equalizer.laws.program import CELLS, DEEPEST
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW

_PLAIN = ", ".join(f"`{name}`" for name in FUNCTIONS if name not in MEMORY)

LAWS = "\n\n".join(
    (
        f"A law that the catalogue has no name for is an effect `{DISCOVERED_LAW}`. A model says its formula:",
        "```toml\n[[effect]]\n"
        f'kind = "{DISCOVERED_LAW}"\naxis = "y"\nacts_on = "force"\nexpression = "-4.1*abs(vy)**1.5*sign(vy)"\n'
        "```",
        "In a diagnosis it is the effect's `law`, with `expression`, `variables`, `acts_on` and `axis`. A law of the "
        "`force` is added to the force at its axis; one of a `command` or `response` takes the place of that "
        "axis' command or response.",
        f"The formula has Python's syntax and SI numbers: `+ - * / **`, parentheses, `pi`, and the functions {_PLAIN}. "
        "Four more remember what was before: `lag(s, tau_s)` (one pole), `play(s, half_width)` (follows s with play), "
        f"`delay(s, seconds)` (remembered at up to {CELLS} instants), `integral(s)`; the second argument is constant. "
        "In a force or response they begin as if their signals had always been what they are first, in a command from "
        "zero.",
        "Signals are `x`, `vx`, `ax`, `fx` (position, velocity, acceleration, command of the x axis; y, z likewise), "
        "`t` (seconds from the first sample), or the recording's own channels. Where these do not end in x, y, z, the "
        "axes are called so in their order. A law of a command knows commands and `t`, one of a response "
        "knows responses and `t`.",
        "Numbers with a point or exponent (`4.1`, `1e-3`) are free: a fit may move them. Whole numbers (`2`) belong "
        f"to the form. A formula has up to {LONGEST} characters and {LARGEST} parts, and up to {DEEPEST} numbers at "
        "once. It compares nothing: `maximum(x - 0.01, 0)` is a stop, `(1 + sign(vx))/2` is 1 on the way up.",
    )
)
