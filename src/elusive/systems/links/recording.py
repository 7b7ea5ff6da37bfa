"""A simulated log written as a recording: levels, nodes, truth, and how well the network sees the area."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.io.atomic import atomic_folder
from elusive.io.csv_files import write_csv
from elusive.io.truth import Truth, write_truth
from elusive.sensors.radio_network import COLUMNS as NODE_COLUMNS
from elusive.sensors.radio_network import directed_links_of
from elusive.systems.links.coverage import write_coverage
from elusive.systems.links.simulate import LinkSimulation, people_of


class LinkSimulated(NamedTuple):
    """What a simulated log came to."""

    rows: list[tuple[str, str]]


def simulate_links(
    parameters: LinkSimulation, out: Path, *, on_frame: Callable[[int], None] | None = None
) -> LinkSimulated:
    """Write ``log.csv``, ``nodes.csv``, ``truth.csv``, ``coverage.csv`` and ``.png``, and ``simulation.yaml``.

    The log has a frame a line, under the header ``time_s`` and ``tx-rx-channel``; channels are numbered from 0.

    Parameters
    ----------
    parameters
        What to simulate.
    out
        The folder; made if need be.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If the nodes are no network, no link passes the area, or a file cannot be written.
    """
    network, truth = parameters.bind(), parameters.truth()
    nodes = network.nodes
    links = directed_links_of(len(nodes.names))
    channels = parameters.radiation.channels
    header = [
        "time_s", *(f"{nodes.names[tx]}-{nodes.names[rx]}-{c}" for tx, rx in links.tolist() for c in range(channels))
    ]  # fmt: skip
    present = np.isfinite(truth[..., 0])
    with atomic_folder(out) as folder:
        with (folder / "log.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header)
            for number, frame in enumerate(parameters.frames(parameters.images(truth)), 1):
                writer.writerow([repr(frame.time_s), *(f"{level:.2f}" for level in frame.rss_dbm.ravel())])
                if on_frame is not None:
                    on_frame(number)
        write_csv(folder / "nodes.csv", NODE_COLUMNS, zip(nodes.names, *nodes.positions_m.T.tolist(), strict=True))
        write_truth(folder / "truth.csv", people_of(parameters, truth) or Truth((), ()), "m")
        covered = write_coverage(folder, nodes, network.grid, network.weights)
        (folder / "simulation.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
    there = present.any(axis=1)
    return LinkSimulated(
        [
            ("Network", f"{len(nodes.names)} nodes, {len(links) // 2} links, {_counted(channels, 'channel')}"),
            ("Coverage", covered),
            ("Frames", f"{parameters.calibration_steps + len(truth)}, the first {parameters.calibration_steps} empty"),
            (
                "People",
                f"{truth.shape[1]}, at most {present.sum(axis=1).max()} at a time; somebody in "
                f"{_counted(int(there.sum()), 'frame')}",
            ),
        ]
    )


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"
