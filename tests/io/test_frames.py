"""Every form of sequence, written by another library, reads back as the same frames, one at a time."""

import contextlib
import tracemalloc
import zipfile

import h5py
import numpy as np
import pytest
import tifffile
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from elusive.errors import DataError
from elusive.io import open_frames
from elusive.io._order import natural_key

T, ROWS, COLS = 5, 6, 9


@pytest.fixture
def movie():
    return np.random.default_rng(1).integers(0, 65536, (T, ROWS, COLS), dtype=np.uint16)


def save_npy(path, movie):
    np.save(path, movie)


def save_fortran_npy(path, movie):
    np.save(path, np.asfortranarray(movie))


def save_npz(path, movie):
    np.savez(path, movie=movie)


def save_packed_npz(path, movie):
    np.savez_compressed(path, movie=movie, axis=np.arange(3))


def save_fortran_npz(path, movie):
    np.savez(path, movie=np.asfortranarray(movie))


def save_plane_npz(path, movie):
    np.savez(path, *np.concatenate([movie] * 3))


def save_tiff(path, movie):
    tifffile.imwrite(path, movie)


def save_deflated_tiff(path, movie):
    tifffile.imwrite(path, movie, compression="zlib", predictor=True)


def save_imagej_tiff(path, movie):
    tifffile.imwrite(path, movie, imagej=True)


def save_one_header_tiff(path, movie):
    tifffile.imwrite(path, movie, truncate=True)


def save_big_endian_one_header_tiff(path, movie):
    tifffile.imwrite(path, movie, truncate=True, byteorder=">")


def save_big_tiff(path, movie):
    tifffile.imwrite(path, movie, bigtiff=True, byteorder=">")


def save_lzw_tiff(path, movie):
    first, *others = (Image.fromarray(frame) for frame in movie)
    first.save(path, compression="tiff_lzw", save_all=True, append_images=others)


def save_white_is_zero_tiff(path, movie):
    tifffile.imwrite(path, 65535 - movie, photometric="miniswhite")


def save_hdf5(path, movie):
    with h5py.File(path, "w") as file:
        file.create_dataset("group/movie", data=movie, chunks=(1, ROWS, COLS), compression="gzip")
        file["times"] = np.arange(T)


FORMS = [
    (save_npy, "m.npy"),
    (save_fortran_npy, "m.npy"),
    (save_npz, "m.npz"),
    (save_packed_npz, "m.npz"),
    (save_fortran_npz, "m.npz"),
    (save_tiff, "m.tif"),
    (save_deflated_tiff, "m.tiff"),
    (save_imagej_tiff, "m.tif"),
    (save_one_header_tiff, "m.tif"),
    (save_big_endian_one_header_tiff, "m.tif"),
    (save_big_tiff, "m.TIF"),
    (save_lzw_tiff, "m.tif"),
    (save_white_is_zero_tiff, "m.tif"),
    (save_hdf5, "m.h5"),
]


@pytest.mark.parametrize(("save", "name"), FORMS, ids=[save.__name__ for save, _ in FORMS])
def test_a_stack_reads_back_exactly_and_again(tmp_path, movie, save, name):
    save(tmp_path / name, movie)
    source = open_frames(tmp_path / name)
    assert (source.shape, source.length, source.rate_hz) == ((ROWS, COLS), T, None)
    for _ in range(2):
        frames = list(source)
        assert all(frame.dtype == np.float64 and frame.flags.writeable for frame in frames)
        np.testing.assert_array_equal(frames, movie)
    np.testing.assert_array_equal(list(open_frames(tmp_path / name, start=1, stop=4)), movie[1:4])
    np.testing.assert_array_equal(list(open_frames(tmp_path / name, start=3)), movie[3:])


def test_2d_arrays_of_an_archive_are_frames_in_natural_order(tmp_path, movie):
    save_plane_npz(tmp_path / "m.npz", movie)
    np.testing.assert_array_equal(list(open_frames(tmp_path / "m.npz")), np.concatenate([movie] * 3))


@pytest.mark.parametrize("suffix", [".png", ".tif", ".pgm", ".bmp"])
def test_a_folder_reads_in_natural_order(tmp_path, movie, suffix):
    movie = movie if suffix != ".bmp" else (movie >> 8).astype(np.uint8)
    for number, frame in zip((1, 2, 10, 11, 100), movie, strict=True):
        Image.fromarray(frame).save(tmp_path / f"frame{number}{suffix}")
    (tmp_path / "notes.txt").write_text("not a frame")
    (tmp_path / f"._frame1{suffix}").write_bytes(b"left by a Mac")
    source = open_frames(tmp_path)
    np.testing.assert_array_equal(list(source), movie)
    assert (source.length, source.name) == (T, str(tmp_path))
    np.testing.assert_array_equal(list(open_frames(f"{tmp_path}/frame1*{suffix}")), movie[[0, 2, 3, 4]])


def test_a_pattern_chooses_among_the_files_of_a_folder(tmp_path, movie):
    for k, frame in enumerate(movie):
        Image.fromarray(frame).save(tmp_path / f"ir_{k}.png")
        Image.fromarray(frame[::-1].copy()).save(tmp_path / f"day_{k}.png")
    np.testing.assert_array_equal(list(open_frames(tmp_path, pattern="ir_*.png")), movie)


def test_the_name_of_a_folder_may_hold_glob_characters(tmp_path, movie):
    folder = tmp_path / "run[1]"
    folder.mkdir()
    Image.fromarray(movie[0]).save(folder / "a.png")
    np.testing.assert_array_equal(list(open_frames(folder)), movie[:1])


@given(st.lists(st.integers(0, 10**6), min_size=1, unique=True))
def test_natural_order_is_the_order_of_the_numbers(numbers):
    assert sorted((f"a{n}_x" for n in numbers), key=natural_key) == [f"a{n}_x" for n in sorted(numbers)]


@given(st.lists(st.text(max_size=8), max_size=8, unique=True))
def test_natural_order_tells_any_two_names_apart(names):
    assert sorted(names, key=natural_key) == sorted(set(names), key=natural_key)


@pytest.mark.parametrize("channels", [3, 4])
def test_colour_becomes_rec_601_luma(tmp_path, channels):
    colour = np.random.default_rng(2).integers(0, 256, (T, ROWS, COLS, channels), dtype=np.uint8)
    luma = 0.299 * colour[..., 0] + 0.587 * colour[..., 1] + 0.114 * colour[..., 2]
    for k, frame in enumerate(colour):
        Image.fromarray(frame).save(tmp_path / f"{k}.png")
    np.save(tmp_path / "c.npy", colour)
    np.savez(tmp_path / "c.npz", colour)
    tifffile.imwrite(tmp_path / "c.tiff", colour, photometric="rgb", extrasamples=["unassalpha"] * (channels - 3))
    for path in (tmp_path / "c.npy", tmp_path / "c.npz", tmp_path / "c.tiff"):
        np.testing.assert_allclose(list(open_frames(path)), luma, rtol=0, atol=1e-9)
    np.testing.assert_allclose(list(open_frames(tmp_path, pattern="*.png")), luma, rtol=0, atol=1e-9)


@pytest.mark.parametrize("mode", ["P", "LA", "RGB", "1"])
def test_a_grey_picture_stored_otherwise_keeps_its_exact_values(tmp_path, movie, mode):
    grey = (movie[0] >> 8).astype(np.uint8)
    image = Image.fromarray(grey).convert(mode, **({"dither": 0} if mode == "1" else {}))
    image.save(tmp_path / "0.png")
    expected = grey >= 128 if mode == "1" else grey
    np.testing.assert_array_equal(next(iter(open_frames(tmp_path))), expected)


@pytest.mark.parametrize("axis", [1, 3])
def test_one_channel_is_none(tmp_path, movie, axis):
    np.save(tmp_path / "one.npy", np.expand_dims(movie, axis))
    np.testing.assert_array_equal(list(open_frames(tmp_path / "one.npy")), movie)


def test_planar_colour_tiff(tmp_path):
    colour = np.random.default_rng(2).integers(0, 256, (2, 3, ROWS, COLS), dtype=np.uint8)
    tifffile.imwrite(tmp_path / "c.tif", colour, photometric="rgb", planarconfig="separate")
    luma = 0.299 * colour[:, 0] + 0.587 * colour[:, 1] + 0.114 * colour[:, 2]
    np.testing.assert_allclose(list(open_frames(tmp_path / "c.tif")), luma, rtol=0, atol=1e-9)


def test_one_dataset_of_several_is_named_either_way(tmp_path, movie):
    with h5py.File(tmp_path / "m.h5", "w") as file:
        file["run/a"], file["run/b"] = movie, movie[::-1]
    np.savez(tmp_path / "m.npz", a=movie, b=movie[::-1])
    for source, name in ((tmp_path / "m.h5", "/run/b"), (tmp_path / "m.npz", "b")):
        np.testing.assert_array_equal(list(open_frames(source, dataset=name)), movie[::-1])
        np.testing.assert_array_equal(list(open_frames(f"{source}::{name}")), movie[::-1])


def test_few_bad_pixels_are_masked(tmp_path):
    movie = np.random.default_rng(3).normal(size=(T, ROWS, COLS)).astype(np.float32)
    movie[1, 2, 3], movie[1, 0, 0], movie[4, 1, 1] = np.nan, np.inf, -np.inf
    np.save(tmp_path / "m.npy", movie)
    frames = list(open_frames(tmp_path / "m.npy"))
    np.testing.assert_array_equal(frames, np.where(np.isfinite(movie), movie, np.nan))
    assert np.isinf(np.load(tmp_path / "m.npy")).sum() == 2


def test_time_is_the_frame_number_unless_there_is_a_rate(tmp_path, movie):
    np.save(tmp_path / "m.npy", movie)
    assert list(open_frames(tmp_path / "m.npy", start=2).times_s())[:2] == [2.0, 3.0]
    assert list(open_frames(tmp_path / "m.npy", start=2, rate_hz=4).times_s())[:2] == [0.5, 0.75]


def save_gif(path, movie, durations):
    first, *others = (Image.fromarray(frame) for frame in movie)
    first.save(path, save_all=True, append_images=others, duration=durations, optimize=False)


def test_gif_frames_and_rate(tmp_path, movie):
    movie = (movie >> 8).astype(np.uint8)
    save_gif(tmp_path / "m.gif", movie, 40)
    source = open_frames(tmp_path / "m.gif")
    assert (source.shape, source.length, source.rate_hz) == ((ROWS, COLS), T, 25.0)
    np.testing.assert_array_equal(list(source), movie)
    np.testing.assert_array_equal(list(open_frames(tmp_path / "m.gif", start=2, stop=4)), movie[2:4])
    save_gif(tmp_path / "v.gif", movie, [40, 40, 80, 40, 40])
    assert open_frames(tmp_path / "v.gif").rate_hz is None
    save_gif(tmp_path / "z.gif", movie, 0)
    assert open_frames(tmp_path / "z.gif").rate_hz is None


def test_a_gif_that_is_cut_short_gives_its_whole_frames_first(tmp_path, movie):
    movie = (movie >> 8).astype(np.uint8)
    save_gif(tmp_path / "m.gif", movie, 40)
    whole = (tmp_path / "m.gif").read_bytes()
    for cut in (1, 20):
        (tmp_path / "cut.gif").write_bytes(whole[:-cut])
        frames = iter(open_frames(tmp_path / "cut.gif"))
        kept = T if cut == 1 else T - 1
        np.testing.assert_array_equal([next(frames) for _ in range(kept)], movie[:kept])
        with pytest.raises(DataError, match=rf"cut\.gif, frame {kept}: the file is cut short"):
            next(frames)
        assert len(list(open_frames(tmp_path / "cut.gif", stop=kept))) == kept


def test_memory_stays_at_a_few_frames(tmp_path):
    frame = (256, 256)
    movie = np.zeros((200, *frame), np.uint16)
    movie[:, 0, 0] = 1
    np.save(tmp_path / "m.npy", movie)
    np.savez_compressed(tmp_path / "m.npz", movie)
    tifffile.imwrite(tmp_path / "m.tif", movie)
    with h5py.File(tmp_path / "m.h5", "w") as file:
        file.create_dataset("m", data=movie, chunks=(1, *frame), compression="gzip")
    whole = movie.nbytes
    del movie
    for name in ("m.npy", "m.npz", "m.tif", "m.h5"):
        source = open_frames(tmp_path / name)
        tracemalloc.start()
        assert sum(1 for _ in source) == 200
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 6 * 8 * frame[0] * frame[1] < whole / 8, name


def test_a_later_broken_frame_does_not_stop_the_first_ones(tmp_path, movie):
    for k, frame in enumerate(movie):
        Image.fromarray(frame).save(tmp_path / f"{k}.png")
    (tmp_path / "3.png").write_bytes(b"no picture")
    frames = iter(open_frames(tmp_path))
    np.testing.assert_array_equal([next(frames) for _ in range(3)], movie[:3])
    with pytest.raises(DataError, match=r"3\.png \(frame 3\): cannot be read"):
        next(frames)


def test_an_iteration_left_early_closes_its_file(tmp_path, movie):
    """An open file would fail here as a ResourceWarning, and on Windows as a refused deletion."""
    for save, name in FORMS:
        save(tmp_path / name, movie)
        frames = iter(open_frames(tmp_path / name))
        next(frames)
        frames.close()
        del frames
        (tmp_path / name).unlink()


def test_an_interrupt_passes_through(tmp_path, movie, monkeypatch):
    np.save(tmp_path / "m.npy", movie)
    source = open_frames(tmp_path / "m.npy")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("elusive.io.frames._grey", interrupted)
    with pytest.raises(KeyboardInterrupt):
        next(iter(source))


def test_an_archive_is_streamed_up_to_its_damaged_end(tmp_path):
    movie = np.random.default_rng(7).normal(size=(T, 64, 64))
    np.savez(tmp_path / "m.npz", movie)
    data = bytearray((tmp_path / "m.npz").read_bytes())
    with zipfile.ZipFile(tmp_path / "m.npz") as archive:
        end = archive.start_dir
    data[end - 5] ^= 0xFF
    (tmp_path / "m.npz").write_bytes(data)
    frames = iter(open_frames(tmp_path / "m.npz"))
    np.testing.assert_array_equal([next(frames) for _ in range(T - 1)], movie[:-1])
    with pytest.raises(DataError, match=r"frame 4: cannot be read .*CRC"):
        next(frames)


def test_times_that_a_file_holds_are_its_own(tmp_path, movie):
    times = np.cumsum(np.linspace(0.1, 0.3, len(movie)))
    np.savez(tmp_path / "m.npz", frames=movie, time_s=times)
    with h5py.File(tmp_path / "m.nc", "w") as file:
        file["camera/frames"] = movie
        file["camera/time"] = times
        file["camera/time"].attrs["units"] = "seconds since 2026-01-01"
    for source in (open_frames(tmp_path / "m.npz"), open_frames(tmp_path / "m.nc")):
        assert source.timed
        np.testing.assert_array_equal(list(source.times_s()), times)
        assert source.interval_s == np.median(np.diff(times))
    assert list(open_frames(tmp_path / "m.npz", start=2, stop=4).times_s()) == times[2:4].tolist()
    with pytest.raises(DataError, match=r"m\.npz: tells the frames' times; leave rate_hz=5 out"):
        open_frames(tmp_path / "m.npz", rate_hz=5)
    np.savez(tmp_path / "bad.npz", frames=movie, time_s=times[::-1])
    with pytest.raises(DataError, match=r"'time_s': the times are not \d+ finite, increasing seconds"):
        open_frames(tmp_path / "bad.npz")
    tifffile.imwrite(tmp_path / "m.tif", movie[:, :, :].astype(np.uint8), imagej=True, metadata={"finterval": 0.2})
    assert open_frames(tmp_path / "m.tif").rate_hz == 5


def test_a_gif_whose_delays_vary_holds_times(tmp_path):
    pictures = [Image.fromarray(np.random.default_rng(k).integers(0, 255, (8, 8), np.uint8)) for k in range(3)]
    pictures[0].save(tmp_path / "m.gif", save_all=True, append_images=pictures[1:], duration=[100, 300, 200])
    source = open_frames(tmp_path / "m.gif")
    assert source.rate_hz is None
    np.testing.assert_allclose(list(source.times_s()), [0.0, 0.1, 0.4])


# -------------------------------------------------------------------------------------------------- times beside


def stamped(folder, seconds, *, pages=False):
    """TIFF frames, a page or a file each, with the second at which each was taken."""
    folder.mkdir(exist_ok=True)
    rng = np.random.default_rng(0)
    with contextlib.ExitStack() as stack:
        if pages:
            writer = stack.enter_context(tifffile.TiffWriter(folder / "all.tif"))
        for k, second in enumerate(seconds):
            if not pages:
                writer = stack.enter_context(tifffile.TiffWriter(folder / f"f{k}.tif"))
            stamp = None if second is None else f"2026:03:01 12:{second // 60:02d}:{second % 60:02d}"
            writer.write(rng.integers(0, 9, (6, 8), dtype=np.uint8), datetime=stamp, metadata=None)
    return folder / "all.tif" if pages else folder


@pytest.mark.parametrize("pages", [True, False])
def test_tiff_tags_tell_times(tmp_path, pages):
    source = open_frames(stamped(tmp_path / "a", [58, 60, 65], pages=pages))
    assert list(source.times_s()) == [0.0, 2.0, 7.0]
    assert source.timed
    assert list(open_frames(stamped(tmp_path / "a", [58, 60, 65], pages=pages), start=1).times_s()) == [2.0, 7.0]
    assert list(open_frames(stamped(tmp_path / "a", [58, 60, 65], pages=pages), rate_hz=4).times_s()) == [0, 0.25, 0.5]
    for seconds in ([5, 5, 6], [5, None, 7]):  # a second is too coarse for them, or is not there
        assert not open_frames(stamped(tmp_path / "a", seconds, pages=pages)).timed
    with pytest.raises(DataError, match="was taken at 2026-03-01 12:00:06, before the frame that it follows"):
        open_frames(stamped(tmp_path / "a", [5, 8, 6], pages=pages))


def test_a_table_tells_times(tmp_path):
    folder = stamped(tmp_path / "a", [1, 2, 3])
    (folder / "times.csv").write_text("file,time_s\nf0.tif,0.5\nf1.tif,0.75\nf2.tif,2\n")
    source = open_frames(folder)
    assert (list(source.times_s()), source.interval_s, len(list(source))) == ([0.5, 0.75, 2.0], 0.75, 3)
    other = tmp_path / "other.csv"
    other.write_text("time_s\n10\n20\n40\n")
    assert list(open_frames(folder, times=other, start=1).times_s()) == [20.0, 40.0]
    with pytest.raises(DataError, match=r"times\.csv: tells the frames' times; leave rate_hz=4 out"):
        open_frames(folder, rate_hz=4.0)
    for text, sentence in (
        ("time_s\n10\n20\n", r"other\.csv: has 2 times for 3 frames; give one a frame"),
        ("time_s\n10\n20\n30\n40\n", r"other\.csv: has 4 times for 3 frames"),
        ("time_s\n10\n20\n15\n", r"other\.csv, line 4: 15 s comes after 20 s; frames are in the order of time"),
        ("time_s\n10\n10\n15\n", "line 3: 10 s comes after 10 s"),
        ("time_s\n10\nsoon\n15\n", "line 3, column time_s: 'soon' is no number"),
        ("when\n10\n", "line 1: the columns are 'when'; name them time_s"),
        ("", "is empty; write time_s"),
    ):
        other.write_text(text)
        with pytest.raises(DataError, match=sentence):
            open_frames(folder, times=other)
    with pytest.raises(DataError, match=r"gone\.csv: cannot be read"):
        open_frames(folder, times=tmp_path / "gone.csv")
