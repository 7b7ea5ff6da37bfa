"""Category 240: what is written reads back equal, here and by another reader; what others write is read."""

from __future__ import annotations

import gzip
import math
import sys
from pathlib import Path

import numpy as np
import pycatzao
import pytest

from elusive.errors import DataError
from elusive.io.asterix_video import write_asterix_video
from elusive.io.radar_video import open_radar_video
from elusive.sensors.spokes import Spokes, check_spokes, join_spokes

NOON = 1_777_636_800.0  # 2026-05-01T12:00:00Z
DTYPES = {1: np.uint8, 2: np.uint8, 4: np.uint8, 8: np.uint8, 12: np.uint16, 16: np.uint16, 32: np.uint32}


def video(bits: int = 8, spokes: int = 300, samples: int = 77, *, start: int = 2, step_m: float = 7.5) -> Spokes:
    """Make a turn and a sixth, of smooth noise with weak ends."""
    rng = np.random.default_rng(bits)
    most = 2**bits - 1
    rough = rng.random((spokes, samples + 8))
    smooth = np.mean([rough[:, k : k + samples] for k in range(8)], axis=0)
    kind = DTYPES[bits]
    amplitude = np.clip((smooth - 0.3) * 2.5 * most, 0, most).astype(np.float64).round().astype(kind)
    turned = np.arange(spokes) / 256
    return check_spokes(
        Spokes(
            time_s=NOON + 2.4 * turned,
            azimuth_rad=2 * np.pi * (turned % 1),
            from_north=True,
            start_m=start * step_m,
            step_m=step_m,
            amplitude=amplitude,
            bits=bits,
            heading_rad=np.radians((359 + turned * 3) % 360),
            lonlat_deg=np.column_stack([10 + turned * 1e-4, -53 - turned * 1e-4]),
        )
    )


def read(path: Path, **options: str) -> Spokes:
    return join_spokes([check_spokes(part) for part in open_radar_video(path, **options)])


def agree(found: Spokes, written: Spokes) -> None:
    np.testing.assert_array_equal(found.amplitude, written.amplitude)
    assert (found.bits, found.amplitude.dtype) == (written.bits, written.amplitude.dtype)
    assert found.from_north == written.from_north
    assert found.step_m == pytest.approx(written.step_m, rel=1e-6)
    assert found.start_m == pytest.approx(written.start_m, rel=1e-6)
    off = np.angle(np.exp(1j * (found.azimuth_rad - written.azimuth_rad)))
    assert np.abs(off).max() <= 2 * math.pi / 2**17 * 1.001


@pytest.mark.parametrize("compress", [True, False])
@pytest.mark.parametrize("bits", DTYPES)
def test_what_is_written_reads_back_equal(tmp_path: Path, bits: int, compress: bool) -> None:
    written = video(bits)
    for name in ("raw", "video.pcap"):
        path = tmp_path / name
        assert write_asterix_video(path, [written], radar=(7, 42), compress=compress) == 300
        found = read(path)
        agree(found, written)
        clock_s = written.time_s - (0 if name == "video.pcap" else NOON - 43_200)
        # times of day are in 1/128 s, between which the antenna turns steadily
        assert np.abs(found.time_s - clock_s).max() < 1 / 128
        if name == "video.pcap":
            assert np.degrees(np.abs(np.angle(np.exp(1j * (found.heading_rad - written.heading_rad))))).max() < 0.01
            np.testing.assert_allclose(found.lonlat_deg, written.lonlat_deg, atol=1e-6)
        else:
            assert np.isnan(found.heading_rad).all()


def test_a_compressed_capture_reads_the_same(tmp_path: Path) -> None:
    written = video(4)
    write_asterix_video(tmp_path / "video.pcap", [written])
    (tmp_path / "video").write_bytes(gzip.compress((tmp_path / "video.pcap").read_bytes()))
    agree(read(tmp_path / "video"), written)


@pytest.mark.parametrize("compress", [True, False])
@pytest.mark.parametrize("bits", [8, 16, 32])
def test_another_reader_reads_what_is_written(tmp_path: Path, bits: int, compress: bool) -> None:
    written = video(bits)
    write_asterix_video(tmp_path / "raw", [written], radar=(7, 42), compress=compress)
    blocks = list(pycatzao.decode_file(tmp_path / "raw"))
    assert [block["summary"] for block in blocks if block["type"] == 1] == ["elusive azimuth=north"] * 2
    spokes = [block for block in blocks if block["type"] == 2]
    assert {(block["sac"], block["sic"]) for block in spokes} == {(7, 42)}
    assert [block["idx"] for block in spokes] == list(range(300))
    for at, block in enumerate(spokes):
        there = written.amplitude[at] > 0
        # it reads the octets in this machine's own order, the standard has the highest first
        amplitude = block["amp"] if bits == 8 or sys.byteorder == "big" else block["amp"].byteswap()
        np.testing.assert_array_equal(amplitude, written.amplitude[at][there])
        np.testing.assert_allclose(block["r"], written.range_m[there], rtol=1e-6)
        off = (block["az"] - np.degrees(written.azimuth_rad[at]) + 180) % 360 - 180
        assert abs(off) < 360 / 2**17 * 1.001
        assert block["tod"] == pytest.approx(written.time_s[at] % 86_400, abs=1 / 256)


@pytest.mark.parametrize("compress", [True, False])
@pytest.mark.parametrize("bits", [8, 16, 32])
def test_what_another_writer_writes_is_read(tmp_path: Path, bits: int, compress: bool) -> None:
    written = video(bits)
    with (tmp_path / "raw").open("wb") as file:
        for at, row in enumerate(written.amplitude):
            degrees = math.degrees(written.azimuth_rad[at])
            header = pycatzao.make_video_header(
                start_az=degrees, end_az=degrees, cell_offset=written.start_m, cell_width=written.step_m
            )
            message = pycatzao.make_video_message(row, msg_index=at, header=header, compress=compress)
            file.write(pycatzao.encode(message, sac=7, sic=42, tod=written.time_s[at] % 86_400))
    source = open_radar_video(tmp_path / "raw")
    agree(join_spokes(list(source)), written._replace(from_north=True))
    # it writes the octets in this machine's own order
    swapped = bits > 8 and sys.byteorder == "little"
    assert any("lowest octet first" in remark for remark in source.remarks()) == swapped


def test_noise_over_all_bits_is_read_as_the_standard_says(tmp_path: Path) -> None:
    amplitude = np.random.default_rng(0).integers(0, 2**16, (64, 500), dtype=np.uint16)
    written = video(16, 64, 500)._replace(amplitude=amplitude)
    write_asterix_video(tmp_path / "raw", [written])
    agree(read(tmp_path / "raw"), written)


def test_one_octet_of_several_is_taken_as_the_standard_says(tmp_path: Path) -> None:
    small = video(8)
    for factor in (1, 256):
        written = small._replace(amplitude=small.amplitude.astype(np.uint16) * factor, bits=16)
        write_asterix_video(tmp_path / "raw", [written])
        agree(read(tmp_path / "raw"), written)


def test_a_clock_that_differs_from_the_captures_is_said(tmp_path: Path) -> None:
    written = video(8)
    write_asterix_video(tmp_path / "video.pcap", [written])
    octets = bytearray((tmp_path / "video.pcap").read_bytes())
    at = 24
    while at < len(octets):  # each packet is captured a minute later
        octets[at : at + 4] = (int.from_bytes(octets[at : at + 4], "little") + 60).to_bytes(4, "little")
        at += 16 + int.from_bytes(octets[at + 8 : at + 12], "little")
    (tmp_path / "video.pcap").write_bytes(octets)
    source = open_radar_video(tmp_path / "video.pcap")
    found = join_spokes(list(source))
    assert np.abs(found.time_s - written.time_s).max() < 1 / 128
    assert np.isfinite(found.heading_rad).all()
    (remark,) = source.remarks()
    assert remark.startswith("The radar's clock is 60.0 s behind that of the capture")


def test_a_spoke_too_long_for_a_message_goes_in_several(tmp_path: Path) -> None:
    written = video(32, 40, 40_000, step_m=1.0)
    for name in ("raw", "video.pcap"):
        write_asterix_video(tmp_path / name, [written], compress=False)
        agree(read(tmp_path / name), written)


def test_azimuths_from_the_bow_take_the_heading_of_the_capture(tmp_path: Path) -> None:
    written = video(8)._replace(from_north=False)
    write_asterix_video(tmp_path / "video.pcap", [written])
    found = read(tmp_path / "video.pcap")
    assert found.from_north
    expected = written.azimuth_rad + written.heading_rad
    assert np.degrees(np.abs(np.angle(np.exp(1j * (found.azimuth_rad - expected))))).max() < 0.02
    write_asterix_video(tmp_path / "raw", [written])
    agree(read(tmp_path / "raw"), written)


def test_a_ships_radar_that_counts_from_the_bow_can_be_told_so(tmp_path: Path) -> None:
    written = video(8)
    write_asterix_video(tmp_path / "own.pcap", [written])
    octets = (tmp_path / "own.pcap").read_bytes().replace(b"azimuth=north", b"azimuth north")
    (tmp_path / "other.pcap").write_bytes(octets)  # as if another program had written it
    source = open_radar_video(tmp_path / "other.pcap")
    agree(join_spokes(list(source)), written)
    assert "if they count from the bow" in source.remarks()[0]
    source = open_radar_video(tmp_path / "other.pcap", from_bow=True)
    found = join_spokes(list(source))
    off = np.angle(np.exp(1j * (found.azimuth_rad - written.azimuth_rad - written.heading_rad)))
    assert np.degrees(np.abs(off)).max() < 0.02
    assert source.remarks() == []


def test_long_cells_are_in_nanoseconds(tmp_path: Path) -> None:
    written = video(8, step_m=900.0, start=0)
    write_asterix_video(tmp_path / "raw", [written])
    found = read(tmp_path / "raw")
    np.testing.assert_array_equal(found.amplitude, written.amplitude)
    assert found.step_m == pytest.approx(900, abs=0.08)


def test_spokes_that_end_where_nothing_is_are_filled_up(tmp_path: Path) -> None:
    first, second = video(8, 64, 50), video(8, 64, 30)
    later = second._replace(time_s=second.time_s + 1)
    write_asterix_video(tmp_path / "raw", [first, later])
    parts = list(open_radar_video(tmp_path / "raw"))
    assert {part.amplitude.shape[1] for part in parts} == {50}
    found = join_spokes(parts).amplitude
    np.testing.assert_array_equal(found[64:, :30], second.amplitude)
    assert not found[64:, 30:].any()


def test_a_radar_is_chosen_and_what_is_lost_is_said(tmp_path: Path) -> None:
    one, other = video(8, 40), video(4, 50)
    for name, spokes, radar in (("one", one, (1, 2)), ("other", other, (3, 4))):
        write_asterix_video(tmp_path / name, [spokes], radar=radar, compress=False)
    octets = (tmp_path / "one").read_bytes()
    size = int.from_bytes(octets[1:3])  # of the summary
    message = int.from_bytes(octets[size + 1 : size + 3])
    gap = octets[: size + 5 * message] + octets[size + 8 * message :]
    (tmp_path / "both").write_bytes(gap + (tmp_path / "other").read_bytes())
    source = open_radar_video(tmp_path / "both")
    assert len(join_spokes(list(source)).amplitude) == 37
    assert source.remarks() == [
        "Spokes missing by their numbers: 3.",
        "Spokes of another radar, 3/4, left out: 50; choose it with radar.",
    ]
    agree(read(tmp_path / "both", radar="3/4"), other)


def test_blocks_of_other_categories_are_passed_over(tmp_path: Path) -> None:
    written = video(8, 40)
    write_asterix_video(tmp_path / "raw", [written])
    (tmp_path / "mixed").write_bytes(b"\x22\x00\x05\x00\x00" * 3 + (tmp_path / "raw").read_bytes())
    agree(read(tmp_path / "mixed"), written)


def test_spokes_without_a_time_need_the_period(tmp_path: Path) -> None:
    header = pycatzao.make_video_header(start_az=0, end_az=0, cell_offset=0, cell_width=5)
    with (tmp_path / "raw").open("wb") as file:
        for at in range(72):
            header = pycatzao.make_video_header(start_az=5 * at, end_az=5 * at + 5, cell_offset=0, cell_width=5)
            message = pycatzao.make_video_message(np.full(9, at, np.uint8), msg_index=at, header=header)
            file.write(pycatzao.encode(message, sac=0, sic=1))
    with pytest.raises(DataError, match="no time; give rotation_s"):
        list(open_radar_video(tmp_path / "raw"))
    found = join_spokes(list(open_radar_video(tmp_path / "raw", rotation_s=3.6)))
    np.testing.assert_allclose(found.time_s, np.arange(72) * 0.05, atol=1e-4)
    np.testing.assert_allclose(np.degrees(found.azimuth_rad), np.arange(72) * 5 + 2.5, atol=0.01)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"amplitude": np.ones((300, 77), np.float32), "bits": 0}, "quantise"),
        ({"start_m": 3.0}, "whole steps"),
        ({"step_m": 0.0}, "step_m"),
    ],
)
def test_what_the_standard_cannot_hold_is_refused(tmp_path: Path, change: dict[str, object], said: str) -> None:
    with pytest.raises(DataError, match=said):
        write_asterix_video(tmp_path / "raw", [video(8)._replace(**change)])  # type: ignore[arg-type]
    with pytest.raises(DataError, match="two codes"):
        write_asterix_video(tmp_path / "raw", [video(8)], radar=(0, 256))
    assert not (tmp_path / "raw").exists()
