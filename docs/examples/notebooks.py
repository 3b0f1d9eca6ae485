"""Make notebooks of the examples: each `# %%` begins a cell, of text where it says [markdown].

Run as `python docs/examples/notebooks.py`. Notebooks are written without outputs: the scripts are what is tested.
"""

import json
from pathlib import Path

HERE = Path(__file__).parent
MARK, TEXT_MARK = "# %%", "# %% [markdown]"


def examples() -> list[Path]:
    return sorted(path for path in HERE.glob("*.py") if path != Path(__file__))


def notebook(script: str) -> str:
    """As JSON, nbformat 4.5."""
    cells = []
    for number, part in enumerate(f"\n{script}".split(f"\n{MARK}")[1:]):
        head, _, body = part.partition("\n")
        is_text = f"{MARK}{head}" == TEXT_MARK
        lines = (
            [line.removeprefix("#").removeprefix(" ") for line in body.splitlines()] if is_text else body.splitlines()
        )
        source = "\n".join(lines).strip("\n").splitlines(keepends=True)
        cell = {
            "cell_type": "markdown" if is_text else "code",
            "id": f"cell-{number}",
            "metadata": {},
            "source": source,
        }
        cells.append(cell if is_text else {**cell, "execution_count": None, "outputs": []})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    whole = {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for example in examples():
        example.with_suffix(".ipynb").write_text(notebook(example.read_text("utf-8")), "utf-8")
