"""Sources as time passes, one of each system, for runs that are killed or whose disk is full: each a thread."""

from __future__ import annotations

import json
import os
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from elusive.cli import main
from elusive.io.replay import replay
from elusive.systems.video.simulate import VideoSimulation, simulate_video
from tests.brokers import free_port

LEFT = 10  # frames that were tracked, and are there still
RANGE_M = 5000
STATIONS = {"west": (-400.0, 0.0), "south": (0.0, -400.0), "east": (420.0, 60.0)}
PLOTS = {
    "knowledge": "none", "range_sd_m": 10, "bearing_sd_mrad": 3, "detection_probability": 0.95, "false_alarms": 1,
    "max_range_m": RANGE_M,
}  # fmt: skip
VIDEO = VideoSimulation(
    turns=480, ships=2, snr_db=(16, 18), speed_mps=(2, 3), coast_north_m=None, rocks=0, write="asterix", seed=4,
    radar={"spokes": 256, "samples": 160, "step_m": 20.0, "pulse_m": 40.0, "beam_deg": 6.0, "start_m": 200.0,
           "bits": 8, "gain": 3.0},
)  # fmt: skip
ROOM = ["--users", "2", "--total-positions", "9000", "--step-distance-m", "0.12", "--interval-s", "0.1", "--seed", "3"]


class Played(NamedTuple):
    """A source, and how `elusive serve` is to follow it."""

    system: str
    source: str
    options: dict[str, Any]
    parameters: dict[str, Any]
    play: Callable[[threading.Event], None]  # until the event
    same: bool  # whether what is told is, to the last digit, what a run that was never killed tells
    steady: bool = True  # whether two targets are there all the time
    most: int = 40  # steps between two kills, at most


def played(kind: str, folder: Path) -> Played:
    """Return a source by its name."""
    return KINDS[kind](folder)


def _ticks(over: threading.Event, every_s: float):
    k = 0
    while not over.wait(every_s):
        yield k
        k += 1


def _file(
    path: Path, header: str, every_s: float, lines: Callable[[int], str | bytes]
) -> Callable[[threading.Event], None]:
    path.write_text(header)

    def play(over: threading.Event) -> None:
        with path.open("ab") as file:
            for k in _ticks(over, every_s):
                more = lines(k)
                file.write(more if isinstance(more, bytes) else more.encode())
                file.flush()

    return play


def _circle(k: float, middle: tuple[float, float], radius: float, rate: float, phase: float) -> tuple[float, float]:
    return middle[0] + radius * np.cos(phase + k * rate), middle[1] + radius * np.sin(phase + k * rate)


def _bearings(folder: Path) -> Played:
    sensors, log = folder / "sensors.csv", folder / "log.csv"
    sensors.write_text("sensor,x_m,y_m\n" + "".join(f"{name},{x},{y}\n" for name, (x, y) in STATIONS.items()))

    def lines(k: int) -> str:
        rng, found = np.random.default_rng(k), []
        for middle, phase in (((-150.0, 200.0), 0.0), ((200.0, 250.0), 2.0)):
            x, y = _circle(k, middle, 30, 1 / 400, phase)
            for name, (sx, sy) in STATIONS.items():
                azimuth = np.degrees(np.arctan2(x - sx, y - sy)) + rng.normal(0, 0.2)
                found.append(f"{0.05 * k:.2f},{name},{azimuth:.3f}\n")
        return "".join(found)

    play = _file(log, "time_s,sensor,azimuth_deg\n", 0.05, lines)
    parameters = {"sigma_deg": 0.2, "emitters": {"kind": "several"}}
    return Played("bearings", str(log), {"sensors": str(sensors)}, parameters, play, same=True)


def frame(k: int) -> np.ndarray:
    """Two points that circle."""
    rng, (rows, columns) = np.random.default_rng(k), np.mgrid[:64, :64]
    image = rng.normal(100, 3, (64, 64))
    for middle, phase in (((32.0, 20.0), 0.0), ((30.0, 46.0), 2.0)):
        x, y = _circle(k, middle, 12, 1 / 30, phase)
        image += 25 * np.exp(-((rows - y) ** 2 + (columns - x) ** 2) / 2)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _images(folder: Path) -> Played:
    frames = folder / "frames"
    frames.mkdir()

    def play(over: threading.Event) -> None:
        for k in _ticks(over, 0.1):
            Image.fromarray(frame(k)).save(frames / f".{k}", format="png")
            os.replace(frames / f".{k}", frames / f"f{k:06d}.png")

    return Played("images", str(frames), {"rate_hz": 10}, {}, play, same=True)


def _images_that_go(folder: Path) -> Played:
    """Frames that are removed some time after they have been tracked."""
    here, told = _images(folder), folder / "told.ndjson"

    def remove(over: threading.Event) -> None:
        gone = 0
        for _ in _ticks(over, 0.1):
            tracked = len(told.read_bytes().splitlines()) if told.exists() else 0
            for k in range(gone, max(gone, tracked - LEFT)):
                (Path(here.source) / f"f{k:06d}.png").unlink()
                gone = k + 1

    def play(over: threading.Event) -> None:
        remover = threading.Thread(target=remove, args=(over,))
        remover.start()
        here.play(over)
        remover.join()

    return here._replace(play=play, same=False)


def plots(k: int) -> list[tuple[float, float, float]]:
    """Time, range and bearing of the echoes of two ships and of what is none."""
    rng, found = np.random.default_rng(k), []
    for middle, phase in (((-1500.0, 2500.0), 0.0), ((1500.0, 1500.0), 1.0)):
        x, y = _circle(k, middle, 300, 1 / 60, phase)
        if rng.random() < 0.95:
            found.append((np.hypot(x, y) + rng.normal(0, 10), np.degrees(np.arctan2(x, y) + rng.normal(0, 0.003))))
    found += [(RANGE_M * np.sqrt(rng.random()), 360 * rng.random()) for _ in range(rng.poisson(1.0))]
    return [(float(k), round(float(r), 2), round(float(b) % 360, 4)) for r, b in found]


def _radar(folder: Path) -> Played:
    path = folder / "plots.csv"
    play = _file(path, "time_s,range_m,bearing_deg\n", 0.1, lambda k: "".join(f"{t},{r},{b}\n" for t, r, b in plots(k)))
    return Played("radar", str(path), PLOTS, {}, play, same=True)


def _radar_over_udp(folder: Path) -> Played:
    port = free_port(socket.SOCK_DGRAM)

    def play(over: threading.Event) -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as mouth:
            for k in _ticks(over, 0.5):
                for t, r, b in plots(k):
                    told = json.dumps({"time_s": t, "range_m": r, "bearing_deg": b})
                    mouth.sendto(told.encode(), ("127.0.0.1", port))

    return Played("radar", f"udp://127.0.0.1:{port}", PLOTS, {}, play, same=False)


def samples(k: int) -> np.ndarray:
    """Noise in which two objects swing."""
    rng, places = np.random.default_rng(k), np.arange(200)
    x = 0.6 * rng.standard_normal(200)
    for middle, phase in ((60, 0.0), (150, 1.0)):
        there = np.abs(places - middle - 25 * np.sin(phase + k / 100)) <= 4
        x += there * 1.2 * rng.standard_normal(200)
    return x


def _signals(folder: Path) -> Played:
    path = folder / "signal.csv"

    def line(k: int) -> str:
        return f"{0.1 * k:.1f}," + ",".join(f"{value:.4f}" for value in samples(k)) + "\n"

    play = _file(path, "time_s," + ",".join(f"s{k}" for k in range(200)) + "\n", 0.1, line)
    return Played("signal", str(path), {}, {}, play, same=True)


def _signals_without_times(folder: Path) -> Played:
    play = _file(folder / "signal.iq", "", 0.1, lambda k: samples(k).astype("<f4").tobytes())
    options = {"raw": "f32", "rate_hz": 10, "frame_samples": 200}
    return Played("signal", str(folder / "signal.iq"), options, {}, play, same=True)


def _links(folder: Path) -> Played:
    with suppress(SystemExit):  # as every command ends
        main(["simulate", "links", *ROOM, "--nodes", "12", "--out", str(folder / "room")])
    header, *lines = (folder / "room" / "log.csv").read_text().splitlines(keepends=True)
    play = _file(folder / "log.csv", header, 0.1, lambda k: "".join(lines[k : k + 1]))
    options = {"nodes": str(folder / "room" / "nodes.csv"), "calibration_frames": 10}
    return Played("links", str(folder / "log.csv"), options, {}, play, same=True)


def _video(folder: Path) -> Played:
    simulate_video(VIDEO, folder / "sea")
    address = f"udp://127.0.0.1:{free_port(socket.SOCK_DGRAM)}"

    def play(over: threading.Event) -> None:
        while not over.is_set():  # at its end again from its start, as a radar whose clock is set back
            replay(folder / "sea" / "video.pcap", address, 2.0, lambda said: None, over)

    options = {"beam_deg": 6, "pulse_m": 40, "learning_turns": 4}
    return Played("video", address, options, {}, play, same=False, steady=False, most=12)


KINDS: dict[str, Callable[[Path], Played]] = {
    "images": _images,
    "images that go": _images_that_go,
    "signals": _signals,
    "signals without times": _signals_without_times,
    "radar": _radar,
    "radar over UDP": _radar_over_udp,
    "video": _video,
    "links": _links,
    "bearings": _bearings,
}
