"""The table of what composes, made by trying; ``python -m tests.composition.table`` writes it into the docs."""

from __future__ import annotations

from pathlib import Path

from elusive.errors import ElusiveError
from tests.composition.builders import FILTERS, MOTIONS, SENSORS, prior_of

PAGE = Path(__file__).resolve().parents[2] / "docs" / "composition.md"
HEAD, TAIL = "<!-- made by tests/composition -->\n", "<!-- until here -->\n"


def refusal(filter_name: str, motion_name: str, sensor_name: str) -> str | None:
    """Sentence that refuses a filter of a motion and a sensor; None where they compose."""
    motion = MOTIONS[motion_name]
    names = tuple(motion.state_names)
    try:
        FILTERS[filter_name].build(motion, SENSORS[sensor_name].build(names), (), prior_of(names))
    except ElusiveError as error:
        return str(error)
    return None


def cell(filter_name: str, sensor_name: str) -> str:
    """Motions that a filter takes with a sensor."""
    taken = [name for name in MOTIONS if refusal(filter_name, name, sensor_name) is None]
    refused = [name for name in MOTIONS if name not in taken]
    if not refused:
        return "any motion"
    if not taken:
        return "none"
    if len(taken) <= len(refused):
        return ", ".join(taken)
    return f"any but {', '.join(refused)}"


def table() -> str:
    """Sensors by filters, in Markdown."""
    rows = [["sensor", *FILTERS], ["---"] * (len(FILTERS) + 1)]
    rows += [[sensor, *(cell(name, sensor) for name in FILTERS)] for sensor in SENSORS]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def page_with(made: str) -> str:
    """Return the docs' page with this table."""
    text = PAGE.read_text(encoding="utf-8")
    return text[: text.index(HEAD) + len(HEAD)] + made + text[text.index(TAIL) :]


if __name__ == "__main__":
    PAGE.write_text(page_with(table()), encoding="utf-8")
