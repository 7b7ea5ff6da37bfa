"""Tables as spreadsheets and data frames write them are read as those with commas, and each cell only as what it is."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.io.bearings import open_bearings
from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.io.radar_plots import open_radar_plots
from elusive.io.sensor_files import read_sensors
from elusive.io.signals import open_signal
from elusive.io.sources.cells import cells_of, mark_of

BEARINGS = "time_s,sensor,azimuth_deg\n0.5,1,90.25\n1.5,2,10.75\n"
SENSORS = "sensor,x_m,y_m\n1,-60.5,-35.0\n2,75.0,20.25\n"
PLOTS = "time_s,range_m,bearing_deg\n1.5,100.25,90.5\n4.0,200.5,91.25\n"
LOG = "time_s,1-2-0,2-1-0\n0.5,-50.25,-51.5\n1.5,-50.75,\n"
SIGNAL = "time_s,a,b\n0.5,1.25,-2.5\n1.5,,3e-2\n"

FORMS = {
    "as it is": lambda text: text,
    "semicolons": lambda text: text.replace(",", ";"),
    "decimal commas": lambda text: text.replace(",", ";").replace(".", ","),
    "tabs and decimal commas": lambda text: text.replace(",", "\t").replace(".", ","),
    "quoted": lambda text: "".join(",".join(f'"{cell}"' for cell in line.split(",")) + "\n" for line in text.split()),
    "a mark and ends of another system": lambda text: "\ufeff" + text.replace("\n", "\r\n"),
}
OF_TABLES = {
    "capitals": lambda text: text.upper(),
    "rows numbered": lambda text: "".join(f"{k - 1 if k else ''},{line}\n" for k, line in enumerate(text.split())),
    "a mark at the end": lambda text: text.replace("\n", ",\n"),
}


def read(folder, form):
    """Return every number of a recording of four systems, in a form."""

    def saved(name, text, form=form):
        path = folder / name
        path.write_bytes(form(text).encode())
        return path

    nodes = read_nodes(saved("nodes.csv", SENSORS.replace("sensor", "node")))
    bearings = list(open_bearings(saved("bearings.csv", BEARINGS), read_sensors(saved("sensors.csv", SENSORS))))
    scans = list(open_radar_plots(saved("plots.csv", PLOTS)))
    numbers = [nodes.positions_m]
    numbers += [[b.time_s, *b.azimuth_rad, *b.sensor] for b in bearings]
    numbers += [np.concatenate(scan.plots[:3]) for scan in scans]
    if form is not OF_TABLES["capitals"]:
        log = list(open_link_log(saved("log.csv", LOG), nodes))
        numbers += [[frame.time_s, *frame.rss_dbm.ravel()] for frame in log]
    if form in FORMS.values():
        numbers += [frame.samples for frame in open_signal(saved("signal.csv", SIGNAL))]
    return np.concatenate([np.ravel(part) for part in numbers])


@pytest.mark.parametrize("form", FORMS | OF_TABLES)
def test_each_form_holds_the_same_numbers(tmp_path, form):
    plain, other = tmp_path / "plain", tmp_path / "other"
    plain.mkdir()
    other.mkdir()
    make = (FORMS | OF_TABLES)[form]
    expected = read(plain, FORMS["as it is"])
    found = read(other, make)
    np.testing.assert_array_equal(found, expected[: len(found)])


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ("1,5;a,b;1,2,3; -,5e3 ;'4,4'", ["1.5", "a,b", "1,2,3", "-.5e3", "'4,4'"]),
        ("1,5,2", ["1", "5", "2"]),
        ('x\t"2,5"', ["x", "2.5"]),
        ("  3  4 ", ["3", "4"]),
    ],
)
def test_a_comma_is_a_decimal_point_where_it_is_one(text, cells):
    assert cells_of(text, mark_of(text)) == cells
