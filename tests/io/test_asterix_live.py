"""ASTERIX over UDP: the plots of a capture that is replayed are those of its file."""

from __future__ import annotations

import socket
import threading
import time
from itertools import pairwise

import pytest

from elusive.io.asterix import asterix_plots
from elusive.io.asterix_live import live_asterix_plots
from elusive.io.replay import replay
from elusive.io.sources import Feed
from tests.brokers import free_port
from tests.recordings import DATA

RADAR = (25, 12)


def test_a_capture_that_is_replayed_gives_the_plots_of_its_file():
    path = DATA / "asterix" / "cat_034_048.pcap"
    if not path.is_file():
        pytest.skip("needs the recording in shared/data")
    whole = list(asterix_plots(path, RADAR))
    port, feed, came = free_port(socket.SOCK_DGRAM), Feed(hold_s=0.2), []
    plots = live_asterix_plots(f"asterix+udp://127.0.0.1:{port}", feed, RADAR)

    def listen():
        for plot in plots:
            came.append(plot)
            if plot.time_s >= whole[len(whole) // 2].time_s:
                feed.halt()

    listener = threading.Thread(target=listen)
    listener.start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        while not feed.counts:  # until it listens: what has been heard of the capture would make the rest of it late
            sender.sendto(b"\0", ("127.0.0.1", port))
            time.sleep(0.01)
    while listener.is_alive():
        replay(path, f"udp://127.0.0.1:{port}", 1e4, print)
    assert len(came) >= len(whole) // 2
    assert all(a.time_s <= b.time_s for a, b in pairwise(came))
    known = {tuple(plot[:3]) for plot in whole}
    assert {tuple(plot[:3]) for plot in came} <= known
    assert len({tuple(plot[:3]) for plot in came}) == len(came)  # the capture holds each twice
