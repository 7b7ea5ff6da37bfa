"""Videos: lossless ones read back exactly at their depth, broken ones are refused."""

import builtins
import subprocess
from itertools import islice

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io import open_frames

imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
T, ROWS, COLS = 12, 18, 24


def encode(path, movie, pixels, *options, rate=10):
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-f", "rawvideo", "-pix_fmt", pixels]
    size = f"{movie.shape[2]}x{movie.shape[1]}"
    command += ["-s", size, "-r", str(rate), "-i", "-", *options, str(path)]
    subprocess.run(command, input=movie.tobytes(), check=True)


def noise(dtype, *shape):
    return np.random.default_rng(5).integers(0, np.iinfo(dtype).max, (T, ROWS, COLS, *shape), dtype=dtype)


@pytest.mark.parametrize(("dtype", "pixels"), [(np.uint8, "gray"), (np.uint16, "gray16le")])
def test_lossless_video_reads_back_exactly(tmp_path, dtype, pixels):
    movie = noise(dtype)
    encode(tmp_path / "m.mkv", movie, pixels, "-c:v", "ffv1", rate=12.5)
    source = open_frames(tmp_path / "m.mkv")
    assert (source.shape, source.length, source.rate_hz) == ((ROWS, COLS), None, 12.5)
    np.testing.assert_array_equal(list(source), movie)
    np.testing.assert_array_equal(list(source), movie)
    part = open_frames(tmp_path / "m.mkv", start=3, stop=7)
    np.testing.assert_array_equal(list(part), movie[3:7])
    assert list(islice(part.times_s(), 2)) == [3 / 12.5, 4 / 12.5]


def test_colour_becomes_luma(tmp_path):
    colour = noise(np.uint8, 3)
    encode(tmp_path / "m.mkv", colour, "rgb24", "-c:v", "ffv1", "-pix_fmt", "bgr0")
    luma = 0.299 * colour[..., 0] + 0.587 * colour[..., 1] + 0.114 * colour[..., 2]
    np.testing.assert_allclose(list(open_frames(tmp_path / "m.mkv")), luma, atol=1.5)


def test_lossy_video_is_close(tmp_path):
    rows, cols = np.mgrid[:ROWS, :COLS]
    movie = np.stack([20 + 200 * np.exp(-((rows - 9) ** 2 + (cols - 4 - k) ** 2) / 30) for k in range(T)])
    encode(tmp_path / "m.mp4", movie.astype(np.uint8), "gray", "-pix_fmt", "yuv420p")
    frames = np.array(list(open_frames(tmp_path / "m.mp4")))
    assert frames.shape == movie.shape
    assert np.abs(frames - movie).mean() < 4
    assert [np.argmax(frame.max(axis=0)) for frame in frames[2:-2]] == pytest.approx(range(6, T + 2), abs=1)


def test_leaving_early_stops_the_decoder(tmp_path):
    encode(tmp_path / "m.mkv", noise(np.uint8), "gray", "-c:v", "ffv1")
    frames = iter(open_frames(tmp_path / "m.mkv"))
    next(frames)
    frames.close()


def test_truncated_video_gives_its_whole_frames_then_says_so(tmp_path):
    movie = noise(np.uint8)
    encode(tmp_path / "m.mkv", movie, "gray", "-c:v", "ffv1")
    data = (tmp_path / "m.mkv").read_bytes()
    (tmp_path / "cut.mkv").write_bytes(data[: len(data) // 2])
    frames, kept = iter(open_frames(tmp_path / "cut.mkv")), []
    with pytest.raises(DataError, match=r"cut\.mkv: breaks off after \d+ frames \(.*\); pass stop=\d+"):
        kept.extend(frames)
    assert 0 < len(kept) < T
    np.testing.assert_array_equal(kept, movie[: len(kept)])
    assert len(list(open_frames(tmp_path / "cut.mkv", stop=len(kept)))) == len(kept)


@pytest.mark.parametrize("content", [b"", b"rubbish" * 1000])
def test_no_video_at_all(tmp_path, content):
    (tmp_path / "m.mp4").write_bytes(content)
    with pytest.raises(DataError, match=r"m\.mp4: holds no video that can be read \(.*\); check that it plays"):
        open_frames(tmp_path / "m.mp4")


def test_sound_without_pictures(tmp_path):
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-f", "lavfi", "-i", "sine=duration=0.2"]
    subprocess.run([*command, str(tmp_path / "m.mkv")], check=True)
    with pytest.raises(DataError, match=r"holds no video"):
        open_frames(tmp_path / "m.mkv")


def test_start_past_the_end(tmp_path):
    encode(tmp_path / "m.mkv", noise(np.uint8), "gray", "-c:v", "ffv1")
    with pytest.raises(DataError, match=r"holds no frame from number 50 on"):
        list(open_frames(tmp_path / "m.mkv", start=50))


def test_black_first_frame(tmp_path):
    movie = noise(np.uint8)
    movie[0] = 0
    encode(tmp_path / "m.mkv", movie, "gray", "-c:v", "ffv1")
    first, *rest = open_frames(tmp_path / "m.mkv")
    assert first is None
    np.testing.assert_array_equal(rest, movie[1:])


def test_a_playlist_in_disguise_reaches_no_network(tmp_path):
    (tmp_path / "m.mkv").write_text("#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nhttp://127.0.0.1:9/a.ts\n")
    with pytest.raises(DataError, match=r"holds no video"):
        open_frames(tmp_path / "m.mkv")


def test_without_the_extra_the_sentence_says_how_to_install_it(tmp_path, monkeypatch):
    (tmp_path / "m.mp4").write_bytes(b"x")
    importing = builtins.__import__

    def missing(name, *arguments, **named):
        if name == "imageio_ffmpeg":
            raise ImportError(name)
        return importing(name, *arguments, **named)

    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(DataError, match=r"reading a video needs ffmpeg; .*pip install 'elusive\[video\]'"):
        open_frames(tmp_path / "m.mp4")
