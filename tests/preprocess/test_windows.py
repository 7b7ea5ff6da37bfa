import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy import ndimage, stats

from elusive.errors import DataError, ParameterError
from elusive.preprocess import ChiSquare, DotProduct, LikelihoodRatio, LocalDeviation, window_sums
from elusive.preprocess.sliding import window_variance
from elusive.preprocess.windows import Statistic
from tests.reference import windows as reference

BORDERS = ("circular", "reflected", "cut")
SCIPY = {"circular": "grid-wrap", "reflected": "reflect"}
SHAPES = ((41,), (9, 12))
ADAPTIVE = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
MODELS = (LocalDeviation, ChiSquare, DotProduct, LikelihoodRatio)


def noise(shape, seed=0, deviation=1.3):
    return deviation * np.random.default_rng(seed).standard_normal(shape)


def one_by_one(statistic, frame, model):
    found = [statistic(samples) for samples in reference.gathered(frame, model.window, model.border)]
    return np.reshape(found, frame.shape)


@pytest.fixture(params=BORDERS)
def border(request):
    return request.param


@pytest.fixture(params=SHAPES, ids=["signal", "image"])
def frame(request):
    return noise(request.param)


@pytest.mark.parametrize("window", [3, 5, 9])
class TestTwins:
    def test_local_deviation(self, frame, border, window):
        model = LocalDeviation(window=window, border=border)
        expected = one_by_one(reference.deviation, frame, model)
        np.testing.assert_allclose(model.statistic(frame), expected, rtol=1e-12)
        evidence = expected / frame.std()
        np.testing.assert_allclose(model.evidence(frame), evidence - evidence.mean(), atol=1e-12)

    @pytest.mark.parametrize(("adaptive", "boundaries"), [(True, ADAPTIVE), (True, (0.5,)), (False, (-0.8, 0.1, 9.0))])
    def test_chi_square_and_dot_product(self, frame, border, window, adaptive, boundaries):
        options = {"window": window, "border": border, "adaptive": adaptive, "boundaries": tuple(boundaries)}
        edges = np.array(boundaries) * (frame.std() if adaptive else 1.0)
        model = ChiSquare(**options)
        expected = one_by_one(lambda samples: reference.chi_square(samples, frame, edges), frame, model)
        np.testing.assert_allclose(model.statistic(frame), expected, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(model.evidence(frame), expected - expected.mean(), atol=1e-11)
        for sign, factor in (("dissimilar", -1.0), ("similar", 1.0)):
            model = DotProduct(**options, sign=sign)
            expected = one_by_one(lambda samples: reference.cosine(samples, frame, edges), frame, model)
            np.testing.assert_allclose(model.statistic(frame), expected, rtol=1e-13)
            np.testing.assert_allclose(model.evidence(frame), factor * (expected - expected.mean()), atol=1e-12)

    @pytest.mark.parametrize("mode", ["additive", "replacing"])
    @pytest.mark.parametrize("object_deviation", [0.4, 2.0])
    @pytest.mark.parametrize("background", [None, 1.1])
    def test_likelihood_ratio(self, frame, border, window, mode, object_deviation, background):
        model = LikelihoodRatio(
            window=window, border=border, mode=mode, object_deviation=object_deviation, background_deviation=background
        )
        s = background or frame.std()
        u = np.sqrt(s**2 + object_deviation**2) if mode == "additive" else object_deviation
        expected = one_by_one(lambda samples: reference.log_ratio(samples, s, u), frame, model)
        np.testing.assert_allclose(model.statistic(frame), expected, rtol=1e-10, atol=1e-11)
        if border != "cut":
            np.testing.assert_allclose(model.evidence(frame), expected - expected.mean(), atol=1e-10)

    def test_sums_against_scipy(self, frame, border, window):
        if border == "cut":
            expected = ndimage.uniform_filter(frame, window, mode="constant") * window**frame.ndim
        else:
            expected = ndimage.uniform_filter(frame, window, mode=SCIPY[border]) * window**frame.ndim
        found = window_sums(frame, window // 2, border, axes=frame.ndim)
        np.testing.assert_allclose(found, expected, atol=1e-12)

    def test_deviation_against_scipy(self, frame, border, window):
        if border == "cut":
            expected = ndimage.generic_filter(frame, np.nanstd, window, mode="constant", cval=np.nan)
        else:
            expected = ndimage.generic_filter(frame, np.std, window, mode=SCIPY[border])
        found = LocalDeviation(window=window, border=border).statistic(frame)
        np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_every_length_of_window_up_to_the_signal(border):
    frame = np.random.default_rng(3).integers(-1000, 1000, 23)
    for window in range(1, 24, 2):
        expected = [samples.sum() for samples in reference.gathered(frame, window, border)]
        np.testing.assert_array_equal(window_sums(frame, window // 2, border), expected)


def test_what_leads_is_a_batch(border):
    stack = noise((2, 3, 7, 9))
    one, two = window_sums(stack, 2, border), window_sums(stack, 2, border, axes=2)
    spread = window_variance(stack, 2, border, axes=2)
    for place in np.ndindex(2, 3):
        np.testing.assert_array_equal(two[place], window_sums(stack[place], 2, border, axes=2))
        np.testing.assert_array_equal(one[place][4], window_sums(stack[place][4], 2, border))
        np.testing.assert_array_equal(spread[place], window_variance(stack[place], 2, border, axes=2))


def test_chi_square_against_scipy():
    frame = noise(300)
    edges = [-np.inf, *ADAPTIVE * frame.std(), np.inf]
    overall = np.histogram(frame, edges)[0]  # no sample lies on an edge
    found = ChiSquare(window=21).statistic(frame)
    for k in (10, 150, 289):
        local = np.histogram(frame[k - 10 : k + 11], edges)[0]
        assert found[k] == pytest.approx(stats.chisquare(local, overall * 21 / 300).statistic, rel=1e-12)


def test_a_sample_on_a_boundary_belongs_to_the_region_below():
    frame = np.array([-1.0, 0.0, 1.0, 2.0])
    model = DotProduct(window=1, boundaries=(0.0, 1.0), adaptive=False)
    # regions hold 2, 1, 1 samples
    np.testing.assert_allclose(model.statistic(frame), np.array([2, 2, 1, 1]) / np.sqrt(6))


@pytest.mark.parametrize("axes", [1, 2])
@pytest.mark.parametrize("level", [0.0, 1e6])
def test_an_outlier_leaves_no_trace_once_outside_the_window(border, axes, level):
    frame = noise((40,) * axes) + level
    spoilt = frame.copy()
    spoilt[(20,) * axes] = 1e9
    away = np.ones(frame.shape, dtype=bool)
    away[(slice(17, 24),) * axes] = False
    for sums in (window_sums, window_variance):
        clean, found = (sums(values, 3, border, axes=axes) for values in (frame, spoilt))
        np.testing.assert_array_equal(found[away], clean[away])
        assert not np.any(found[~away] == clean[~away])
    model = LocalDeviation(window=7, border=border)
    expected = one_by_one(reference.deviation, frame, model)
    np.testing.assert_allclose(model.statistic(spoilt)[away], expected[away], rtol=1e-12 * max(level, 1))


def test_no_drift_along_a_long_signal():
    signal = np.random.default_rng(2).integers(-(2**40), 2**40, 100_000)
    ends = [signal[k - 3 : k + 4].sum() for k in range(99_000, 99_900)]
    np.testing.assert_array_equal(window_sums(signal, 3)[99_000:99_900], ends)


def test_deviation_keeps_its_digits_beside_a_large_mean():
    frame = noise(500)
    found = LocalDeviation().statistic(frame + 2.0**30)
    # 2^30 itself takes 30 of 52 bits of each sample
    np.testing.assert_allclose(found, LocalDeviation().statistic(frame), rtol=0, atol=2.0**-21)
    assert LocalDeviation(window=3).statistic([1e9] * 50 + [0.0] * 50)[[10, 25, 70]].tolist() == [0, 0, 0]


@pytest.mark.parametrize("s", [0.6, 1.0, 1.7])
def test_likelihood_ratio_has_the_mean_of_theory(s):
    """Less the divergence of background from object where there is none, plus the other way round where there is."""
    u, window, n = np.hypot(s, 1.0), 5, 400_000
    model = LikelihoodRatio(window=window, object_deviation=1.0, background_deviation=s)
    slope, step = 0.5 * (1 / s**2 - 1 / u**2), 0.5 * np.log(u**2 / s**2)
    for deviation in (s, u):
        found = model.statistic(noise(n, 1, deviation)).mean()
        error = window * slope * deviation**2 * np.sqrt(2 / n)
        assert found == pytest.approx(window * (slope * deviation**2 - step), abs=4 * error)
    assert slope * s**2 < step < slope * u**2


def test_chi_square_has_the_mean_of_theory():
    """Regions less one, but for the window being drawn from the frame itself; each is its own Monte Carlo run."""
    model, n = ChiSquare(window=9), 300
    means = [model.statistic(noise(n, seed)).mean() for seed in range(200)]
    assert np.mean(means) == pytest.approx(5 * (n - 9) / (n - 1), abs=4 * np.std(means) / np.sqrt(200))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("shape", [(600,), (60, 60)])
def test_an_object_raises_the_evidence(model, shape):
    middle = (slice(28, 33),) * len(shape)
    inside, outside = [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        frame = rng.standard_normal(shape)
        frame[middle] += 1.5 * rng.standard_normal(frame[middle].shape)
        evidence = model().evidence(frame)
        assert evidence.shape == shape
        assert evidence.mean() == pytest.approx(0, abs=1e-12)
        inside.append(evidence[(30,) * len(shape)])
        outside.append(evidence[(10,) * len(shape)])
    assert np.mean(inside) > 4 * np.hypot(np.std(outside), np.std(inside)) / np.sqrt(40)


def test_the_other_sign_is_the_negative():
    frame = noise(100)
    np.testing.assert_allclose(DotProduct(sign="similar").evidence(frame), -DotProduct().evidence(frame), atol=1e-15)


@pytest.mark.parametrize("model", MODELS)
def test_gain_changes_no_adaptive_evidence(model, frame):
    for gain in (2.0**-40, 2.0**33):  # powers of two are exact
        np.testing.assert_array_equal(model().evidence(gain * frame), model().evidence(frame))
    np.testing.assert_allclose(model().evidence(-frame), model().evidence(frame), atol=1e-12)


@pytest.mark.parametrize("model", MODELS)
def test_an_offset_is_ignored_refused_or_subtracted(model, frame):
    offset = frame + 2.0**4
    if model is LocalDeviation:
        np.testing.assert_allclose(model().evidence(offset), model().evidence(frame), atol=1e-12)
        return
    with pytest.raises(DataError, match=r"its mean, 1[56].*zero mean.*subtract_mean"):
        model().evidence(offset)
    centred = frame - frame.mean()
    np.testing.assert_allclose(model(subtract_mean=True).evidence(offset), model().evidence(centred), atol=1e-11)


def test_regions_in_the_signal_s_units_may_lie_anywhere():
    frame = noise(60)
    shifted = ChiSquare(adaptive=False, boundaries=(6.0, 7.0)).statistic(frame + 7)
    np.testing.assert_allclose(shifted, ChiSquare(adaptive=False, boundaries=(-1.0, 0.0)).statistic(frame))


@pytest.mark.parametrize("shape", [(40,), pytest.param((12, 12), marks=pytest.mark.thorough)], ids=["signal", "image"])
@pytest.mark.parametrize(
    ("model", "border"),
    [
        *((LikelihoodRatio, border) for border in BORDERS),
        *((model, "circular") for model in MODELS),
    ],
)
def test_evidence_of_noise_is_nowhere_biased(model, border, shape):
    runs = 2000
    maps = np.array([model(window=7, border=border).evidence(noise(shape, seed)) for seed in range(runs)])
    score = maps.mean(axis=0) / (maps.std(axis=0) / np.sqrt(runs))
    assert np.abs(score).max() < 4.5


@pytest.mark.parametrize(
    ("model", "border", "least", "most"),
    [(LocalDeviation, "cut", -0.45, -0.3), (DotProduct, "reflected", 0.7, 0.9), (ChiSquare, "reflected", 0.7, 0.9)],
)
def test_evidence_of_noise_is_biased_at_other_borders_as_told(model, border, least, most):
    maps = np.array([model(border=border).evidence(noise(200, seed)) for seed in range(2000)])
    assert least < maps[:, 0].mean() / maps.std() < most


def test_integers_and_single_precision_are_taken_and_the_frame_is_left_alone():
    counts = np.random.default_rng(5).integers(-9, 10, 50)
    for model in MODELS:
        expected = model().evidence(counts.astype(float))
        for kind in (np.int16, np.float32, list):
            np.testing.assert_array_equal(model().evidence(kind(counts)), expected)
        given = counts.astype(float)
        given.flags.writeable = False
        np.testing.assert_array_equal(model().evidence(given), expected)
        reversed_view = counts[::-1].astype(float)[::-1]
        np.testing.assert_array_equal(model().evidence(reversed_view), expected)


def test_a_window_as_long_as_the_frame(border):
    for model in MODELS:
        assert np.isfinite(model(window=5, border=border).evidence(noise(5, 7))).all()
        assert np.isfinite(model(window=5, border=border).evidence(noise((5, 9), 7))).all()


def bad(value):
    frame = noise(30)
    frame[7] = value
    return frame


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    ("frame", "sentence"),
    [
        (bad(np.nan), "frame: holds NaN, infinity"),
        (bad(np.inf), "frame: holds NaN, infinity"),
        (bad(-np.inf), "frame: holds NaN, infinity"),
        (bad(1e200), "beyond 1e150"),
        (np.full(30, 0.1), "all samples equal 0.1"),
        (np.zeros((9, 9), dtype=int), "all samples equal 0"),
        (noise(4), "side of 4 samples is shorter than the window of 5"),
        (noise((4, 50)), "side of 4 samples is shorter than the window of 5"),
        (np.empty(0), "not empty"),
        (np.empty((0, 9)), "not empty"),
        (np.float64(3), r"shape \(\), must be"),
        (noise((9, 9, 9)), r"shape \(9, 9, 9\), must be"),
        (noise(30) + 0j, "must be real numbers, not complex128"),
        (np.array(["1"] * 30), "must be real numbers, not <U1"),
    ],
)
def test_a_bad_frame_is_refused_with_a_sentence(model, frame, sentence):
    for method in (model().statistic, model().evidence):
        with pytest.raises(DataError, match=sentence):
            method(frame)


@pytest.mark.parametrize("model", [ChiSquare, DotProduct])
def test_a_frame_within_one_region_is_refused(model):
    with pytest.raises(DataError, match="one region; set boundaries between"):
        model(adaptive=False, boundaries=(10.0, 20.0)).evidence(noise(30))


@pytest.mark.parametrize(
    ("model", "given", "sentence"),
    [
        (LocalDeviation, {"window": 4}, r"LocalDeviation.window: must be odd.*got 4\); take 3 or 5"),
        (DotProduct, {"window": 8}, "DotProduct.window: must be odd"),
        (LocalDeviation, {"window": 1}, "LocalDeviation.window: must be greater than or equal to 3"),
        (ChiSquare, {"window": -3}, "ChiSquare.window: must be greater"),
        (ChiSquare, {"border": "mirror"}, "ChiSquare.border: must be 'circular', 'reflected' or 'cut'"),
        (ChiSquare, {"boundaries": (0.0, 1.0, 1.0)}, "ChiSquare.boundaries: each must lie above the last"),
        (DotProduct, {"boundaries": (2.0, 1.0)}, "DotProduct.boundaries: each must lie above the last"),
        (DotProduct, {"boundaries": ()}, "DotProduct.boundaries"),
        (DotProduct, {"boundaries": (0.0, np.nan)}, "DotProduct.boundaries.1: must be a finite number"),
        (LikelihoodRatio, {"mode": "replacing"}, "LikelihoodRatio.object_deviation: .*give another"),
        (
            LikelihoodRatio,
            {"mode": "replacing", "object_deviation": 2.0, "background_deviation": 2.0},
            "LikelihoodRatio.object_deviation: .*give another",
        ),
        (LikelihoodRatio, {"object_deviation": 0.0}, "LikelihoodRatio.object_deviation: must be greater than 0"),
    ],
)
def test_a_bad_parameter_is_refused_with_a_sentence(model, given, sentence):
    with pytest.raises(ParameterError, match=sentence):
        model(**given)


@pytest.mark.parametrize("sums", [window_sums, window_variance])
def test_sums_refuse_what_they_cannot_slide_along(sums):
    with pytest.raises(DataError, match="shorter than the window of 9"):
        sums(np.ones((20, 8)), 4)
    with pytest.raises(DataError, match="does not have 2 axes"):
        sums(np.ones(20), 4, axes=2)
    with pytest.raises(DataError, match="does not have 3 axes, one or two"):
        sums(np.ones((9, 9, 9)), 4, axes=3)
    with pytest.raises(DataError, match="real numbers"):
        sums(np.ones(20, dtype=complex), 4)
    with pytest.raises(ParameterError, match="0 or more"):
        sums(np.ones(20), -1)
    with pytest.raises(ParameterError, match="one of circular, reflected, cut"):
        sums(np.ones(20), 1, "wrap")


def test_a_nan_stays_within_its_windows(border):
    values = np.arange(20.0)
    values[8] = np.nan
    assert np.flatnonzero(np.isnan(window_sums(values, 2, border))).tolist() == [6, 7, 8, 9, 10]


@pytest.mark.parametrize("model", MODELS)
def test_a_statistic_is_chosen_by_its_kind(model):
    assert TypeAdapter(Statistic).validate_python({"kind": model().kind, "window": 7}) == model(window=7)
