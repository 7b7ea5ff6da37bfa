"""A radio network's log is looked at with the list of its nodes before it is tracked."""

from __future__ import annotations

import pytest

from elusive.checks import broken
from elusive.errors import DataError
from elusive.systems.links.look import look
from tests.walked_room import write_room


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return write_room(tmp_path_factory.mktemp("room"))


def listed(room, change):
    """Write the list of nodes changed, beside the log."""
    header, *lines = (room / "nodes.csv").read_text().splitlines()
    (room / "others.csv").write_text("\n".join([header, *change(lines)]) + "\n")
    return {"nodes": "others.csv"}


def test_a_log_alone_is_its_columns(room):
    looked = look(room / "log.csv", {})
    assert "levels of" in looked.said
    assert looked.findings == ()


def test_its_own_nodes_are_right(room):
    assert not broken(look(room / "log.csv", {"nodes": "nodes.csv"}).findings)


def test_more_nodes_than_the_log_has_are_said(room):
    given = listed(room, lambda lines: [*lines, "far,30,30", "away,35,30"])
    (one,) = broken(look(room / "log.csv", given).findings)
    many = len((room / "nodes.csv").read_text().splitlines()) + 1
    assert one.name == "links.silent"
    assert f"No reading is of 2 of the {many} nodes (far, away)" in one.sentence
    assert not one.grave


def test_fewer_nodes_than_the_log_has_are_refused(room):
    with pytest.raises(DataError, match="is no link of the nodes"):
        look(room / "log.csv", listed(room, lambda lines: lines[:-2]))


def test_a_log_of_numbers_that_is_read_otherwise_than_it_was_written_is_said(room):
    """Of numbers alone it shows in directions of links that do not agree, or in their count."""
    _, *lines = (room / "log.csv").read_text().splitlines()
    (room / "plain.csv").write_text("\n".join(lines) + "\n")
    given = {"nodes": "nodes.csv", "layout": "channel-link"}
    assert not broken(look(room / "plain.csv", given).findings)
    (one,) = broken(look(room / "plain.csv", given | {"layout": "link-channel"}).findings)
    assert one.name == "links.reciprocity"
    with pytest.raises(DataError, match="no multiple of the 42 directed links of 7 nodes"):
        look(room / "plain.csv", listed(room, lambda lines: lines[:-1]) | {"layout": "channel-link"})
