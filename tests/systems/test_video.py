"""Radar video to tracks: simulated, tracked under the chart, by plots too; what is wrong is a sentence or a finding."""

from __future__ import annotations

import csv
import json
import math
from collections import Counter

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import open_radar_plots
from elusive.io.radar_video import open_radar_video
from elusive.preprocess.clutter_map import ClutterMap
from elusive.sensors.echo_extent import EchoExtent
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo, SeaLevel
from elusive.systems.video.about_tracks import AboutTracks
from elusive.systems.video.checks import Judged
from elusive.systems.video.parameters import PlotFinding, VideoTracking
from elusive.systems.video.plots import write_video_plots
from elusive.systems.video.registration import register
from elusive.systems.video.scene import VideoScene, track_video_scene
from elusive.systems.video.sea import Sea, SeaState, Still, VideoRadar, cell_places
from elusive.systems.video.simulate import (
    RADAR_DEG,
    START_S,
    VideoSimulation,
    contains,
    scenario_of,
    simulate_video,
    spokes_of,
)
from elusive.systems.video.start import VideoStart, start_of
from elusive.systems.video.swell import swell_after, without_crests
from elusive.systems.video.swinging import expected, swings, turned
from elusive.systems.video.told import findings_of
from elusive.systems.video.track import track_video, track_video_recording
from elusive.systems.video.turns import Heard, Learnt, heard, turns_of
from elusive.tracking.track import Track
from tests.longer import longer
from tests.recordings import DATA
from tests.reference.radar_video import level_sea

SMALL = {"spokes": 256, "samples": 160, "step_m": 20.0, "pulse_m": 40.0, "beam_deg": 6.0, "start_m": 200.0}
SIMULATION = VideoSimulation(
    turns=30, ships=2, snr_db=(14, 18), speed_mps=(8, 14), coast_north_m=1500, coast_rough_m=100, coast_error_m=10,
    rocks=5, radar=SMALL, seed=4,
)  # fmt: skip
TOLD = VideoTracking(radar={"beam_deg": 6.0, "pulse_m": 40.0}, charted={"imprecision": {"coast_sigma_m": 10.0}})


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("video") / "made"
    simulate_video(SIMULATION, folder)
    return folder


@pytest.fixture(scope="module")
def tracked(made):
    out = made.parent / "tracks"
    source = open_radar_video(made / "video.npz")
    outcome = track_video_recording(
        source, TOLD, out, charts=[made / "coast.geojson"], truth=made / "truth.csv", cutoff_m=200.0
    )
    return out, outcome


def test_ships_are_found_and_nothing_else(tracked):
    out, outcome = tracked
    assert outcome.scored.confirmed.strays == 0
    assert outcome.scored.confirmed.found > 0.7
    assert len(outcome.tracked.paths) == 2
    assert not [one.name for one in outcome.findings if not one.holds and one.grave]
    names = {path.name for path in out.iterdir()}
    assert {"tracks.csv", "tracks.geojson", "resting.csv", "result.nc", "report.html", "report.png"} <= names
    with (out / "resting.csv").open() as file:
        rocks = list(csv.DictReader(file))
    assert len(rocks) >= 5


@pytest.mark.thorough
def test_a_small_scene_has_as_many_ships_and_rocks_as_it_has(tmp_path):
    """One ship was two, 38 m apart and both sure; the coast's edge was fifteen echoes more."""
    small = {"spokes": 512, "samples": 256}
    outcome = track_video_scene(
        VideoScene(simulation=VideoSimulation(turns=20, ships=2, seed=0, radar=small)), tmp_path
    )
    assert len(outcome.tracked.paths) == 2
    assert len(outcome.resting) == 10
    assert outcome.scored.confirmed.strays == 0


@pytest.mark.thorough
def test_a_harbour_at_rest_holds_no_ship_under_way():
    """Piers and masts of a Navico 4G in four bits, saturated; by AIS the nearest ship lies 430 m off, beyond reach."""
    path = DATA / "radar" / "navico_4g_harbour.pcap.gz"
    if not path.is_file():
        pytest.skip("no radar video recordings beside the project")
    outcome = track_video_recording(open_radar_video(path), VideoTracking(), None)
    assert not outcome.tracked.paths
    assert dict(outcome.tracked.rows)["AIS"].endswith("one is the radar's own")


def test_ships_under_way_by_ais_are_tracked_or_named(made, tracked, tmp_path):
    """Reports of the true ways, and of a ship that is not there; one at rest on a rock."""
    source = open_radar_video(made / "video.npz")
    reports = tmp_path / "ais.csv"
    with (made / "truth.csv").open() as file:
        truth = list(csv.DictReader(file))
    frame = LocalFrame.at(*RADAR_DEG)
    with (made.parent / "tracks" / "resting.csv").open() as file:
        rock = next(csv.DictReader(file))
    with reports.open("w") as file:
        file.write("time_s,mmsi,lon_deg,lat_deg,sog_mps\n")
        for row in truth:
            ships = ((1, float(row["x_m"]), float(row["y_m"]), 10), (3, float(rock["x_m"]), float(rock["y_m"]), 0))
            for mmsi, x, y, speed in (
                (*ships, (9, -1500.0, -1500.0, 5))
                if row["track"] == "1"
                else ((2, float(row["x_m"]), float(row["y_m"]), 10),)
            ):
                lon, lat = frame.to_lonlat(np.array([[x, y]]))[0]
                file.write(f"{row['time_s']},{mmsi},{lon:.8f},{lat:.8f},{speed}\n")
    outcome = track_video_recording(source, TOLD, None, charts=[made / "coast.geojson"], ais=reports)
    told = dict(outcome.tracked.rows)["AIS"]
    assert told == "4 ships; in view 3 under way, of them 2 tracked, and 1 at rest, of them 1 seen as resting"
    finding = next(one for one in outcome.findings if one.name == "video.ais")
    assert not finding.holds
    assert "where 9 reported" in finding.sentence


def test_land_is_where_the_chart_says(tracked):
    _, outcome = tracked
    azimuth = next(one for one in outcome.findings if one.name == "video.azimuth")
    assert azimuth.holds
    assert abs(azimuth.seen) < 1.5


def test_a_wrong_north_is_told(made):
    source = open_radar_video(made / "video.npz")
    outcome = track_video_recording(
        source, TOLD.replace(azimuth_bias_deg=9.0), None, charts=[made / "coast.geojson"]
    )  # fmt: skip
    azimuth = next(one for one in outcome.findings if one.name == "video.azimuth")
    assert not azimuth.holds
    assert azimuth.seen == pytest.approx(-9.0, abs=1.5)


def test_plots_are_read_by_the_tracker_of_plots(made):
    path = made.parent / "plots.csv"
    parameters = PlotFinding(radar=TOLD.radar, charted=TOLD.charted, false_alarms=3.0)
    found = write_video_plots(open_radar_video(made / "video.npz"), parameters, path, charts=[made / "coast.geojson"])
    scans = list(open_radar_plots(path))
    assert sum(scan.detections for scan in scans) == found.plots
    assert len(scans) in (found.turns, found.turns + 1)
    assert found.plots / found.turns < 15
    assert found.lonlat_deg == pytest.approx(RADAR_DEG)


def test_category_240_gives_the_same_turns(tmp_path, made):
    simulate_video(
        SIMULATION.replace(turns=3, write="asterix", radar={**SMALL, "bits": 8, "gain": 3.0}), tmp_path / "b"
    )
    source = open_radar_video(tmp_path / "b" / "video.pcap")
    first = next(iter(source))
    assert first.from_north
    assert (first.start_m, first.step_m, first.bits) == (pytest.approx(200.0), pytest.approx(20.0), 8)


def test_the_seas_mean_power_and_a_ships_are_as_told():
    radar, state = VideoRadar(**SMALL), SeaState(shape=2.0, clutter_db=10.0, falls=0.0, swerling=0)
    sea = Sea(radar, state, Still(np.zeros(cell_places(radar).shape[:2])))
    rng = np.random.default_rng(1)
    power = np.mean([sea.turn(0.0, np.zeros((0, 4)), np.zeros(0), rng).amplitude ** 2 for _ in range(40)], axis=0)
    assert power.mean() == pytest.approx(11.0, rel=0.03)
    ship = np.array([[1500.0, 0.0, 0.0, 0.0]])
    with_ship = np.mean([sea.turn(0.0, ship, np.array([20.0]), rng).amplitude ** 2 for _ in range(40)], axis=0)
    row, column = np.unravel_index(with_ship.argmax(), power.shape)
    assert row == pytest.approx(64, abs=1)
    assert column == pytest.approx(65, abs=1)
    assert with_ship[row, column] == pytest.approx(11 * 101, rel=0.1)


@pytest.mark.parametrize(
    ("turned_deg", "east_m", "north_m"),
    longer(
        [(0.0, 0.0, 0.0), (-7.0, 0.0, 0.0), (2.0, 60.0, -80.0), (10.0, -100.0, 30.0)],
        (0.0, 0.0, 0.0),
        (-7.0, 0.0, 0.0),
        (2.0, 60.0, -80.0),
    ),
)
def test_a_radar_is_laid_on_its_chart(turned_deg, east_m, north_m):
    """Land of round islands, of which a radar sees the first 200 m; ten cells are fixed that are no land."""
    sensor = RadarVideo(beam_deg=2.0, pulse_m=25.0, start_m=100.0, step_m=12.5, samples=300)
    rng = np.random.default_rng(3)
    islands = rng.uniform(-3000, 3000, (14, 2))
    islands, radius = islands[np.hypot(*islands.T) > 900], 350.0

    def water(places):
        return (np.hypot(*np.moveaxis(places[:, None] - islands, -1, 0)).min(axis=1) > radius).astype(float)

    azimuth = sensor.azimuth_rad + np.radians(turned_deg)
    way = np.stack([np.sin(azimuth), np.cos(azimuth)], axis=1)
    places = sensor.range_m[None, :, None] * way[:, None] + np.array([east_m, north_m])
    land = water(places.reshape(-1, 2)).reshape(sensor.shape) < 0.5
    fixed = land & (np.cumsum(land, axis=1) <= 16) & (rng.random(land.shape) < 0.7)
    fixed.ravel()[rng.integers(0, fixed.size, 10)] = True
    found = register(fixed, sensor, water, (0.0, 0.0))
    assert found.likeness > 0.5
    assert abs(found.azimuth_deg - turned_deg) < 3 * found.azimuth_se_deg < 2.0
    assert np.hypot(*np.subtract(found.shift_m, (east_m, north_m))) < 3 * found.shift_se_m < 60.0
    start = VideoStart(sensor, LocalFrame.at(5.0, 53.0), 0.0, 0.0, EchoExtent(25.0, 2.0), 256)
    told = {one.name: one.holds for one in findings_of(Counter(), found, [], 0.0, start, fixed, charted=True)}
    assert told["video.azimuth"] == (abs(turned_deg) < 1)
    assert told["video.place"] == (east_m == 0)


def test_findings_say_what_does_not_hold():
    counts = Counter({"spokes": 100, "turns": 3, "no heading": 50, "other scale": 60})
    found = findings_of(
        counts,
        None,
        [5.0] * 12,
        500.0,
        VideoStart(RadarVideo(), None, 0.0, 0.0, EchoExtent(10.0, 1.9), 2),
        np.ones((4, 4), bool),
    )
    broken = {one.name for one in found if not one.holds}
    assert broken == {
        "video.turns", "video.heading", "video.scale", "video.clutter", "video.moving-radar", "video.crowded",
        "video.extent", "video.levels",
    }  # fmt: skip


def test_samples_that_are_all_the_same_are_no_echoes():
    start = VideoStart(RadarVideo(), None, 0.0, 0.0, EchoExtent(10.0, 1.9), 1)
    found = findings_of(Counter(), None, [5.0] * 12, 500.0, start, np.zeros((4, 4), bool))
    told = next(one for one in found if one.name == "video.levels")
    assert (told.holds, told.grave) == (False, True)
    assert "no echo was received" in told.sentence


def test_a_range_scale_that_changes_is_told_and_ends_what_is_live():
    """A turn that was begun before it changed is not gone on with when it changes back."""
    radar = VideoRadar(**SMALL)
    sea, none = Sea(radar, SeaState(), Still(np.zeros(cell_places(radar).shape[:2]))), (np.zeros((0, 4)), np.zeros(0))

    def spokes(*scales):
        """Yield a quarter of a turn in each."""
        for quarter, scale in enumerate(scales):
            whole = sea.turn(2.5 * (quarter // 4), *none, np.random.default_rng(quarter // 4))
            rows = np.array_split(np.arange(len(whole.time_s)), 4)[quarter % 4]
            arrays = {
                name: value[rows] for name, value in whole._asdict().items() if isinstance(value, np.ndarray)
            }  # fmt: skip
            yield whole._replace(**arrays, step_m=scale * whole.step_m)

    start = start_of(spokes(*[1] * 8), TOLD, None, None)
    counts = Counter()
    turns = list(turns_of(spokes(*[1] * 9, *[2] * 12, *[1] * 9), start, 0.0, counts))
    assert counts["turns away"] == 0
    assert len(turns) == 4  # two whole ones; of a turn and what came after, three quarters and a whole one
    for turn in turns:
        assert np.nanmax(turn.row_s) - np.nanmin(turn.row_s) < 2.5
    there_and_back = [*[1] * 9, *[2] * 20, *[1] * 9]
    assert len(list(turns_of(spokes(*there_and_back), start, 0.0, Counter(), live=True))) == 2
    counts = Counter()
    list(turns_of(spokes(*[1] * 9, *[2] * 20), start, 0.0, counts))
    assert counts["turns away"] == 4  # and all but the gaps between quarters of a fifth
    told = next(one for one in findings_of(counts, None, [], 0.0, start, np.zeros((4, 4), bool)) if "scale" in one.name)
    assert not told.holds
    assert told.grave
    assert "nothing was tracked from then on" in told.sentence


@pytest.mark.parametrize(
    ("ships", "off_m", "broken"), [(1, 10.0, {"beside"}), (1, 300.0, set()), (60, 300.0, {"many"})]
)
def test_ships_that_are_a_coasts_edge_or_too_many_are_named(ships, off_m, broken):
    sensor = RadarVideo(step_m=12.5)
    fixed = np.zeros(sensor.shape, bool)
    row, column = 89, 200
    fixed[row, column] = True
    place = sensor.places()[row, column] + [0.0, off_m]
    mean = np.array([place[0], 1.0, place[1], 0.0])
    tracks = [Track(k, "confirmed", 1.0, mean, np.eye(4)) for k in range(ships)]
    power = np.ones(sensor.shape, np.float32)
    state = ClutterMap().learnt(None, power)._replace(fixed=fixed)
    turn = EvidenceTurn(0.0, np.zeros(len(power)), power, (0.0, 0.0), power, power, ClutterMap().sea(state))
    judged = Judged(sensor)
    judged.add(Heard(turn, power, Learnt(state, state, fixed), 1.0), tracks)
    start = VideoStart(sensor, None, 0.0, 0.0, EchoExtent(np.nan, np.nan), 256)
    found = judged.findings(Counter({"spokes": 1, "turns": 20}), start, None, VideoTracking())[1]
    assert {one.name for one in found if not one.holds and one.grave} == {f"video.{name}" for name in broken}


def sea_of(sensor, rng, contrast):
    """Turns of evidence under a swell of 12 m/s towards 60 degrees, and what sails there: crests, or as they do."""
    way, speed, period = np.array([math.sin(math.pi / 3), 0.5]), 12.0, 2.5
    along, wave = np.array([way[1], -way[0]]), 2 * math.pi / (2 * math.pi * speed**2 / 9.81)
    places = sensor.places()
    middle = rng.uniform(-400, 400, (12, 2)) + np.array([900.0, 900.0])
    middle -= ((middle @ way) % (2 * math.pi / wave))[:, None] * way  # on a crest
    velocity = speed * way + rng.uniform(-5, 5, (12, 1)) * along
    for turn in range(8):
        time_s = turn * period
        height = np.cos(wave * (places @ way - speed * time_s))
        evidence = np.exp(0.5 * contrast * height) * rng.exponential(size=sensor.shape)
        now = middle + time_s * velocity
        tracks = [
            Track(k, "confirmed", 1.0, np.array([x, vx, y, vy]), 0.01 * np.eye(4))
            for k, ((x, y), (vx, vy)) in enumerate(zip(now, velocity, strict=True))
        ]
        other = Track(99, "confirmed", 1.0, np.array([-900.0, 3.0, 900.0, 4.0]), 0.01 * np.eye(4))
        rows = time_s + period * np.arange(sensor.shape[0]) / sensor.shape[0]
        evidence = evidence.astype(np.float32)
        ones = np.ones_like(evidence)
        yield EvidenceTurn(time_s, rows, evidence, (0.0, 0.0), ones, ones, level_sea(ones)), [*tracks, other]


@pytest.mark.parametrize(("contrast", "told"), [(1.5, True), (0.0, False)])
def test_crests_of_swell_are_told_from_a_lane_of_ships(contrast, told):
    """A hundred crests were sure ships, or twenty and nothing said so, for how fast one goes along itself is not seen.

    Ships that sail alike are left as they are, and so is what sails otherwise in a swell.
    """
    sensor = RadarVideo(step_m=12.5, samples=160)
    power = np.ones(sensor.shape, np.float32)
    state = ClutterMap().learnt(None, power)
    judged, swell = Judged(sensor), None
    for turn, tracks in sea_of(sensor, np.random.default_rng(5), contrast):
        swell = swell_after(swell, tracks, turn, sensor)
        shown = without_crests(tracks, swell)
        judged.add(Heard(turn, power, Learnt(state, state, state.fixed, AboutTracks(swell=swell)), 1.0), shown)
    assert {one.track for one in shown if one.status == "confirmed"} == ({99} if told else {*range(12), 99})
    if told:  # where they hardly show in a turn they were no swell, and ships
        faint = swell._replace(crest=(220.0, 200.0), trough=(200.0, 200.0))
        assert faint._replace(was_sure=True).sure
        assert not faint._replace(was_sure=False).sure
        assert not faint._replace(was_sure=True, crest=(200.0, 200.0)).sure
        after = swell_after(swell, tracks, turn, sensor)
        assert after is not None
        assert after.was_sure
    start = VideoStart(sensor, None, 0.0, 0.0, EchoExtent(np.nan, np.nan), 256)
    found = judged.findings(Counter({"spokes": 1, "turns": 20}), start, None, VideoTracking())[1]
    finding = next(one for one in found if one.name == "video.swell")
    assert finding.holds != told
    if told:
        assert swell.speed_mps == pytest.approx(12.0, abs=0.5)
        assert math.degrees(swell.towards_rad) == pytest.approx(60.0, abs=5.0)
        assert "12 tracks at once were crests of a swell" in finding.sentence


@pytest.mark.thorough
def test_a_radar_that_is_not_told_of_is_read_from_its_echoes():
    """Cells of two samples would be an eighth of the pulse: every ship would be several, at wandering places."""
    radar = {"samples": 512, "step_m": 3.125, "bits": 8}
    simulation = VideoSimulation(turns=24, ships=3, snr_db=(11, 14), speed_mps=(6, 12), radar=radar, seed=12)
    scenario = scenario_of(simulation, np.random.default_rng(12))
    spokes = list(spokes_of(scenario, simulation, np.random.default_rng(5)))
    parameters = VideoTracking()
    start = start_of(spokes, parameters, None, None)
    tracker, _ = parameters.bind(start.sensor, None)
    turns = heard(turns_of(spokes, start, 0.0, Counter()), parameters.clutter, 6, None)
    *_, last = track_video(turns, tracker)
    sure = [track for track in last.tracks if track.status == "confirmed"]
    now = scenario.ships[:, [0, 2]] + (last.time_s - START_S) * scenario.ships[:, [1, 3]]
    nearest = [np.hypot(*(track.mean[[0, 2]] - now).T).min() for track in sure]
    assert len(sure) == 3
    assert max(nearest) < 80.0
    told = VideoTracking(radar={"pulse_m": 6.25, "beam_deg": 2.0})
    finer = start_of(spokes, told, None, None)
    found = {one.name: one for one in findings_of(Counter(), None, [], 0.0, finer, np.zeros((4, 4), bool))}
    assert not found["video.extent"].holds
    assert found["video.extent"].grave
    assert {one.name: one.holds for one in findings_of(Counter(), None, [], 0.0, start, np.zeros((4, 4), bool))}[
        "video.extent"
    ]


@pytest.mark.thorough
@pytest.mark.parametrize(("speed", "seed"), [(2.5, 21), (12.0, 22)])
def test_strong_ships_in_fine_samples_are_one_track_each(speed, seed):
    """Echoes of 20 to 30 dB are longer than five cells: what was left of one began three tracks more on the mean."""
    radar = {"samples": 512, "spokes": 512, "step_m": 6.25}
    simulation = VideoSimulation(
        turns=30, ships=2, snr_db=(20, 30), speed_mps=(speed, speed), coast_north_m=None, rocks=0, radar=radar,
        sea={"shape": 0.5}, seed=seed,
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    scenario = scenario_of(simulation, rng)
    spokes = list(spokes_of(scenario, simulation, rng))
    parameters = VideoTracking()
    start = start_of(spokes, parameters, None, None)
    tracker, _ = parameters.bind(start.sensor, None)
    steps = track_video(heard(turns_of(spokes, start, 0.0, Counter()), parameters.clutter, 6, None), tracker)
    sure = {track.track for step in steps for track in step.tracks if track.status == "confirmed"}
    assert len(sure) == 2


def test_what_cannot_be_done_is_a_sentence(made, tmp_path):
    source = open_radar_video(made / "video.npz")
    with pytest.raises(ParameterError, match="radar_lon_deg"):
        start_of(source, TOLD, 3.0, None)
    with pytest.raises(ParameterError, match="GB"):
        start_of(source, VideoTracking(radar={"beam_deg": 0.0001}), None, None)
    turn = [part._replace(azimuth_rad=(-part.azimuth_rad) % (2 * np.pi)) for part in source]
    with pytest.raises(DataError, match="360 degrees minus each"):
        start_of(turn, TOLD, None, None)
    with pytest.raises(DataError, match="all azimuths are 60 degrees; ships are tracked in whole turns"):
        start_of(
            [part._replace(azimuth_rad=np.full_like(part.azimuth_rad, np.pi / 3)) for part in turn], TOLD, None, None
        )
    with pytest.raises(DataError, match="charted"):
        track_video_recording(
            source, TOLD, None, radar_lon_deg=10.0, radar_lat_deg=0.0, charts=[made / "coast.geojson"]
        )
    with pytest.raises(DataError, match="GB"):
        simulate_video(SIMULATION.replace(turns=100_000), tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_a_scene_tells_the_tracker_of_its_radar():
    told = VideoScene(simulation=SIMULATION).settled
    assert told.radar.beam_deg == 6.0
    assert told.charted.imprecision.coast_sigma_m == 10.0
    assert json.dumps(VideoScene(simulation=SIMULATION).model_dump(mode="json"))


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_spiky_sea_keeps_its_law_beside_an_uncharted_coast_and_rocks(seed):
    """Land was counted as sea until it was known as fixed: half of strong clutter was told.

    Sea beside a rock was held to how rocks fluctuate, which is less: evidence of 1.5 on the mean, slow sure tracks.
    """
    simulation = VideoSimulation(
        turns=24, ships=0, rocks=20, seed=seed, sea={"shape": 0.5}, radar={"spokes": 512, "samples": 256}
    )
    rng = np.random.default_rng(seed)
    scenario = scenario_of(simulation, rng)
    told = VideoTracking(radar={"beam_deg": 2.0, "pulse_m": 25.0})
    spokes = list(spokes_of(scenario, simulation, rng))
    start = start_of(spokes, told, None, None)
    turns = list(heard(turns_of(spokes, start, 0.0, Counter()), told.clutter, told.learning_turns, None))[6:]
    evidence = np.array([one.turn.evidence for one in turns])
    sea = ~contains(scenario.coast.true.buffer(300.0), start.sensor.places())
    clutter = turns[-1].clutter
    share = (evidence[:, sea & ~clutter.fixed] > 5).mean() / np.exp(-5)
    assert share == pytest.approx(1.0, abs=0.15)
    beside = evidence[:, sea & clutter.beside]
    assert beside.shape[1] > 200
    assert beside.mean() < 1.05
    assert (beside > 8).mean() < 2 * np.exp(-8)  # one such is in sight for some turns


@pytest.mark.parametrize("swing", [0.0, 1.0, 3.0])
def test_headings_that_lag_are_told_by_what_is_fixed(swing):
    """Swinging edges of what is fixed were sure ships, and nothing said so."""
    rng, sensor, pairs, truth = np.random.default_rng(7), RadarVideo(beam_deg=2.0, samples=240), [], []
    fixed = np.zeros(sensor.shape, bool)
    for row, column in zip(rng.integers(0, 360, 40), rng.integers(0, 110, 40), strict=True):
        fixed[row : row + 8, column : column + 5] = True
    for k in range(40):
        truth.append(swing * np.sin(2 * np.pi * k / 24))
        rows = np.arange(360) - truth[-1]
        lower = np.floor(rows).astype(int)
        part = (rows - lower)[:, None]
        shown = (1 - part) * fixed[lower % 360] + part * fixed[(lower + 1) % 360]
        pairs.append(turned(np.exp(4 * shown) * rng.exponential(size=fixed.shape), fixed))
    pairs = np.array(pairs)
    assert np.abs(pairs - np.array(truth)[:, None]).max() < 0.5
    found = swings(pairs, sensor)
    assert found.holds == (swing == 0)
    assert found.seen == pytest.approx(np.std(truth), abs=0.15)
    assert np.isnan(turned(np.ones(fixed.shape), np.zeros_like(fixed))).all()
    assert np.isnan(turned(np.full(fixed.shape, np.nan), fixed)).all()


@pytest.mark.parametrize("late", longer([0.0, 3.0], 0.0))
def test_headings_that_lag_in_a_turn_are_told_by_ships_about_where_they_were_expected(late):
    """In open sea, where nothing is fixed, ships were told anew beside themselves, and nothing said so."""
    rng, sensor, pairs = np.random.default_rng(9), RadarVideo(beam_deg=2.0, samples=240), []
    nothing = np.zeros(sensor.shape, bool)
    across, along, before = np.arange(360)[:, None], np.arange(sensor.shape[1]), None
    for k in range(200):
        off = -late * (15 <= k < 33)
        angle = np.radians(np.array([10, 80, 150, 200, 290, 340])) + 2e-3 * k
        distance = sensor.range_m[10:110:18] + 0.3 * k
        ships = np.stack([distance * np.sin(angle), distance * np.cos(angle)], axis=1)
        power = np.ones(sensor.shape, np.float32)
        for east, north in ships:
            row = np.arctan2(east, north) / sensor.grid[2] - 1 + off
            column = (np.hypot(east, north) - sensor.grid[0]) / sensor.grid[1]
            aside = (across - row + 180) % 360 - 180
            power += 100 * np.exp(-(aside**2) - (along - column) ** 2).astype(np.float32)
        power *= rng.exponential(size=power.shape).astype(np.float32)
        sea = SeaLevel(*np.zeros((2, 1, sensor.shape[1]), np.float32), *np.zeros((2, 360), int))
        turn = EvidenceTurn(2.5 * k, np.full(360, 2.5 * k), power, (0.0, 0.0), power, power, sea)
        if before is not None:
            told = [Track(n, "confirmed", 1.0, mean, np.eye(4)) for n, mean in enumerate(before)]
            pairs.append(turned(power, nothing, expected(told, 2.5 * (k - 1), turn, sensor)))
        velocity = np.stack([np.cos(angle), -np.sin(angle)], axis=1) * distance[:, None] * 2e-3 / 2.5
        shown = angle + off * sensor.grid[2]
        told_at = np.stack([distance * np.sin(shown), distance * np.cos(shown)], axis=1)
        before = np.stack([told_at[:, 0], velocity[:, 0], told_at[:, 1], velocity[:, 1]], axis=1)
    pairs = np.array(pairs)
    assert (np.abs(np.delete(pairs, [14, 32], axis=0)) < 0.7).all()
    np.testing.assert_allclose(pairs[[14, 32]], np.array([[-late, -late], [late, late]]), atol=0.7)
    found = swings(pairs, sensor)
    assert found.holds == (late == 0)
    assert np.isnan(turned(power, nothing, np.zeros((3, 2)) + 20.0)).all()


def test_what_rests_tells_a_sailing_radar_that_its_heading_lags():
    """Of three ships and four buoys the ships alone were held against a turn: too few, and nothing was said."""
    sensor, rng = RadarVideo(beam_deg=2.0, samples=240, step_m=10.0, start_m=200.0), np.random.default_rng(10)
    across, along = np.arange(sensor.shape[0])[:, None], np.arange(sensor.shape[1])
    power = np.ones(sensor.shape, np.float32)
    state, nothing = ClutterMap().learnt(None, power), np.zeros(sensor.shape, bool)
    bearing, marks = np.radians([10, 80, 150, 200, 290, 340]), np.zeros((6, 4))
    marks[:, [0, 2]] = np.column_stack([np.sin(bearing), np.cos(bearing)]) * np.arange(800, 2000, 200)[:, None]
    tracks = [Track(k, "candidate", 0.99, mean, np.eye(4)) for k, mean in enumerate(marks)]
    for late in (3, 0):
        judged = Judged(sensor)
        for k in range(36):
            off = marks[:, [0, 2]] - np.array([10.0 * k, 0.0])
            row = np.arctan2(*off.T) / sensor.grid[2] - 1 - late * (k in (18, 19, 27))
            aside = (across - row + 180) % 360 - 180
            column = (np.hypot(*off.T) - sensor.grid[0]) / sensor.grid[1]
            shown = 1 + 100 * np.exp(-(aside**2)) @ np.exp(-((along - column[:, None]) ** 2))
            power = (shown * rng.exponential(size=sensor.shape)).astype(np.float32)
            turn = EvidenceTurn(
                2.5 * k, np.full(len(power), 2.5 * k), power, (10.0 * k, 0.0), power, power, ClutterMap().sea(state)
            )
            judged.add(Heard(turn, power, Learnt(state, state, nothing), 1.0), tracks)
        start = VideoStart(sensor, None, 0.0, 0.0, EchoExtent(np.nan, np.nan), 256)
        found = judged.findings(Counter({"spokes": 1, "turns": 36}), start, None, VideoTracking())[1]
        assert next(one for one in found if one.name == "video.swings").holds == (late == 0)


@pytest.mark.parametrize("turns", [30, 120])
def test_rain_that_drifts_is_no_bow_that_swings(turns):
    """Four of ten drawn recordings of rain were told so: near and far it turned by rows, one way."""
    rng, sensor = np.random.default_rng(3), RadarVideo(beam_deg=2.0, samples=240)
    when = np.arange(turns) / 30
    drift = np.column_stack([np.sin(1.5 * when + 0.3), 1.5 * np.sin(1.2 * when)]) * 2.0
    rain = drift + 0.15 * rng.standard_normal((turns, 2))
    assert np.corrcoef(rain.T)[0, 1] > 0.5
    assert swings(rain, sensor).holds
    rain[::7] = np.nan
    assert swings(rain, sensor).holds
    yaws = 0.8 * np.sin(2 * np.pi * np.arange(turns) / 8)[:, None]
    found = swings(rain + yaws, sensor)
    assert not found.holds
    assert found.seen == pytest.approx(0.8 / np.sqrt(2), rel=0.1)
