"""Findings: their order, their file, the terminal's last lines with --strict, and the report's piece."""

from __future__ import annotations

import json
import math

import pytest
import typer

from elusive.checks import Fact, Finding, broken, doubted, grave, write_checks
from elusive.cli.terminal import NOT_BELIEVED, tell_findings
from elusive.report.findings import UNSURE, findings_html

FINE = Fact(1.0, 1.1, True, 100).finding("noise.scale", "never said", "nor this")
REMARK = Finding("frames.few", False, math.nan, math.nan, "Only <9> frames.", "Give more.", grave=False)
GRAVE = Fact(1.0, 2.0, False, 100).finding("noise.half", "Twice what [was] claimed.", "Give --noise-sigma 4.")


def test_what_holds_is_kept_and_silent(tmp_path, capsys):
    write_checks(tmp_path, [FINE, REMARK])
    first, second = json.loads((tmp_path / "checks.json").read_text(encoding="utf-8"))
    assert first["holds"]
    assert first["seen"] == 1.1
    assert "never" not in first["sentence"]
    assert second["expected"] is None
    tell_findings([FINE], strict=True)
    assert capsys.readouterr() == ("", "")
    assert findings_html([FINE]) == ""


@pytest.mark.parametrize(
    ("expected", "seen", "said"),
    [
        (1.0, 1.1, "1.1 was seen where 1 is expected: it holds."),
        (math.nan, 0.25, "0.25 was seen: it holds."),
        (0.0, math.nan, "Nothing was seen that speaks against it."),
        (math.nan, math.nan, "Nothing was seen that speaks against it."),
    ],
)
def test_what_holds_says_its_numbers_where_there_are_any(expected, seen, said):
    assert Fact(expected, seen, True, 100).finding("frames.octets", "never said", "nor this").sentence == said


def test_grave_findings_come_first():
    assert broken([FINE, REMARK, GRAVE]) == (GRAVE, REMARK)
    assert grave([REMARK, GRAVE])
    assert not grave([FINE, REMARK])


def test_a_table_says_first_what_is_not_to_be_believed():
    rows = [("Frames", "9")]
    assert doubted(rows, [FINE, REMARK]) == rows
    assert doubted(rows, [REMARK, GRAVE]) == [("Not to be believed as it stands", "noise.half: see checks.json"), *rows]


def test_strict_exits_with_three_for_what_is_grave(capsys):
    tell_findings([REMARK], strict=True)
    tell_findings([GRAVE], strict=False)
    with pytest.raises(typer.Exit) as ended:
        tell_findings([FINE, REMARK, GRAVE], strict=True)
    assert ended.value.exit_code == NOT_BELIEVED == 3
    said = capsys.readouterr().err.splitlines()
    first, second = said[-2:]
    assert first == "noise.half: Twice what [was] claimed. Give --noise-sigma 4."
    assert second == "frames.few: Only <9> frames. Give more."


def test_the_report_says_so_above_all_numbers():
    piece = findings_html([FINE, REMARK, GRAVE])
    assert UNSURE in piece
    assert "&lt;9&gt;" in piece
    assert piece.index("noise.half") < piece.index("frames.few")
    assert UNSURE not in findings_html([REMARK])
