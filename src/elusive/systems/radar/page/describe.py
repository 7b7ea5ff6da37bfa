"""What a chart says of itself, as `elusive chart` tells it."""

from __future__ import annotations

import tempfile
from pathlib import Path

from elusive.systems.radar.chart import describe_charts
from elusive.systems.radar.page.state import ChartsState

Table = tuple[str, list[tuple[str, ...]]]


def description(state: ChartsState) -> tuple[list[Table], list[str]]:
    """Return the tables and the sentences of the tab's chart; none where there is no chart.

    Raises
    ------
    DataError
        If the chart cannot be used.
    """
    if state.chart is None:
        return [], []
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        path = Path(folder) / state.chart.file.name
        path.write_bytes(state.chart.file.data)
        found = describe_charts([path], state.scene.tracking.charted)
        sentences = [*(one.sentence for one in found.disagreements), *found.remarks]
        tables = [(one.name, [tuple(row) for row in one.rows]) for one in found.summaries]
        return tables, [sentence.replace(f"{folder}/", "") for sentence in sentences]
