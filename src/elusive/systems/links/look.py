"""What a radio network's log is, by its first frames and the list of its nodes, before it is tracked."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice
from pathlib import Path

import numpy as np

from elusive.checks import Finding, Looked
from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.systems.links.network import network_findings
from elusive.workbench.tables import look_at_table

FRAMES = 300  # looked at; where each has one reading, those of a few rounds of most networks


def look(path: Path, given: Mapping[str, str | bool]) -> Looked | None:
    """Look at a log: its columns, and with a list of nodes whether that is of its network.

    Parameters
    ----------
    path
        Of the log.
    given
        What else is given to the command, by name; ``nodes`` beside the log.

    Raises
    ------
    DataError
        If it, or the list of nodes, cannot be read, or it has links of other nodes.
    """
    looked, nodes = look_at_table(path), path.parent / str(given.get("nodes") or "")
    if not nodes.is_file() or (looked is not None and looked.findings):
        return looked
    findings = _findings(path, nodes, str(given.get("layout") or "") or None)
    return looked._replace(findings=findings) if looked is not None else Looked("", findings)


def _findings(path: Path, nodes: Path, layout: str | None) -> tuple[Finding, ...]:
    network = read_nodes(nodes)
    levels = [frame.rss_dbm for frame in islice(open_link_log(path, network, layout=layout), FRAMES)]
    if not levels:
        return ()
    known = np.isfinite(levels).any(axis=0)
    mean = np.full(known.shape, np.nan)
    mean[known] = np.nanmean(np.array(levels)[:, known], axis=0)
    return network_findings(network, mean)
