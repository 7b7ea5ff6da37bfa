"""A room of rays: every level is a sum of phasors, which nobody's model of what people change has been fitted to.

Each link has its direct ray and eight others; somebody near the line attenuates the direct one and scatters one more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elusive.sensors.radio_network import RadioNodes, RssFrame, directed_links_of, links_of, undirected_of
from tests.tracking.link_scenes import border
from tests.tracking.test_walking_speeds import walked

FIRST_HZ, STEP_HZ, LIGHT_MPS = 2.42e9, 25e6, 3e8
HALF_M, INTERVAL_S, NOISE_DB = 4.0, 0.5, 0.5
EMPTY = 30


class RayRoom(NamedTuple):
    """A log, as `open_link_log` gives it, and where people are in each of its frames."""

    frames: list[RssFrame]
    nodes: RadioNodes
    truth: list[np.ndarray]  # (P, 2)
    channels: tuple[str, ...]
    name: str = "log"
    again: bool = True

    def __iter__(self):
        return iter(self.frames)


def ray_room(
    seed, speeds_mps, nodes=12, channels=4, frames=120, interval_s=INTERVAL_S, sits=(), noise_db=NOISE_DB, paths=None
):
    """Draw a room whose people walk at some speeds, or along paths, from the thirtieth frame on, in whole dB.

    One more sits at some places, in as many frames from the first.
    """
    rng, network = np.random.default_rng([7, seed]), border(nodes, HALF_M)
    ends, links = network.positions_m[links_of(nodes)].transpose(1, 0, 2), undirected_of(nodes)
    straight = np.linalg.norm(ends[0] - ends[1], axis=1)[:, None]
    wave = 2 * np.pi * (FIRST_HZ + STEP_HZ * np.arange(channels)) / LIGHT_MPS
    longer, gains = rng.exponential(6.0, (len(straight), 8)), rng.normal(0, 0.35, (len(straight), 8))
    phasors = np.exp(-1j * (straight + longer)[..., None] * wave)
    resting = np.einsum("lk,lkc->lc", gains / straight, phasors)
    gap = rng.normal(0, 1, nodes)[directed_links_of(nodes)[:, 0], None] * 0.5  # of senders

    def level(people):
        direct, others = np.exp(-1j * wave * straight) / straight, resting
        for place in people:
            one, two = (np.linalg.norm(end - place, axis=1)[:, None] for end in ends)
            direct = direct * (1 - 0.65 * np.exp(-(one + two - straight) / 0.12))
            others = others + 0.35 * np.exp(-1j * wave * (one + two)) / np.maximum(one * two, 0.3)
        return 20 * np.log10(np.abs(direct + others))[links] - 50 + gap

    paths = paths or [
        walked(np.random.default_rng([seed, k]), speed, interval_s, frames, half=HALF_M - 0.6)
        for k, speed in enumerate(speeds_mps)
    ]
    truth = [np.empty((0, 2))] * EMPTY + [np.array([path[k] for path in paths]).reshape(-1, 2) for k in range(frames)]
    truth = [np.vstack([people, sits[k : k + 1]]) if k < len(sits) else people for k, people in enumerate(truth)]
    heard = (np.round(level(people) + noise_db * rng.standard_t(3.0, (len(links), channels))) for people in truth)
    log = [RssFrame(interval_s * k, np.where(rss < -97, np.nan, rss)) for k, rss in enumerate(heard)]
    return RayRoom(log, network, truth, tuple(map(str, range(channels))))
