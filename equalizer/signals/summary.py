"""Short summaries of results: a title and a few rows, printed as text in a terminal (`__repr__`) and as an HTML table
in a notebook (`_repr_html_`). Models, recordings and results inherit from `SummaryDisplay`, because the default output
of a dataclass with long arrays is unreadable."""

from dataclasses import dataclass
from html import escape


@dataclass(frozen=True, slots=True)
class Summary:
    """Title and rows of a result; `str` gives plain text, `html` an HTML table."""

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


class SummaryDisplay:
    """Base class of results that display their summary in place of their fields, which hold long arrays."""

    __slots__ = ()

    def summary(self) -> Summary:
        """Title and main numbers, for printing. Every subclass overrides it; this method raises TypeError."""
        raise TypeError(f"{type(self).__name__} has no summary")

    def __repr__(self) -> str:
        return str(self.summary())

    def _repr_html_(self) -> str:
        """HTML that a Jupyter notebook displays."""
        return self.summary().html


def format_range(low: float, high: float, unit: str) -> str:
    """Format a range with its unit, such as "0.3 to 45 Hz"; four significant digits."""
    return f"{low:.4g} to {high:.4g} {unit}"
