"""What cannot be used is refused with a sentence: what, where, and what to do."""

import os
import pickle
import struct
import zipfile
import zlib
from itertools import islice

import h5py
import numpy as np
import pytest
import tifffile
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from elusive.errors import DataError
from elusive.io import open_frames

GOOD = np.random.default_rng(4).integers(0, 65536, (5, 8, 10), dtype=np.uint16)


def refused(match, source, **arguments):
    with pytest.raises(DataError, match=match):
        list(open_frames(source, **arguments))


def save_folder(folder, frames, suffix=".png"):
    folder.mkdir(exist_ok=True)
    for k, frame in enumerate(frames):
        Image.fromarray(frame).save(folder / f"{k}{suffix}")
    return folder


def test_missing_path_and_glob(tmp_path):
    refused(r"gone\.npy: there is no such file", tmp_path / "gone.npy")
    refused(r"matches no file", f"{tmp_path}/*.png")
    refused(r"cannot be opened \(File name too long\)|there is no such file", "x" * 5000)  # Python 3.11, 3.14


def test_empty_folder(tmp_path):
    refused(r"holds no image \(of \.png.*check the folder", tmp_path)
    (tmp_path / "frames.npy").write_bytes(b"")
    refused(r"holds frames\.npy: give a recording's own name", tmp_path)
    (tmp_path / "a.png").write_bytes(b"")
    refused(r"holds no image that matches '\*\.tif'", tmp_path, pattern="*.tif")
    refused(r"a\.png: cannot be read", tmp_path)


def test_folder_of_mixed_kinds(tmp_path):
    save_folder(tmp_path, GOOD)
    save_folder(tmp_path, GOOD, ".tif")
    refused(r"mixes \.png and \.tif images; choose with pattern='\*\.png'", tmp_path)
    assert open_frames(tmp_path, pattern="*.tif").length == 5


def test_unsupported_kinds(tmp_path):
    (tmp_path / "a.docx").write_bytes(b"x")
    refused(r"type \.docx are not read; give one of \.npy, \.npz", tmp_path / "a.docx")
    refused(r"a\.docx: is no image", f"{tmp_path}/*.docx")
    (tmp_path / "bare").write_bytes(b"x")
    refused(r"type \(none\) are not read", tmp_path / "bare")
    save_folder(tmp_path / "f", GOOD)
    refused(r"0\.png: is one image, not a sequence; give its folder", tmp_path / "f" / "0.png")


def test_arguments_that_do_not_fit(tmp_path):
    np.save(tmp_path / "m.npy", GOOD)
    path = tmp_path / "m.npy"
    refused(r"start=-1, stop=None: choose", path, start=-1)
    refused(r"start=2, stop=2: choose", path, start=2, stop=2)
    refused(r"has 5 frames, numbered from 0; start=5 is past", path, start=5)
    refused(r"rate_hz=0: must be a positive", path, rate_hz=0)
    refused(r"rate_hz=nan", path, rate_hz=float("nan"))
    refused(r"dataset='a' names an array in", path, dataset="a")
    refused(r"pattern='\*' chooses files of a folder", path, pattern="*")
    assert open_frames(path, stop=99).length == 5


def test_truncated_png(tmp_path):
    file = save_folder(tmp_path, GOOD) / "2.png"
    file.write_bytes(file.read_bytes()[:-40])
    refused(r"2\.png \(frame 2\): cannot be read .*; copy or export it again", tmp_path)


def test_png_with_a_broken_checksum(tmp_path):
    file = save_folder(tmp_path, GOOD) / "1.png"
    data = bytearray(file.read_bytes())
    data[-13] ^= 1  # the last byte of the checksum of the pixels: they decode all the same
    file.write_bytes(data)
    assert np.array_equal(np.asarray(Image.open(file)), GOOD[1])
    refused(r"1\.png \(frame 1\): cannot be read \(broken PNG file .*IDAT", tmp_path)


def png(width, height, depth, colour, data=b""):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


def test_16_bit_colour_png_is_not_silently_cut_to_8_bits(tmp_path):
    (tmp_path / "0.png").write_bytes(png(2, 2, 16, 2, (b"\0" + bytes(range(12))) * 2))
    refused(r"is a 16-bit colour PNG, of which only 8 bits", tmp_path)


@pytest.mark.parametrize("side", [9_600, 30_000])  # Pillow only warns of the first, and raises for the second
def test_decompression_bomb(tmp_path, side):
    save_folder(tmp_path, GOOD[:1])
    (tmp_path / "1.png").write_bytes(png(side, side, 8, 0))
    refused(r"1\.png \(frame 1\): cannot be read \(Image size .*decompression bomb", tmp_path)
    refused(r"1\.png: cannot be read \(Image size", f"{tmp_path}/1*.png")


def test_frames_too_large_to_read(tmp_path):
    with h5py.File(tmp_path / "m.h5", "w") as file:
        file.create_dataset("m", (3, 100_000, 100_000), "u1", chunks=(1, 100, 100))
    refused(r"100000 x 100000 pixels .* more than the 67108864", tmp_path / "m.h5")
    tifffile.imwrite(tmp_path / "m.tif", shape=(9000, 9000), dtype=np.uint8, tile=(256, 256), compression="zlib",
                     data=(b"" for _ in range(36 * 36)))  # fmt: skip
    refused(r"9000 x 9000 pixels", tmp_path / "m.tif")


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_frames_of_different_size(tmp_path, suffix):
    save_folder(tmp_path, [*GOOD[:2], GOOD[2, :, :7].copy()], suffix)
    refused(rf"2\{suffix} \(frame 2\): is 8 x 7 pixels .* the first frame is 8 x 10", tmp_path)


def test_pages_and_planes_of_different_size(tmp_path):
    with tifffile.TiffWriter(tmp_path / "m.tif") as tif:
        tif.write(GOOD[0])
        tif.write(GOOD[1, :5])
    refused(r"m\.tif, page 1: is 5 x 10 pixels", tmp_path / "m.tif")
    np.savez(tmp_path / "m.npz", GOOD[0], GOOD[1, :5])
    refused(r"'arr_1' \(frame 1\): is 5 x 10 pixels", tmp_path / "m.npz")


def test_mostly_bad_pixels(tmp_path):
    movie = GOOD.astype(float)
    movie[1, :4] = np.nan
    np.save(tmp_path / "half.npy", movie)
    assert np.isnan(list(open_frames(tmp_path / "half.npy"))[1]).sum() == 40
    movie[1, 5, 7] = np.inf
    np.save(tmp_path / "more.npy", movie)
    assert [frame is None for frame in open_frames(tmp_path / "more.npy")] == [k == 1 for k in range(len(movie))]
    movie[1, 5, 7] = 1e300  # whose square is not finite
    np.save(tmp_path / "more.npy", movie)
    assert next(islice(open_frames(tmp_path / "more.npy"), 1, None)) is None
    np.save(tmp_path / "all.npy", np.full((2, 3, 5), np.nan))
    refused(
        r"frame 0: 15 of 15 pixels are NaN or infinite, the first at row 0, column 0; no other of the 2 frames shows",
        tmp_path / "all.npy",
    )


def test_frames_that_show_nothing_are_missing(tmp_path):
    movie = GOOD.copy()
    movie[0], movie[4] = 0, 7
    np.save(tmp_path / "m.npy", movie)
    found = list(open_frames(tmp_path / "m.npy"))
    assert [frame is None for frame in found] == [k in (0, 4) for k in range(len(movie))]
    np.testing.assert_array_equal(found[1:4], movie[1:4])
    masked = np.full((1, 4, 5), 2.0)
    masked[0, 0, 0] = np.nan
    np.save(tmp_path / "n.npy", masked)
    refused(r"frame 0: all its pixels are 2,", tmp_path / "n.npy")


ARRAYS = [
    (GOOD[0], r"holds one image, shape \(8, 10\)"),
    (np.zeros((8, 10, 3)), r"holds one image, shape \(8, 10, 3\)"),
    (np.zeros(5), r"has 1 dimensions"),
    (np.zeros((2, 2, 2, 2, 2)), r"has 5 dimensions"),
    (np.zeros((2, 5, 6, 7)), r"has 4 dimensions"),
    (np.zeros((0, 5, 6)), r"holds no frame"),
    (np.zeros((2, 0, 6)), r"0 x 6 pixels .* nothing in them"),
    (np.zeros((2, 5, 6), complex), r"holds complex128 values, not real numbers"),
    (np.zeros((2, 5, 6), "U3"), r"holds <U3 values"),
    (np.zeros((2, 5, 6), "M8[s]"), r"holds datetime64\[s\] values"),
    (np.zeros((2, 5, 6), [("a", float)]), r"not real numbers"),
]


@pytest.mark.parametrize(("array", "match"), ARRAYS)
def test_arrays_that_are_no_sequence(tmp_path, array, match):
    np.save(tmp_path / "m.npy", array)
    refused(match, tmp_path / "m.npy")
    np.savez(tmp_path / "m.npz", m=array)
    refused(match, tmp_path / "m.npz", dataset="m")
    if array.dtype.kind not in "UM":
        with h5py.File(tmp_path / "m.h5", "w") as file:
            file["m"] = array
        refused(match, tmp_path / "m.h5", dataset="m")


class Trap:
    def __reduce__(self):
        return os.mkdir, ("sprung",)


def test_pickles_are_never_opened(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    objects = np.empty((1, 2, 2), object)
    objects[:] = Trap()
    np.save("m.npy", objects)
    np.savez("m.npz", m=objects)
    with open("p.npy", "wb") as file:
        pickle.dump(Trap(), file)
    refused(r"m\.npy: cannot be read .*without pickled objects", "m.npy")
    refused(r"holds object values", "m.npz")
    refused(r"p\.npy: cannot be read", "p.npy")
    assert not os.path.exists("sprung")


@pytest.mark.parametrize("name", ["m.npy", "m.npz", "m.tif", "m.h5", "m.gif"])
def test_files_of_rubbish_or_nothing(tmp_path, name):
    for content in (b"", b"rubbish" * 100):
        (tmp_path / name).write_bytes(content)
        refused(rf"{name}: cannot be read", tmp_path / name)


def test_truncated_stacks(tmp_path):
    np.save(tmp_path / "m.npy", GOOD)
    np.savez(tmp_path / "m.npz", GOOD)
    tifffile.imwrite(tmp_path / "m.tif", GOOD)
    tifffile.imwrite(tmp_path / "d.tif", GOOD, compression="zlib", metadata=None)
    with h5py.File(tmp_path / "m.h5", "w") as file:
        file["m"] = GOOD
    for name in ("m.npy", "m.npz", "m.tif", "d.tif", "m.h5"):
        whole = (tmp_path / name).read_bytes()
        for part in (0.3, 0.6, 0.9):
            (tmp_path / f"cut_{name}").write_bytes(whole[: int(part * len(whole))])
            refused(f"cut_{name}", tmp_path / f"cut_{name}")


def test_a_tiff_whose_chain_of_pages_is_cut_is_not_read_as_shorter(tmp_path, caplog):
    with tifffile.TiffWriter(tmp_path / "m.tif") as tif:
        for frame in GOOD:
            tif.write(frame, contiguous=False, metadata=None)
    with tifffile.TiffFile(tmp_path / "m.tif") as tif:
        second = tif.pages[1].offset
    (tmp_path / "m.tif").write_bytes((tmp_path / "m.tif").read_bytes()[:second])
    refused(r"is cut short after page 0", tmp_path / "m.tif")


def test_tiffs_that_are_no_grey_sequence(tmp_path):
    tifffile.imwrite(tmp_path / "z.tif", np.zeros((3, 2, 8, 10), np.uint16), imagej=True, metadata={"axes": "TZYX"})
    refused(r"several axes beside rows and columns \(T 3, Z 2\)", tmp_path / "z.tif")
    Image.fromarray((GOOD[0] >> 8).astype(np.uint8)).convert("P").save(tmp_path / "p.tif")
    refused(r"page 0: its colours are coded as PALETTE", tmp_path / "p.tif")
    tifffile.imwrite(tmp_path / "c.tif", GOOD + 1j)
    refused(r"page 0: holds complex128 values", tmp_path / "c.tif")
    folder = tmp_path / "folder"
    folder.mkdir()
    tifffile.imwrite(folder / "a.tif", GOOD)
    refused(r"a\.tif \(frame 0\): holds 5 pages; open this file alone", folder)


def test_hdf5_names(tmp_path):
    with h5py.File(tmp_path / "m.h5", "w") as file:
        file["a"], file["g/b"], file["flat"] = GOOD, GOOD, np.arange(3)
        file["gone"] = h5py.SoftLink("/nowhere")
        file["void"] = h5py.Empty("f")
    path = tmp_path / "m.h5"
    refused(r"holds several 3-D arrays \(/a, /g/b\); say which with dataset=", path)
    for name in ("/c", "gone", "g"):
        refused(rf"holds no dataset '{name}'; its 3-D datasets are: /a, /g/b", path, dataset=name)
    refused(r"m\.h5::flat: has 1 dimensions", path, dataset="flat")
    refused(r"m\.h5::void: has 0 dimensions", f"{path}::void")
    with h5py.File(tmp_path / "n.h5", "w") as file:
        file["flat"] = np.arange(3)
    refused(r"holds no array \(T, rows, cols\)", tmp_path / "n.h5")


def test_npz_names(tmp_path):
    np.savez(tmp_path / "m.npz", a=GOOD, b=GOOD)
    refused(r"holds several 3-D arrays \(a, b\)", tmp_path / "m.npz")
    refused(r"holds no array 'c'; it holds a, b", tmp_path / "m.npz", dataset="c")
    np.savez(tmp_path / "n.npz", a=np.arange(3))
    refused(r"holds no array \(T, rows, cols\)", tmp_path / "n.npz")


def test_an_archive_of_something_else(tmp_path):
    np.savez(tmp_path / "m.npz", GOOD)
    with zipfile.ZipFile(tmp_path / "m.npz", "a") as archive:
        archive.writestr("notes.txt", "hello")
    refused(r"holds 'notes\.txt', which is no array", tmp_path / "m.npz")


def test_an_lzw_tiff_that_pillow_would_cut_to_8_bits(tmp_path):
    colour = np.random.default_rng(8).integers(0, 256, (8, 10, 3), dtype=np.uint8)
    Image.fromarray(colour).save(tmp_path / "m.tif", compression="tiff_lzw")
    assert next(iter(open_frames(tmp_path / "m.tif"))).shape == (8, 10)
    with tifffile.TiffFile(tmp_path / "m.tif", mode="r+") as tif:
        tif.pages[0].tags["BitsPerSample"].overwrite((16, 16, 16))
    refused(r"page 0: its LZW compression needs the package imagecodecs", tmp_path / "m.tif")


def test_an_animated_png_in_a_folder(tmp_path):
    first, *others = (Image.fromarray((frame >> 8).astype(np.uint8)) for frame in GOOD)
    first.save(tmp_path / "0.png", save_all=True, append_images=others)
    refused(r"0\.png \(frame 0\): holds 5 pictures", tmp_path)


def test_gif_without_a_frame(tmp_path):
    (tmp_path / "m.gif").write_bytes(b"GIF89a" + struct.pack("<HHBBB", 4, 4, 0, 0, 0) + b";")
    refused(r"m\.gif: (cannot be read|holds no frame)", tmp_path / "m.gif")


WHOLE = {}


def whole(kind, folder):
    if kind not in WHOLE:
        path = folder / f"whole.{kind}"
        if kind == "gif":
            first, *others = (Image.fromarray((frame >> 8).astype(np.uint8)) for frame in GOOD)
            first.save(path, save_all=True, append_images=others, duration=40)
        elif kind == "tif":
            tifffile.imwrite(path, GOOD, compression="zlib")
        elif kind == "npz":
            np.savez_compressed(path, GOOD)
        else:
            np.save(path, GOOD)
        WHOLE[kind] = path.read_bytes()
    return WHOLE[kind]


@pytest.mark.parametrize("kind", ["gif", "tif", "npz", "npy"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damage_gives_a_sentence_or_frames_and_nothing_else(tmp_path, kind, data):
    content = bytearray(whole(kind, tmp_path))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / f"damaged.{kind}"
    path.write_bytes(content)
    said = str(path)
    try:
        for frame in open_frames(path):
            assert frame is None or frame.ndim == 2  # one that shows nothing any more is passed over
    except DataError as error:
        said = str(error)
    assert str(path) in said
