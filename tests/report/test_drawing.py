"""The drawing that reports and the workbench share: what is declared of it, and the scripts in a browser."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elusive.report import drawing as draw
from elusive.report.clock import Clock, moment
from elusive.report.extents import lonlat_fit, top_of
from elusive.report.packing import dumps
from elusive.report.page import Report, track_table
from tests.browsing import browse, data_in, layers, numbers, pixels, stands_alone

TIMES = 0.5 * np.arange(60)
EXTENT = (0.0, 40.0, 0.0, 20.0)


def made(path: Path, **more: Any) -> Path:
    """A report with two linked planes over an image, two tracks, curves and events."""
    rows, columns = 10, 20
    frames = np.arange(60)[:, None, None] + np.arange(rows)[:, None] * 10.0 + np.zeros(columns)
    shown = draw.image(draw.scaled(frames), EXTENT, "heat", unit="dB", times=TIMES.tolist(), name="image")
    k = np.arange(60)
    ways = {1: np.column_stack([5 + 0.5 * k, 5 + 0.1 * k]), 2: np.column_stack([30 - 0.2 * k[20:], 15 + 0.0 * k[20:]])}
    starts = {1: 0, 2: 20}
    tracks = [
        draw.track(
            n, TIMES[starts[n] :], way, "#1d4ed8", deviation=np.full(way.shape, 0.5), sure=np.arange(len(way)) > 3,
            values=[draw.numbers("speed", np.full(len(way), 1.25), "m/s", 2)],
        )
        for n, way in ways.items()
    ]  # fmt: skip
    cloud = draw.clouds([(0.0, ways[1][:1] + np.zeros((3, 1))), (10.0, ways[1][20:21])], "--particle", reach=1.0)
    one = draw.plane("One", EXTENT, [shown, cloud, *tracks], span=6)
    two = draw.plane("Two", EXTENT, [draw.area([[0, 0, 9, 0, 9, 9]], fill="--land", name="land"), *tracks])
    error = draw.chart("Error", TIMES, [draw.line(TIMES, np.sin(k) + 2, "--accent", name="error")], unit="m")
    drawn = draw.drawing(
        "Two planes", TIMES, [one, two, error], log=4, start=59,
        events=[(0.0, "starts", 1), (10.0, "starts", 2), (20.0, "weather changes", None)], **more,
    )  # fmt: skip
    table = track_table(("Track", "Since"), [("1", "0 <i>"), ("2", "10 s"), ("3", "-")], {"1", "2"})
    made = Report("A <b>& title</b> </script>", "Found & more.", drawn, [("Scans", "60 <i>")], tracks=table)
    made.write_page(path / "r.html")
    return path / "r.html"


def test_the_page_stands_alone_and_escapes_text(tmp_path: Path) -> None:
    page = made(tmp_path)
    stands_alone(page)
    text = page.read_text(encoding="utf-8")
    for words in ("Found &amp; more.", "<td>60 &lt;i&gt;</td>", "<td>0 &lt;i&gt;</td>", 'data-track="2"', "<td>3</td>"):
        assert words in text


def test_an_image_is_packed_once_on_its_scale_and_found_again(tmp_path: Path) -> None:
    drawn = data_in(made(tmp_path))
    assert len(drawn["blocks"]) == 1
    (shown,) = layers(drawn, type="image")
    expected = np.arange(60)[:, None, None] + np.arange(10)[:, None] * 10.0 + np.zeros(20)
    found = shown["low"] + pixels(drawn, shown) / 255 * (shown["high"] - shown["low"])
    np.testing.assert_allclose(found, expected, atol=0.51 * 149 / 255)


def test_two_layers_share_their_bytes_which_may_be_held_elsewhere() -> None:
    values = draw.scaled(np.eye(3))
    panel = draw.plane("x", EXTENT, [draw.image(values, EXTENT), draw.image(values, EXTENT, "dim")])
    held: list[bytes] = []
    told = json.loads(dumps(draw.drawing("x", [0.0], [panel]), lambda data: held.append(data) or "/blocks/1"))
    assert told["blocks"] == [{"url": "/blocks/1"}]
    assert [layer["block"] for layer in layers(told)] == [0, 0]
    assert held == [bytes([255, 0, 0, 0, 255, 0, 0, 0, 255])]


def test_what_is_not_known_is_null_in_numbers_and_255_in_shares() -> None:
    assert draw.rounded([1.234, np.nan, np.inf]) == [1.23, None, None]
    assert draw.shares(np.array([[0.0, 0.25, 1.0, np.nan]]))["block"].tolist() == [[0, 64, 254, 255]]
    assert draw.scaled(np.array([[np.nan, 2.0, 4.0]]))["block"].tolist() == [[0, 128, 255]]


def test_spans_are_as_long_as_what_is_so() -> None:
    layer = draw.spans(np.array([True, False, True, True]), np.array([0.0, 2.0, 4.0, 6.0]), "there")
    assert layer["spans"] == [[-1.0, 1.0], [3.0, 7.0]]


def test_the_bulk_of_the_values_says_where_an_axis_ends() -> None:
    assert top_of([np.ones(99), [1000.0]]) == pytest.approx(3.3)
    assert top_of([[2.0, np.nan]]) == pytest.approx(2.2)
    assert top_of([]) == 1.0


def test_many_events_are_cut_and_those_left_out_counted() -> None:
    events = [(float(k), "near", None) for k in range(draw.EVENTS_SHOWN + 7)]
    told = draw.drawing("x", [0.0], [], events=events, unlisted=3)
    assert (len(told["events"]), told["events"][0][0], told["unlisted"]) == (draw.EVENTS_SHOWN, 7.0, 10)


@pytest.mark.parametrize(("longitude", "scale"), [(179.99, 86_600.0), (0.0, 30_000.0)])
def test_longitude_and_latitude_are_right_to_a_metre(longitude: float, scale: float) -> None:
    def lonlat(places: np.ndarray) -> np.ndarray:  # bent, and across the antimeridian
        lon = longitude + places[:, 0] / scale * (1 + 1e-7 * places[:, 1])
        return np.column_stack([(lon + 180) % 360 - 180, 38.95 + places[:, 1] / 111_000.0])

    fit: dict[str, Any] = lonlat_fit(lonlat, (-900.0, 1200.0, -300.0, 800.0))
    places = [fit["x"], fit["y"]] + 0.5 * fit["half"] * np.random.default_rng(0).uniform(-1, 1, (200, 2))
    u, v = ((places - [fit["x"], fit["y"]]) / fit["half"]).T
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    lon, lat = (sum(c * u**i * v**j for c, (i, j) in zip(fit[name], powers, strict=True)) for name in ("lon", "lat"))
    expected = lonlat(places)
    assert np.abs((lon - expected[:, 0] + 180) % 360 - 180).max() < 1 / scale
    assert np.abs(lat - expected[:, 1]).max() < 1 / 111_000


ACTIONS = Path(__file__).with_name("actions.js")


def told_by(page: Path, actions: str) -> dict[str, Any]:
    document, console = browse(page, actions=actions)
    assert console == ""
    titled = re.search(r"<title>(.*)</title>", document)
    assert titled is not None
    told: dict[str, Any] = json.loads(titled.group(1))
    return told


def test_wheel_pointer_keys_time_line_and_layers_do_what_they_say(tmp_path: Path) -> None:
    told = told_by(made(tmp_path), ACTIONS.read_text(encoding="utf-8"))
    start = told["start"]
    assert (start["index"], start["chosen"], start["x"], start["y"], start["zoom"]) == (59, None, 20, 10, 1)
    assert told["wheel"]["zoom"] == pytest.approx(np.exp(0.3))  # about the pointer, and in both planes
    assert told["kept"] == pytest.approx([10, 10])
    for name in ("wheel", "dragged", "moved"):
        one = told[name]
        assert one["linked"] == pytest.approx([one["x"], one["y"], one["zoom"]])
    pixel = 0.08  # a pointer stands on whole ones
    assert told["wheel"]["x"] == pytest.approx(10 + 10 / np.exp(0.3), abs=pixel)
    assert told["dragged"]["x"] == pytest.approx(told["wheel"]["x"] - 2, abs=2 * pixel)
    assert told["all"] == start
    assert told["plus"]["zoom"] == pytest.approx(1.3)
    assert told["moved"]["x"] < told["plus"]["x"]
    assert (told["unasked"]["time"], told["curve"]["time"]) == (1, pytest.approx(np.exp(0.3)))
    assert told["curve"]["zoom"] == 1
    indices = [told[name]["index"] for name in ("home", "right", "back", "end", "scrub", "clicked")]
    assert indices == [0, 2, 1, 59, 20, 30]
    assert told["counter"] == "10.0 s"
    assert told["status"] == "track 1 · speed 1.25 m/s"
    # the row of the image from y = 12 on is 60 + 20 at this frame
    x, y, value = map(float, re.fullmatch(r"([0-9.]+), ([0-9.]+) m · image ([0-9.]+) dB", told["under"]).groups())
    assert (x, y) == pytest.approx((3.2, 12.7), abs=pixel)
    assert value == pytest.approx(80, abs=0.51 * 149 / 255)
    assert told["time"] == f"10.0 s · error {np.sin(20) + 2:.4g}"
    assert told["left"] == ""
    assert (told["centred"]["chosen"], told["pressed"], told["escaped"]["chosen"]) == (2, "true", None)
    assert [told["centred"]["x"], told["centred"]["y"]] == pytest.approx([30 - 0.2 * 30, 15])
    assert told["chosen"]["chosen"] == 1
    assert (told["event"]["index"], told["event"]["chosen"]) == (20, 2)
    assert told["ruler"].startswith("5.0")
    assert told["ruler"].endswith("m, 037°")
    assert [told["followed"]["x"], told["followed"]["y"]] == pytest.approx([25, 9])
    assert told["layers"] == ["error", "image", "land", "ellipses, 95 %", "whole paths, faintly"]  # as they stand
    assert told["off"]
    assert (told["playing"], told["paused"]) == ([True, True], False)
    assert told["played"]["index"] == 30
    assert told["ten seconds"]["index"] == 20  # real time
    assert told["large"] == "panel large"
    assert told["nameless"] == 0
    assert "Space plays" in told["keys"]


CLOCKED: list[tuple[list[float], str, float, str]] = [
    ([0, 1, 2], "frame", 2, "frame 2"),
    ([4.5, 5.5], "frame", 4.5, "frame 4.5"),
    ([0, 0.5], "s", 0.5, "0.5 s"),
    ([0, 0.02, 0.04], "s", 0.02, "0.02 s"),
    ([7], "s", 7, "7 s"),
    ([7.5], "s", 7.5, "7.5 s"),
    ([0, 3600, 7200], "s", 3725, "01:02:05"),
    ([0.5, 7300], "s", 3599.96, "01:00:00.0"),
    ([1.7e9, 1.7e9 + 4], "s", 1.7e9 + 4, "2023-11-14 22:13:24 UTC"),
    ([1.7e9 + 0.5], "s", 1.7e9 + 0.5, "2023-11-14 22:13:20.5 UTC"),
]
WORDS = """
document.title = JSON.stringify([
  %s.map(([times, unit, t]) => elusive.clockOf(times, unit).say(t)), elusive.ticks(0, 10, 5), elusive.ticks(0, 2, 8, 1),
  elusive.ticks(0.2, 9.3, 2), elusive.ticks(1700000010, 1700000098, 2, 0, elusive.OF_CLOCKS), elusive.ticks(3, 3, 2, 1),
  elusive.upTo([0, 1, 1, 2], 1),
  elusive.nearest([0, 1, 2], 1.4), elusive.nearest([0, 1, 2], 9), elusive.nearest([0, 1, 2], -5),
  elusive.degrees({ x: 0, y: 0, half: 1, degree: 0, lon: [181.5], lat: [-3.25] }, 0, 0),
]);
"""


def test_times_ticks_and_degrees_in_words(tmp_path: Path) -> None:
    words = [expected for *_, expected in CLOCKED]
    assert told_by(made(tmp_path), WORDS % json.dumps(CLOCKED)) == [
        words, [0, 2, 4, 6, 8, 10], [0, 1, 2],
        [2, 4, 6, 8], [1700000010, 1700000040, 1700000070], [3],  # one number alone tells no scale
        3, 1, 2, 0,
        "3.25000° S, 178.50000° W",
    ]  # fmt: skip


# what is written and filled while everything is drawn once more
LAID_OUT = """
const [written, filled] = [[], []];
const [text, rect] = [CanvasRenderingContext2D.prototype.fillText, CanvasRenderingContext2D.prototype.fillRect];
CanvasRenderingContext2D.prototype.fillText = function (...given) {
  written.push([given[0], this.textAlign, Math.round(given[1])]);
  return text.apply(this, given);
};
CanvasRenderingContext2D.prototype.fillRect = function (...given) {
  filled.push(given);
  return rect.apply(this, given);
};
made.draw();
const keys = () => [...made.root.querySelectorAll(".key")].filter((one) => !one.hidden).map((one) => one.style.color);
const inks = () => {
  const layers = made.spec.panels.flatMap((panel) => panel.layers).filter((one) => one.name);
  const one = document.createElement("i");
  return layers.map((layer) => ((one.style.color = made.at({}).ink(layer.colour)), one.style.color));
};
const once = filled.length;
const bright = [keys(), inks()];
document.body.classList.replace("body--light", "body--dark");
made.draw();
document.title = JSON.stringify({
  written, filled: once, bright, dark: [keys(), inks()],
  legends: made.panels.map((panel) => [...panel.legend.querySelectorAll("label")].map((one) => one.textContent)),
  below: [...made.box.querySelectorAll("label")].map((one) => one.textContent),
  widths: made.panels.map((panel) => panel.root.offsetWidth / made.grid.offsetWidth),
});
"""


def test_names_scales_and_legends_hide_no_data_and_stand_where_they_belong(tmp_path: Path) -> None:
    places = np.array([[19.0, 5.0], [21.0, 5.0], [39.9, 5.0]])
    named = draw.points(places, "--truth", texts=["left", "right", "edge"], name="nodes")
    curves = [draw.line(TIMES, TIMES, colour, name=name) for name, colour in (("a", "--mark"), ("b", "--accent"))]
    drawn = draw.drawing(
        "Laid out", TIMES,
        [
            draw.plane("Map", EXTENT, [named], span=8),
            draw.chart("First", TIMES, curves, unit="m", span=4), draw.chart("Second", TIMES, curves[1:], unit="m"),
        ],
    )  # fmt: skip
    Report("r", "", drawn).write_page(tmp_path / "r.html")
    told = told_by(tmp_path / "r.html", LAID_OUT)
    sides = {text: side for text, side, _ in told["written"] if text in named["texts"]}
    assert sides == {"left": "left", "right": "left", "edge": "right"}  # two neighbours' names cannot meet
    assert told["filled"] == 3  # the ground of each panel: no box lies over what is drawn
    assert told["legends"] == [[], ["a"], []]  # of the chart that alone has it
    assert told["below"] == ["nodes", "b"]
    for keys, inks in (told["bright"], told["dark"]):
        assert set(keys) == set(inks)
    assert told["bright"] != told["dark"]
    document, _ = browse(tmp_path / "r.html", 700, LAID_OUT)
    titled = re.search(r"<title>(.*)</title>", document)
    assert titled is not None
    narrow = json.loads(titled.group(1))["widths"]
    assert narrow == pytest.approx([1.0, 0.49, 0.49], abs=0.02)  # no third of a row stays empty


def test_times_in_sentences_are_those_of_the_drawing() -> None:
    assert [Clock.of(times, unit).say(time) for times, unit, time, _ in CLOCKED] == [said for *_, said in CLOCKED]
    assert [Clock.of(times, unit).bare(time) for times, unit, time, _ in CLOCKED[:4]] == ["2", "4.5", "0.5", "0.02"]
    assert moment(np.nan) == "nan s"


def test_a_browser_tells_of_a_fault(tmp_path: Path) -> None:
    """So that silence means something."""
    (tmp_path / "bad.html").write_text("<script>nothing.here()</script>")
    assert "nothing is not defined" in browse(tmp_path / "bad.html")[1]


def test_numbers_and_lines_are_broken_where_nothing_is_known() -> None:
    layer = draw.line([0.0, 1.0, 2.0], [1.0, np.nan, 3.0], "--accent")
    np.testing.assert_array_equal(numbers(layer["y"]), [1.0, np.nan, 3.0])
