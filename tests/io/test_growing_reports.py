"""Reports that are written to a table while it is read: one that is rotated is followed."""

from __future__ import annotations

from elusive.geometry.local_frame import LocalFrame
from elusive.io.ais_reports import GrowingReports
from elusive.io.sources import Feed

HEADER = "time_s,mmsi,lon_deg,lat_deg,sog_mps,cog_deg\n"


def lines(first, last):
    return "".join(f"{k},244660000,5.0{k:02d},53.0,5,90\n" for k in range(first, last))


def test_a_table_that_is_rotated_is_read_from_its_start(tmp_path):
    path, said = tmp_path / "ais.csv", []
    path.write_text(HEADER + lines(0, 3))
    reports = GrowingReports(path, LocalFrame.at(5.0, 53.0), Feed(say=said.append))

    def since():
        return [report.time_s for report, *_ in reports.since()]

    assert since() == [0, 1, 2]
    path.rename(tmp_path / "ais.1")
    assert since() == []
    path.write_text(HEADER + lines(3, 9))  # longer than what was read
    assert since() == [3, 4, 5, 6, 7, 8]
    path.write_text(HEADER + lines(9, 10))
    assert since() == [9]
    assert len(said) == 2
    assert all("read from its start" in sentence for sentence in said)
