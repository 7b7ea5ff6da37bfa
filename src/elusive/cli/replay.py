"""`elusive replay`: a recording over the network, at the pace of its own times or faster."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Annotated

import typer

from elusive.cli.live import tell
from elusive.cli.terminal import ended_softly, say
from elusive.io.replay import replay


def replay_command(
    source: Annotated[
        Path, typer.Argument(help="Capture (pcap, pcapng), radar video, or a table with a column time_s.")
    ],
    to: Annotated[
        str,
        typer.Option("--to", help="udp://HOST:PORT; of a table also tcp://HOST:PORT?listen=1, mqtt://HOST/TOPIC."),
    ],
    speed: Annotated[float, typer.Option("--speed", help="How many times faster than it was recorded.")] = 1.0,
) -> None:
    """Play a recording over the network, to try what is to follow it live."""
    over = threading.Event()
    with ended_softly(over.set):
        sent = replay(source, to, speed, tell, over)
    lost = f", {sent.lost} lost" * bool(sent.lost)
    say(f"{sent.messages} messages in {sent.seconds:.1f} s{lost}.")
