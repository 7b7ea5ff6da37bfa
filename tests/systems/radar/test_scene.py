"""A scene of ships near a coast: the file that the workbench exports, run again without it."""

from __future__ import annotations

import pytest

from elusive.cli import main
from elusive.errors import DataError
from elusive.model import read_yaml
from elusive.systems.radar.scene import EXAMPLE_NAME, RadarScene
from elusive.systems.radar.scene_run import chart_of

BRIEF = RadarScene.example()
BRIEF = BRIEF.replace(
    routes_deg=(BRIEF.routes_deg[0][:4], BRIEF.routes_deg[0][10:13]),
    methods=("none", "field"),
    tracking=BRIEF.tracking.replace(particles=200),
)


def run(*words):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    assert not ended.value.code


@pytest.mark.thorough
def test_a_scene_and_the_command_on_its_recording_find_the_same(tmp_path, capsys):
    (tmp_path / "scene.yaml").write_text(BRIEF.to_yaml())
    out, again = tmp_path / "out", tmp_path / "again"
    run("scene", tmp_path / "scene.yaml", "--out", out)
    assert "field" in capsys.readouterr().out
    assert RadarScene(**read_yaml(out / "scene.yaml")) == BRIEF.replace(chart=EXAMPLE_NAME)
    radar = ["--radar-lat-deg", repr(BRIEF.radar.lat_deg), "--radar-lon-deg", repr(BRIEF.radar.lon_deg)]
    config = ["--config", out / "field/config.yaml", "--chart", out / EXAMPLE_NAME]
    run("track", "radar", out / "plots.csv", *radar, *config, "--out", again)
    assert (again / "tracks.csv").read_bytes() == (out / "field/tracks.csv").read_bytes()


def test_a_chart_that_is_not_beside_the_scene_is_refused(tmp_path):
    with pytest.raises(DataError, match=r"gone\.geojson: cannot be read \(No such file or directory\); put the chart"):
        chart_of(BRIEF.replace(chart="gone.geojson"), tmp_path)
