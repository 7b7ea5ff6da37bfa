"""Radar video as arrays: what is written reads back, and what research sets hold is taken as it is."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray

from elusive.errors import DataError, ParameterError
from elusive.io.radar_video import open_radar_video
from elusive.io.radar_video_arrays import write_radar_video_arrays
from elusive.sensors.spokes import Spokes, check_spokes, join_spokes
from tests.io.test_asterix_video import DTYPES, NOON, video


def read(path: Path, **options: float) -> Spokes:
    return join_spokes([check_spokes(part) for part in open_radar_video(path, **options)])


@pytest.mark.parametrize("name", ["video.npz", "video.nc"])
@pytest.mark.parametrize("bits", [*DTYPES, 0])
def test_what_is_written_reads_back(tmp_path: Path, name: str, bits: int) -> None:
    written = video(bits or 8)
    if not bits:
        written = written._replace(amplitude=(written.amplitude * np.pi).astype(np.float32), bits=0, from_north=False)
    parts = [written.select_spokes(slice(0, 130)), written.select_spokes(slice(130, 300))]
    assert write_radar_video_arrays(tmp_path / name, parts) == 300
    found = read(tmp_path / name)
    np.testing.assert_array_equal(found.amplitude, written.amplitude)
    assert found.amplitude.dtype == written.amplitude.dtype
    assert (found.bits, found.from_north) == (written.bits, written.from_north)
    np.testing.assert_array_equal(found.time_s, written.time_s)
    for name in ("azimuth_rad", "heading_rad", "lonlat_deg", "range_m"):
        np.testing.assert_allclose(getattr(found, name), getattr(written, name), atol=1e-9)


@pytest.mark.parametrize("option", ["radar", "from_bow"])
def test_what_arrays_say_themselves_is_not_taken_from_elsewhere(tmp_path: Path, option: str) -> None:
    write_radar_video_arrays(tmp_path / "video.npz", [video(8)])
    with pytest.raises(ParameterError, match=f"^{option}: has no meaning for arrays, which say it themselves"):
        open_radar_video(tmp_path / "video.npz", **{option: "0/1"})


def test_another_reader_reads_the_netcdf(tmp_path: Path) -> None:
    written = video(8)
    write_radar_video_arrays(tmp_path / "video.nc", [written])
    with xarray.open_dataset(tmp_path / "video.nc", engine="h5netcdf") as dataset:
        np.testing.assert_array_equal(dataset["amplitude"], written.amplitude)
        assert dataset["amplitude"].dims == ("spoke", "sample")
        assert dataset["azimuth_deg"].attrs["units"] == "degree"


def test_a_staring_radar_has_one_azimuth_and_complex_samples(tmp_path: Path) -> None:
    """As the IPIX radar's sets: in-phase and quadrature of fourteen ranges at 1 kHz."""
    rng = np.random.default_rng(0)
    samples = rng.standard_normal((2000, 14)) + 1j * rng.standard_normal((2000, 14))
    arrays = {"time_s": np.arange(2000) / 1000, "range_m": 2574 + 15.0 * np.arange(14), "azimuth_deg": 128.0}
    np.savez(tmp_path / "ipix.npz", amplitude=samples, **arrays)
    found = read(tmp_path / "ipix.npz")
    np.testing.assert_allclose(found.amplitude, np.abs(samples), rtol=1e-6)
    assert (found.bits, found.start_m, found.step_m) == (0, 2574, 15)
    np.testing.assert_allclose(found.azimuth_rad, np.radians(128))


def test_the_period_stands_for_times(tmp_path: Path) -> None:
    arrays = {"amplitude": np.ones((720, 4), np.int16), "step_m": 3.0, "start_m": 1.5}
    np.savez(tmp_path / "turns.npz", azimuth_deg=np.arange(720) % 360.0, **arrays)
    found = read(tmp_path / "turns.npz", rotation_s=3.6)
    np.testing.assert_allclose(found.time_s, np.arange(720) / 100)
    assert (found.bits, found.amplitude.dtype) == (16, np.uint16)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"amplitude": None}, "give amplitude"),
        ({"amplitude": np.ones(5)}, r"the shape \(5,\); give spokes x samples"),
        ({"amplitude": np.ones((5, 2, 2))}, r"the shape \(5, 2, 2\); give spokes x samples, turn after turn"),
        ({"amplitude": np.ones((4, 5)), "range_m": np.arange(5.0)}, r"as amplitude has samples: is it .*, \(4, 5\)\?"),
        ({"amplitude": np.linspace(-60, 9, 20).reshape(5, 4)}, r"down to -60; give magnitudes: of decibels"),
        ({"amplitude": np.asfortranarray(np.ones((5, 4)))}, "stored by columns"),
        ({"amplitude": -np.ones((5, 4), np.int32)}, "from -1 to -1; give magnitudes"),
        ({"amplitude": np.full((5, 4), np.nan)}, "not finite"),
        ({"amplitude": np.full((5, 4), "a")}, "whole or real"),
        ({"range_m": None}, "tells no ranges"),
        ({"range_m": np.array([0.0, 1, 2, 9])}, "evenly spaced"),
        ({"azimuth_deg": None}, "no azimuth_deg"),
        ({"azimuth_deg": np.arange(4.0)}, "4 values for 5 spokes"),
        ({"time_s": None}, "no time_s"),
        ({"time_s": np.arange(5.0)[::-1]}, "backwards"),
        ({"bits": 2}, "more than 2 bits"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(tmp_path: Path, change: dict[str, object], said: str) -> None:
    arrays = {"amplitude": np.full((5, 4), 7, np.uint8), "range_m": np.arange(4.0), "time_s": np.arange(5.0)}
    kept = {
        key: value for key, value in ({"azimuth_deg": np.arange(5.0)} | arrays | change).items() if value is not None
    }
    np.savez(tmp_path / "a.npz", **kept)
    with pytest.raises(DataError, match=said):
        list(open_radar_video(tmp_path / "a.npz"))


def test_scales_that_differ_are_not_written_together(tmp_path: Path) -> None:
    for name in ("a.npz", "a.nc"):
        with pytest.raises(DataError, match="differ"):
            write_radar_video_arrays(
                tmp_path / name, [video(8), video(8, step_m=5.0)._replace(time_s=NOON + np.arange(300.0))]
            )
        with pytest.raises(DataError, match="no spokes"):
            write_radar_video_arrays(tmp_path / name, [])
        assert not (tmp_path / name).exists()


@pytest.mark.parametrize(
    ("first", "last", "refused"),
    [(0.0, 2 * np.pi, True), (0.0, 6.0, False), (0.0, 360.0, False), (40.0, 40 + 2 * np.pi, False)],
)
def test_azimuths_in_radians_are_named(tmp_path: Path, first: float, last: float, refused: bool) -> None:
    """A whole turn in radians is no sector of 6.3 degrees; such a sector elsewhere, or one of 6 degrees, is read."""
    azimuth = np.linspace(first, last, 500, endpoint=False)
    arrays = {"amplitude": np.ones((500, 8), np.uint8), "time_s": np.arange(500) / 200, "step_m": 5.0}
    np.savez(tmp_path / "video.npz", azimuth_deg=azimuth, **arrays)
    if refused:
        with pytest.raises(DataError, match="a turn in radians; give degrees"):
            read(tmp_path / "video.npz")
    else:
        assert len(read(tmp_path / "video.npz").time_s) == 500


@pytest.mark.parametrize(("unit", "takes"), [(1e3, "2.5e+03"), (0.0, "0"), (1 / 86400, "2.89e-05"), (1.0, None)])
def test_times_in_another_unit_are_named(tmp_path: Path, unit: float, takes: str | None) -> None:
    """Milliseconds gave no word in 40 s, equal times were taken."""
    azimuth = np.arange(800) * 0.9
    arrays = {"amplitude": np.ones((800, 8), np.uint8), "azimuth_deg": azimuth, "step_m": 5.0}
    np.savez(tmp_path / "video.npz", time_s=7.0 + unit * 2.5 * azimuth / 360, **arrays)
    if takes is None:
        assert len(read(tmp_path / "video.npz").time_s) == 800
    else:
        with pytest.raises(
            DataError, match=f"a turn of the antenna takes {re.escape(takes)}.* s; give time_s in seconds"
        ):
            read(tmp_path / "video.npz")
