"""Short summaries of results: a title and a few rows, printed as text in a terminal (`__repr__`) and as an HTML table
in a notebook (`_repr_html_`), because a dataclass of long arrays has no readable default."""

from dataclasses import dataclass
from html import escape


@dataclass(frozen=True, slots=True)
class Summary:
    """Title and rows of a result, as plain text by `str` and as an HTML table by `html`."""

    title: str
    rows: tuple[tuple[str, str], ...]
    """Name of each row, and its value with unit."""

    def __str__(self) -> str:
        width = max((len(name) for name, _ in self.rows), default=0)
        return "\n".join((self.title, *(f"  {name:<{width}}  {value}" for name, value in self.rows)))

    @property
    def html(self) -> str:
        """An HTML table, the title as its caption; text is escaped."""
        rows = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in self.rows)
        return f"<table><caption>{escape(self.title)}</caption>{rows}</table>"


class Summarised:
    """Base class of results that print as their summary, because their fields hold arrays too long to print."""

    __slots__ = ()

    def summary(self) -> Summary:
        """Title and main numbers, for printing. Every subclass overrides it; this method raises TypeError."""
        raise TypeError(f"{type(self).__name__} has no summary")

    def __repr__(self) -> str:
        return str(self.summary())

    def _repr_html_(self) -> str:
        """HTML that a Jupyter notebook displays."""
        return self.summary().html


def span_text(low: float, high: float, unit: str) -> str:
    """Text of a range with its unit, such as "0.3 to 45 Hz"; four significant digits."""
    return f"{low:.4g} to {high:.4g} {unit}"
