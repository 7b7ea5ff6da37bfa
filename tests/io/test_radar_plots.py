"""Radar plots as a table: written and read back exactly, gathered in scans, and each fault named."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from elusive.errors import DataError, ParameterError
from elusive.io import RadarPlot, RadarScan, open_radar_plots, scans_by_rotation, write_radar_plots_csv
from elusive.sensors.radar_rotation import period_of, rotation_of
from tests import recordings

HEADER = "time_s,range_m,bearing_deg,doppler_mps\n"
TAU = 2 * math.pi
ASTERIX = recordings.DATA / "asterix" / "cat_034_048.pcap"
fuzzed = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def scan(time_s: float, *plots: tuple[float, float, float]) -> RadarScan:
    table = np.array(plots, dtype=float).reshape(-1, 3).T
    return RadarScan(time_s, np.full(len(plots), time_s), *table)


def saved(tmp_path: Path, text: str | bytes, name: str = "p.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def same(found: list[RadarScan], expected: list[RadarScan]) -> bool:
    return len(found) == len(expected) and all(
        a.time_s == b.time_s and all(np.array_equal(x, y, equal_nan=True) for x, y in zip(a[1:5], b[1:5], strict=True))
        for a, b in zip(found, expected, strict=True)
    )


# ---------------------------------------------------------------------------------------------------------- reading


def test_plots_of_equal_times_are_a_scan(tmp_path: Path) -> None:
    text = HEADER + "0.5,1000,90,-2.5\n0.5,2000,180,\n2.5,,,\n4.5,500,0,nan\n6.5,1500,360,0\n"
    expected = [
        scan(0.5, (1000, TAU / 4, -2.5), (2000, TAU / 2, math.nan)),
        scan(2.5),
        scan(4.5, (500, 0, math.nan)),
        scan(6.5, (1500, 0, 0)),
    ]
    source = open_radar_plots(saved(tmp_path, text))
    for _ in range(2):
        found = list(source)
        assert same(found, expected)
        assert all(part.dtype == np.float64 for s in found for part in s[1:5])


@pytest.mark.parametrize(
    "text",
    [
        "time_s,range_m,bearing_deg\n1,10,90\n2,20,180\n",
        "\ufefftime_s;range_m;bearing_deg\r\n1;10;90\r\n\r\n2;20;180\r\n",
        "# a radar\nbearing_deg\trange_m\ttime_s\n90\t10\t1\n# a pause\n180\t2e1\t+2.",
        'time_s, "range_m", bearing_deg, doppler_mps\n 1, 10, 90,\n2, 20 , 180, NaN\n',
    ],
)
def test_harmless_differences_of_form(tmp_path: Path, text: str) -> None:
    for name in ("p.csv", "p.TXT", "p.tsv"):
        found = list(open_radar_plots(saved(tmp_path, text, name)))
        assert same(found, [scan(1, (10, TAU / 4, math.nan)), scan(2, (20, TAU / 2, math.nan))])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", r"p\.csv: is empty; write time_s,range_m,bearing_deg, one plot a line"),
        ("# nothing\n\n", r"p\.csv: is empty"),
        (HEADER, r"p\.csv: holds no plot"),
        (HEADER + "1,,,\n", r"p\.csv: holds no plot"),
        (
            "1,10,90\n",
            r"line 1: the columns are '1,10,90'; name them time_s,range_m,bearing_deg and perhaps time, range_km",
        ),
        ("time_s,range_m\n", r"line 1: the columns are 'time_s,range_m'"),
        ("time,range_m,bearing_deg\n1,10,90\n", r"line 2, column time: '1' is no date and time; write 2026-"),
        ("time,range_m,bearing_deg\n20260501,10,90\n", r"line 2, column time: '20260501' is no date"),
        ("time_s,range_nmi,bearing_deg\n1,-2,90\n", r"line 2, column range_nmi: -2 is below 0"),
        ("time_s,range_m,range_m,bearing_deg\n", r"line 1: the columns are"),
        (HEADER + "1,10,400,\n", r"line 2, column bearing_deg: 400 is not from 0 to 360 degrees clockwise"),
        (HEADER + "1,10,-0.5,\n", r"line 2, column bearing_deg: -0\.5 is not from 0 to 360"),
        (HEADER + "1,10,,\n", r"line 2, column bearing_deg: '' is no number"),
        (HEADER + "1,10,nan,\n", r"line 2, column bearing_deg: 'nan' is no number"),
        (HEADER + "1,,90,\n", r"line 2, column range_m: '' is no number"),
        (HEADER + "1,-10,90,\n", r"line 2, column range_m: -10 is below 0"),
        (HEADER + "1,inf,90,\n", r"line 2, column range_m: 'inf' is no number"),
        (HEADER + "1,1e999,90,\n", r"line 2, column range_m: '1e999' is no number"),
        (HEADER + "1,1_0,90,\n", r"line 2, column range_m: '1_0' is no number"),
        (HEADER + "1,10,90,fast\n", r"line 2, column doppler_mps: 'fast' is no number"),
        (HEADER + "1,10,90,inf\n", r"line 2, column doppler_mps: 'inf' is no number"),
        (HEADER + ",10,90,\n", r"line 2, column time_s: '' is no number"),
        (HEADER + "1,,,3\n", r"line 2, column range_m: '' is no number"),
        (HEADER + "1,10,90\n", r"line 2: has 3 cells for 4 columns: '1,10,90'; repair it"),
        (HEADER + "1,10,90,,\n", r"line 2: has 5 cells"),
        ("time_s;range_m;bearing_deg\n1,500,5;10;90\n", r"line 2, column time_s: '1,500,5' is no number"),
        (HEADER + "2,10,90,\n\n1,10,90,\n", r"line 4, column time_s: 1 comes after 2; a time must go forwards"),
        (HEADER + "1,,,\n1,10,90,\n", r"line 3, column time_s: 1 comes after 1; a time without a plot stands alone"),
        (HEADER + "1,10,90,\n1,,,\n", r"line 3, column time_s: 1 comes after 1; a time without a plot stands alone"),
    ],
)
@pytest.mark.parametrize("rotation_s", [None, 2.5])
def test_faults_are_named(tmp_path: Path, text: str, told: str, rotation_s: float | None) -> None:
    with pytest.raises(DataError, match=told):
        list(open_radar_plots(saved(tmp_path, text), rotation_s=rotation_s))


@pytest.mark.parametrize(("column", "range_m"), [("range_m", 1.5), ("range_km", 1500.0), ("range_nmi", 2778.0)])
def test_the_header_names_the_unit_of_range(tmp_path: Path, column: str, range_m: float) -> None:
    found = list(open_radar_plots(saved(tmp_path, f"time_s,{column},bearing_deg\n1,1.5,90\n2,1.5,90\n")))
    assert same(found, [scan(1, (range_m, TAU / 4, math.nan)), scan(2, (range_m, TAU / 4, math.nan))])


def test_times_as_iso_8601_count_from_1970(tmp_path: Path) -> None:
    lines = ["1970-01-02T00:00:00Z,10,90", "1970-01-02 00:00:02.5,10,90", "1970-01-02T01:00:05+01:00,,"]
    found = list(open_radar_plots(saved(tmp_path, "\n".join(["time,range_m,bearing_deg", *lines]))))
    assert [(s.time_s, s.detections) for s in found] == [(86400, 1), (86402.5, 1), (86405, 0)]


def test_other_columns_are_named_and_do_not_fill_a_scan(tmp_path: Path) -> None:
    text = "label,time_s,range_m,range_km,bearing_deg,dB\na,1,10,7,90,3\nb,2,,,,3\n"
    source = open_radar_plots(saved(tmp_path, text))
    assert source.ignored == ("label", "range_km", "dB")
    assert same(list(source), [scan(1, (10, TAU / 4, math.nan)), scan(2)])
    assert open_radar_plots(saved(tmp_path, HEADER + "1,10,90,\n")).ignored == ()


def test_the_plots_before_a_fault_are_given_before_it(tmp_path: Path) -> None:
    scans = iter(open_radar_plots(saved(tmp_path, HEADER + "1,10,90,\n2,10,90,\n3,10,90,\n4,10,400,\n")))
    assert [next(scans).time_s, next(scans).time_s] == [1, 2]
    with pytest.raises(DataError, match="line 5"):
        next(scans)


def test_what_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"gone\.csv: there is no such file"):
        open_radar_plots(tmp_path / "gone.csv")
    with pytest.raises(DataError, match="is a folder"):
        open_radar_plots(tmp_path)
    with pytest.raises(DataError, match=r"line 2: is not text in UTF-8"):
        list(open_radar_plots(saved(tmp_path, HEADER.encode() + b"1,10,90,\xff\n")))
    with pytest.raises(DataError, match="this is a table; leave it out"):
        open_radar_plots(saved(tmp_path, HEADER), radar=(1, 2))


@fuzzed
@given(text=st.one_of(st.text(max_size=80), st.text("0123456789.,;-+eEna\n ", max_size=80).map(lambda t: HEADER + t)))
def test_any_text_is_plots_or_a_sentence(tmp_path: Path, text: str) -> None:
    path = saved(tmp_path, text.encode("utf-8", "surrogatepass"))
    try:
        scans = list(open_radar_plots(path))
    except DataError as error:
        assert str(error).startswith(str(path))  # noqa: PT017
    else:
        assert all(((s.bearing_rad >= 0) & (s.bearing_rad < TAU)).all() for s in scans)
        assert [s.time_s for s in scans] == sorted({s.time_s for s in scans})


def test_a_long_table_is_not_held_in_memory(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"

    def many() -> Iterator[RadarScan]:
        for k in range(3_000):
            yield scan(float(k), (100.0 + k, 1.0, 0.5), (200.0 + k, 2.0, math.nan))

    tracemalloc.start()
    try:
        write_radar_plots_csv(path, many())
        assert sum(len(s.range_m) for s in open_radar_plots(path)) == 6_000
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 300_000  # the files' buffers; the plots themselves are more than 1 MB


# ---------------------------------------------------------------------------------------------------------- writing

numbers = st.floats(-1e6, 1e6)
plots = st.tuples(st.floats(0, 1e7), st.floats(0, TAU, exclude_max=True), st.one_of(st.just(math.nan), numbers))


@fuzzed
@given(times=st.lists(numbers, min_size=1, max_size=5, unique=True), data=st.data())
def test_what_is_written_reads_back_exactly(tmp_path: Path, times: list[float], data: st.DataObject) -> None:
    scans = [scan(t, *data.draw(st.lists(plots, max_size=3))) for t in sorted(times)]
    scans.append(scan(2e6, data.draw(plots)))
    write_radar_plots_csv(tmp_path / "p.csv", scans)
    assert same(list(open_radar_plots(tmp_path / "p.csv")), scans)


@fuzzed
@given(degrees=st.integers(0, 359_999_999_999).map(lambda n: f"{n / 1e9:.9f}".rstrip("0").rstrip(".")))
def test_degrees_stay_as_they_were_typed(tmp_path: Path, degrees: str) -> None:
    path = saved(tmp_path, HEADER + f"1.0,10.0,{degrees},\n")
    (read,) = open_radar_plots(path)
    assert read.bearing_rad[0] == pytest.approx(math.radians(float(degrees)), rel=1e-15)
    write_radar_plots_csv(tmp_path / "again.csv", [read])
    found = (tmp_path / "again.csv").read_text().splitlines()[1].split(",")[2]
    assert found == degrees


@pytest.mark.parametrize("bearing", [0.0, 5e-324, math.nextafter(TAU, 0), math.pi, 1e-9])
def test_bearings_at_the_ends(tmp_path: Path, bearing: float) -> None:
    write_radar_plots_csv(tmp_path / "p.csv", [scan(1, (1, bearing, 0))])
    (read,) = open_radar_plots(tmp_path / "p.csv")
    assert read.bearing_rad[0] == bearing


@pytest.mark.parametrize(
    ("bad", "told"),
    [
        (scan(1, (10, 1, 0)), "scan 2 has the time 1 after 1; times must be finite and go forwards"),
        (scan(0.5), "scan 2 has the time 0.5 after 1"),
        (scan(math.nan, (10, 1, 0)), "scan 2 has the time nan"),
        (scan(2, (-1, 1, 0)), "scan 2 has a range below 0"),
        (scan(2, (math.nan, 1, 0)), "scan 2 has a range below 0 or not finite"),
        (scan(2, (1, TAU, 0)), "scan 2 has a bearing outside 0 to 2 pi"),
        (scan(2, (1, -0.1, 0)), "scan 2 has a bearing outside"),
        (scan(2, (1, 1, math.inf)), "scan 2 has an infinite Doppler"),
        (scan(2, (1, 1, 0))._replace(range_m=np.ones(2)), "scan 2 has arrays of different lengths"),
    ],
)
def test_a_bad_scan_leaves_no_file(tmp_path: Path, bad: RadarScan, told: str) -> None:
    with pytest.raises(DataError, match=told):
        write_radar_plots_csv(tmp_path / "p.csv", [scan(1, (10, 1, 0)), bad])
    assert list(tmp_path.iterdir()) == []


# --------------------------------------------------------------------------------------------------------- rotation


def rotating(period: float, turns: int, bearings: list[float], seed: int, jitter_s: float = 0.0) -> list[RadarPlot]:
    """Simulate plots of targets that stand still, each seen at the time when the antenna passes it."""
    rng = np.random.default_rng(seed)
    phase = rng.uniform()
    return sorted(
        RadarPlot((turn + phase + bearing / TAU) * period + jitter_s * rng.uniform(-1, 1), 100.0 + i, bearing)
        for turn in range(turns)
        for i, bearing in enumerate(bearings)
    )


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("believed", "jitter_s"), [(2.5, 0.0), (2.5, 0.05), (2.52, 0.05), (2.48, 0.05)])
def test_a_target_is_seen_once_a_turn_wherever_it_stands(seed: int, believed: float, jitter_s: float) -> None:
    bearings = [*np.random.default_rng(seed).uniform(0.3, TAU - 0.3, 6)]
    gathered = list(scans_by_rotation(rotating(2.5, 200, bearings, seed, jitter_s), believed, "x"))
    ranges = [sorted(s.range_m) for s in gathered]
    whole = sum(found == [100.0 + i for i in range(6)] for found in ranges)
    assert whole >= 198  # at the start the antenna's north is not yet known
    times = [s.time_s for s in gathered]
    assert times == sorted(times)


def test_a_lone_target_and_the_turns_that_missed_it() -> None:
    every = rotating(2.5, 300, [1.0], seed=3, jitter_s=0.02)
    missed = np.random.default_rng(4).uniform(size=300) < 0.4
    missed[[0, -1]] = False
    gathered = list(scans_by_rotation((p for p, gone in zip(every, missed, strict=True) if not gone), 2.5, "x"))
    assert [len(s.range_m) == 0 for s in gathered] == list(missed)
    # a turn that missed it is timed at its middle, the target stands .16 turns behind its beginning
    assert np.abs(np.diff([s.time_s for s in gathered]) - 2.5).max() < (0.5 - 1.0 / TAU) * 2.5 + 0.1


def test_north_is_no_seam() -> None:
    looks = rotating(2.5, 200, [0.01, 0.02, 6.26, 6.27], seed=6, jitter_s=0.05)
    gathered = list(scans_by_rotation(looks, 2.5, "x"))
    assert 200 <= len(gathered) <= 201
    assert np.array_equal(np.concatenate([s.times_s for s in gathered]), [p.time_s for p in looks])


def test_a_wrong_rotation_is_a_sentence() -> None:
    plots_of_ten = rotating(2.5, 100, [*np.linspace(0.1, 6, 10)], seed=1)
    for period in (2.0, 3.1, 1.0, 10.0):
        with pytest.raises(DataError, match=rf"^x: times and bearings do not fit .* once in {period:g} s"):
            list(scans_by_rotation(plots_of_ten, period, "x"))
    for bad in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ParameterError, match="rotation_s="):
            list(scans_by_rotation(plots_of_ten, bad, "x"))


def test_times_that_no_antenna_has() -> None:
    with pytest.raises(DataError, match=r"^x: time 1 s comes after 2 s; sort the plots"):
        list(scans_by_rotation([RadarPlot(2.0, 1.0, 0.0), RadarPlot(1.0, 1.0, 0.0)], 2.5, "x"))
    with pytest.raises(DataError, match=r"^x: nothing for 400000 turns of 2.5 s before time 1e"):
        list(scans_by_rotation([RadarPlot(0.0, 1.0, 0.0), RadarPlot(1e6, 1.0, 0.0)], 2.5, "x"))


def test_a_table_of_an_antenna(tmp_path: Path) -> None:
    lines = [f"{p.time_s!r},{p.range_m!r},{math.degrees(p.bearing_rad)!r}," for p in rotating(3.0, 20, [1.0, 2.0], 5)]
    path = saved(tmp_path, HEADER + "\n".join(lines))
    assert [len(s.range_m) for s in open_radar_plots(path, rotation_s=3.0)] == [2] * 20
    estimated = open_radar_plots(path)
    assert estimated.estimated
    assert estimated.rotation_s == pytest.approx(3.0, rel=1e-3)
    assert [len(s.range_m) for s in estimated] == [2] * 20


def test_one_plot_a_scan_at_steady_times_needs_no_antenna(tmp_path: Path) -> None:
    lines = [f"{time_s},1000,{40 + time_s / 9}," for time_s in range(60) if time_s % 7]
    source = open_radar_plots(saved(tmp_path, HEADER + "\n".join(lines)))
    assert source.rotation_s is None
    assert [len(s.range_m) for s in source] == [1] * 51


@pytest.mark.parametrize("seed", range(6))
def test_a_period_is_found_or_not_said(tmp_path: Path, seed: int) -> None:
    """Seven targets that move, two in three seen, times to a hundredth of a second; and plots at random times."""
    rng = np.random.default_rng(seed)
    period, bearings = rng.uniform(1, 12), rng.uniform(0, TAU, 7)
    turning = rotating(period, 60, [*bearings], seed, 0.01)
    seen = [p for p in turning if rng.random() < 2 / 3]
    assert period_of(*np.array(seen)[:, [0, 2]].T) == pytest.approx(period, rel=2e-3)
    astray = [
        p._replace(bearing_rad=float(angle)) for p, angle in zip(seen, rng.uniform(0, TAU, len(seen)), strict=True)
    ]
    lines = [f"{float(p.time_s)},{p.range_m},{math.degrees(p.bearing_rad)}," for p in astray]
    with pytest.raises(DataError, match="do not fit one antenna"):
        open_radar_plots(saved(tmp_path, HEADER + "\n".join(lines)))


def test_a_jammer_that_fills_one_bearing_is_no_antenna(tmp_path: Path) -> None:
    """Scans of one time each, forty of whose plots lie in one direction."""
    rng = np.random.default_rng(8)
    bearings = [np.concatenate([rng.normal(70.0, 0.2, 40), rng.uniform(0, 360, 7)]) for _ in range(40)]
    lines = [f"{2.5 * k},{rng.uniform(100, 6000):.1f},{one:.3f}," for k, scan in enumerate(bearings) for one in scan]
    source = open_radar_plots(saved(tmp_path, HEADER + "\n".join(lines)))
    assert source.rotation_s is None
    assert [len(one.times_s) for one in source] == [47] * 40


@pytest.mark.skipif(not ASTERIX.exists(), reason="the recordings are not here")
@pytest.mark.parametrize("seed", range(4))
def test_a_spoke_that_goes_round_is_no_antenna(seed: int) -> None:
    """Another radar's pulses, on one bearing of a scan and farther on in the next, beside plots all round."""
    rng = np.random.default_rng(seed)
    scans, turn = 2.5 * np.arange(40), rng.uniform(0.1, 0.3)
    plots = [
        RadarPlot(time_s, 3000.0, float(bearing % (2 * math.pi)), math.nan)
        for number, time_s in enumerate(scans.tolist())
        for bearing in [*rng.normal(turn * number, 0.01, 20), *rng.uniform(0, 2 * math.pi, 6)]
    ]
    assert not rotation_of(plots).needed


def test_part_of_a_turn_says_how_fast_the_antenna_turns() -> None:
    """Half a second of two radars: bearings rise by 36 degrees a second."""
    source = open_radar_plots(ASTERIX, radar=(25, 201))
    assert source.rotation_s == pytest.approx(10.0, abs=0.2)
    with pytest.raises(DataError, match="radar"):
        open_radar_plots(ASTERIX)


def test_scans_by_rotation_keep_each_plots_time(tmp_path: Path) -> None:
    gathered = list(scans_by_rotation(rotating(3.0, 20, [1.0, 2.0, 2.5], 5), 3.0, "x"))
    write_radar_plots_csv(tmp_path / "p.csv", gathered)
    assert same(list(open_radar_plots(tmp_path / "p.csv", rotation_s=3.0)), gathered)
    assert gathered[0].time_s == pytest.approx(gathered[0].times_s.mean(), rel=1e-15)
