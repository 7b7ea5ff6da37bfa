"""A file or folder appears whole or not at all."""

import os
import threading

import pytest

from elusive.errors import DataError
from elusive.io import atomic_folder, atomic_path


def tree(folder):
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def test_a_file_takes_its_name_at_the_end(tmp_path):
    with atomic_path(tmp_path / "a.csv") as temporary:
        temporary.write_text("new")
        assert temporary.suffix == ".csv"
        assert not (tmp_path / "a.csv").exists()
    assert tree(tmp_path) == {"a.csv": "new"}


def write_then_fail(block, fault, name=""):
    with block as temporary:
        (temporary / name if name else temporary).write_text("half")
        raise fault


@pytest.mark.parametrize("fault", [KeyboardInterrupt, SystemExit, ValueError, MemoryError])
def test_a_failure_leaves_the_earlier_file(tmp_path, fault):
    (tmp_path / "a.csv").write_text("old")
    with pytest.raises(fault):
        write_then_fail(atomic_path(tmp_path / "a.csv"), fault)
    assert tree(tmp_path) == {"a.csv": "old"}


def test_refusals_of_the_system_are_sentences(tmp_path):
    with pytest.raises(DataError, match=r"a\.csv: cannot be written \(No space left on device\)"):
        write_then_fail(atomic_path(tmp_path / "a.csv"), OSError(28, os.strerror(28)))
    with pytest.raises(DataError, match="is a folder; give the name of a file"), atomic_path(tmp_path):
        pass
    with pytest.raises(DataError, match="there is no folder"), atomic_path(tmp_path / "no" / "a.csv"):
        pass
    with pytest.raises(DataError, match="cannot be written"), atomic_path("x" * 5000):
        pass
    assert tree(tmp_path) == {}


def test_permissions_are_those_of_a_plain_file(tmp_path):
    (tmp_path / "plain").write_text("")
    with atomic_path(tmp_path / "ours") as temporary:
        temporary.write_text("")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode
    (tmp_path / "plain_folder").mkdir()
    with atomic_folder(tmp_path / "our_folder"):
        pass
    assert (tmp_path / "our_folder").stat().st_mode == (tmp_path / "plain_folder").stat().st_mode


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    with atomic_path(tmp_path / "link") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_written_to_and_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    got = []
    reader = threading.Thread(target=lambda: got.append((tmp_path / "pipe").read_text()))
    reader.start()
    with atomic_path(tmp_path / "pipe") as temporary:
        temporary.write_text("through")
    reader.join()
    assert got == ["through"]
    assert (tmp_path / "pipe").is_fifo()


def test_a_new_folder_appears_at_the_end(tmp_path):
    out = tmp_path / "deep" / "out"
    with atomic_folder(out) as work:
        (work / "sub").mkdir()
        (work / "sub" / "a").write_text("1")
        assert not out.exists()
    assert tree(tmp_path) == {"deep/out/sub/a": "1"}


@pytest.mark.parametrize("fault", [KeyboardInterrupt, ValueError, OSError])
def test_a_failure_leaves_no_folder(tmp_path, fault):
    with pytest.raises(fault):
        write_then_fail(atomic_folder(tmp_path / "deep" / "out"), fault, "a")
    assert list(tmp_path.iterdir()) == []


def test_an_existing_folder_keeps_what_is_not_ours(tmp_path):
    (tmp_path / "sub").mkdir()
    for name in ("a", "kept", "sub/kept"):
        (tmp_path / name).write_text("old")
    with atomic_folder(tmp_path) as work:
        (work / "sub").mkdir()
        for name in ("a", "b", "sub/c"):
            (work / name).write_text("new")
    assert tree(tmp_path) == {"a": "new", "b": "new", "sub/c": "new", "kept": "old", "sub/kept": "old"}
    with pytest.raises(KeyboardInterrupt):
        write_then_fail(atomic_folder(tmp_path), KeyboardInterrupt, "a")
    assert tree(tmp_path)["a"] == "new"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b", "kept", "sub"]


def test_what_is_in_the_way_is_named_before_anything_moves(tmp_path):
    (tmp_path / "out" / "z").mkdir(parents=True)
    blocked = atomic_folder(tmp_path / "out")
    work = blocked.__enter__()
    for name in ("a", "z"):
        (work / name).write_text("new")
    with pytest.raises(DataError, match=r"z: is in the way"):
        blocked.__exit__(None, None, None)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["z"]
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match=r"is a file; give the name of a folder"), atomic_folder(tmp_path / "file"):
        pass
    with pytest.raises(DataError, match=r"cannot be written"), atomic_folder(tmp_path / "file" / "out"):
        pass


def test_the_current_folder_will_do(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with atomic_folder(".") as work:
        (work / "a").write_text("1")
    assert tree(tmp_path) == {"a": "1"}


def write_then_fail_in(out, fault):
    with atomic_folder(out) as folder, atomic_path(folder / "a.csv"):
        raise fault


def test_a_refusal_names_the_folder_that_was_asked_for(tmp_path):
    for existed in (False, True):
        with pytest.raises(DataError, match=rf"^{tmp_path}/out/a\.csv: cannot be written \(File too large\)"):
            write_then_fail_in(tmp_path / "out", OSError(27, os.strerror(27)))
        assert list(tmp_path.iterdir()) == [tmp_path / "out"][: int(existed)]
        (tmp_path / "out").mkdir(exist_ok=True)
