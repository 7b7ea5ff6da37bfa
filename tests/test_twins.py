"""Every compiled kernel that plain code calls has a slow, obvious twin, and a test that compares the two."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src"

# the kernels of a module: the test that compares them, and the twin in it
TWINS: dict[str, dict[str, str]] = {
    "charts._exact_kernels": {"masses": "charts/test_exact.py::land_mass"},
    "charts._field_kernels": {
        "fit": "charts/test_field.py::exact.probability",
        "read": "charts/test_field.py::exact.probability",
    },
    "charts._grid_kernels": {"read": "charts/test_approximations.py::windings"},
    "charts._index_kernels": {
        "cells_at": "charts/test_coast.py::windings",
        "inside": "charts/test_coast.py::windings",
        "list_runs": "charts/test_coast.py::windings",
        "mark_tiles": "charts/test_coast.py::windings",
        "wind": "charts/test_coast.py::windings",
    },
    "charts._nearest_kernels": {"distances": "charts/test_approximations.py::distances"},
    "filters.accumulate._null_kernels": {"highest": "filters/accumulate/test_false_alarm.py::recurrent.step"},
    "filters.accumulate._recurrent_kernels": {
        "forget": "filters/accumulate/test_recurrent.py::recurrent(",
        "straight": "filters/accumulate/test_recurrent.py::recurrent(",
        "switching": "filters/accumulate/test_recurrent.py::recurrent(",
        "tile_rows": "filters/accumulate/test_recurrent.py::recurrent(",
    },
    "filters.accumulate._trajectory_kernels": {
        "best_moves": "filters/accumulate/test_viterbi.py::every_path",
        "straight_maximum": "filters/accumulate/test_trajectories.py::straight_scores",
    },
    "filters.gaussian._batch_kernels": {"tracked": "filters/gaussian/test_track_batch.py::alone"},
    "filters.gaussian._bearing_kernels": {
        "bearing_rows": "filters/gaussian/test_map_smoother.py::twin.residuals",
        "curvature": "filters/gaussian/test_extended_kalman.py::twin.filtered",
        "loss_of": "filters/gaussian/test_map_smoother.py::twin.residuals",
        "move": "filters/gaussian/test_map_smoother.py::twin.moved",
    },
    "filters.gaussian._block_kernels": {
        "factorise": "filters/gaussian/test_map_smoother.py::twin.least",
        "marginals": "filters/gaussian/test_map_smoother.py::twin.least",
        "solve": "filters/gaussian/test_map_smoother.py::twin.least",
    },
    "filters.gaussian._extended_kernels": {
        "absorb": "filters/gaussian/test_extended_kalman.py::twin.filtered",
        "advance": "filters/gaussian/test_extended_kalman.py::twin.filtered",
        "filtered": "filters/gaussian/test_extended_kalman.py::twin.filtered",
        "predict": "filters/gaussian/test_extended_kalman.py::twin.filtered",
        "update": "filters/gaussian/test_extended_kalman.py::twin.filtered",
        "smoothed": "filters/gaussian/test_extended_kalman.py::twin.smoothed",
        "smoothed_start": "filters/gaussian/test_extended_kalman.py::twin.smoothed",
    },
    "filters.gaussian._interacting_kernels": {
        "advanced": "filters/gaussian/test_interacting.py::twin.interacting",
        "combined": "filters/gaussian/test_interacting.py::twin.interacting",
        "mixed": "filters/gaussian/test_interacting.py::twin.interacting",
    },
    "filters.gaussian._map_kernels": {
        "inverse_noise": "filters/gaussian/test_map_smoother.py::twin.least",
        "optimise": "filters/gaussian/test_map_smoother.py::twin.least",
    },
    "filters.gaussian._window_kernels": {"summed_out": "filters/gaussian/test_fixed_lag.py::twin.residuals"},
    "filters.particle._informed_kernels": {
        "correct": "filters/particle/test_informed.py::reference.corrected",
        "greatest_share": "filters/particle/test_informed.py::reference.effective_size",
        "selection": "filters/particle/test_informed.py::reference.selection",
    },
    "filters.particle._kernels": {
        "gather": "filters/particle/test_bernoulli.py::bernoulli_step",
        "moments": "filters/particle/test_sir.py::moments",
        "systematic": "filters/particle/test_resampling.py::reference.systematic",
        "total_of": "filters/particle/test_resampling.py::reference",
        "walk": "filters/particle/test_resampling.py::reference.at_points",
        "weigh": "filters/particle/test_bernoulli.py::bernoulli_step",
    },
    "filters.particle._newborn_kernels": {
        "draw_cells": "filters/particle/test_births.py::systematic",
        "fill_newborns": "filters/particle/test_bernoulli.py::bernoulli_step",
        "uniform_cells": "filters/particle/test_births.py::uniforms",
    },
    "filters.particle._particle_kernels": {
        "effective_size": "filters/particle/test_sir.py::reference.reweigh",
        "log_mixture": "filters/particle/test_particle_map.py::map_index",
        "reweigh": "filters/particle/test_sir.py::reference.reweigh",
    },
    "filters.particle._prediction_kernels": {
        "by_cell": "filters/particle/test_prediction.py::predicted",
        "predict": "filters/particle/test_prediction.py::predicted",
    },
    "filters.particle._step_kernels": {"step": "filters/particle/test_bernoulli.py::bernoulli_step"},
    "motion._linear_kernels": {"propagate_linear": "motion/test_motion.py::propagate_linear"},
    "preprocess._clutter_map_kernels": {
        "count": "preprocess/test_clutter_map.py::twin.counted",
        "follow": "preprocess/test_clutter_map.py::twin.followed",
        "judge": "preprocess/test_clutter_map.py::twin.judged",
        "stands": "preprocess/test_clutter_map.py::twin.expected",
        "sums": "preprocess/test_clutter_map.py::twin.summed",
        "widened": "preprocess/test_clutter_map.py::maximum_filter",
    },
    "preprocess._turn_evidence_kernels": {"mean_about": "preprocess/test_turn_evidence.py::twin.mean_about"},
    "preprocess._blob_kernels": {
        "average_linkage": "preprocess/test_blobs.py::reference.clusters",
        "centroid_offsets": "preprocess/test_blobs.py::reference.centroid",
        "gaussian_offsets": "preprocess/test_blobs.py::reference.gaussian_peak",
    },
    "preprocess._drawn_kernels": {
        "keep": "preprocess/test_drawn.py::np.minimum(kept",
        "leave_round": "preprocess/test_drawn.py::of_the_scene(",
        "long_lines": "preprocess/test_drawn.py::ndimage.binary_opening",
    },
    "preprocess._impulse_kernels": {
        "bends": "preprocess/test_peak_kernels.py::np.testing",
        "flashes": "preprocess/test_peak_kernels.py::reference.flashes",
    },
    "preprocess._image_prior_kernels": {
        "add_parity_block": "preprocess/test_tomography.py::np.linalg.inv(C)",
        "parity_block": "preprocess/test_tomography.py::np.linalg.inv(C)",
    },
    "preprocess._kernels": {
        "ring_quantiles": "preprocess/test_registration.py::reference.ring_quantiles",
        "sample_shifted": "preprocess/test_registration.py::reference.shifted",
    },
    "preprocess._link_weight_kernels": {"ellipses": "preprocess/test_link_weights.py::reference.ellipse_weights"},
    "preprocess._lone_kernels": {"without_lone": "preprocess/test_lone_samples.py::twin.without_lone"},
    "preprocess._overlaid_kernels": {"vote": "preprocess/test_overlaid.py::reference.voted"},
    "preprocess._past_kernels": {
        "deviate": "preprocess/test_peak_kernels.py::reference.read_between",
        "learn": "preprocess/test_peak_kernels.py::reference.learn",
    },
    "preprocess._repair_kernels": {"surroundings": "preprocess/test_peak_kernels.py::sliding_window_view"},
    "preprocess._scale_kernels": {
        "halve": "preprocess/test_peak_kernels.py::reference.smoothed",
        "level_lines": "preprocess/test_peak_kernels.py::reference.level_lines",
        "local_variance": "preprocess/test_peak_kernels.py::reference.local_variance",
        "smooth": "preprocess/test_peak_kernels.py::reference.smoothed",
        "subtract": "preprocess/test_peak_kernels.py::reference.subtracted",
        "whiten": "preprocess/test_peak_kernels.py::reference.spread_blocks",
    },
    "preprocess._scene_kernels": {
        "alignment": "preprocess/test_peak_kernels.py::reference.alignment",
        "deforming": "preprocess/test_peak_kernels.py::reference.deforming",
        "preference": "preprocess/test_peak_kernels.py::reference.errors",
    },
    "preprocess._summit_kernels": {
        "apart": "preprocess/test_peak_kernels.py::reference.apart",
        "summits": "preprocess/test_peak_kernels.py::reference.summits",
    },
    "preprocess._tail_kernels": {
        "count": "preprocess/test_peak_kernels.py::np.bincount",
        "quantile_plots": "preprocess/test_peak_kernels.py::reference.quantile_plot",
        "rate": "preprocess/test_peak_kernels.py::reference.log_left",
    },
    "preprocess._tomography_kernels": {"add_gram": "preprocess/test_tomography.py::reference.projection"},
    "preprocess._window_kernels": {
        "chi_squares": "preprocess/test_windows.py::reference.chi_square",
        "cosines": "preprocess/test_windows.py::reference.cosine",
        "moments": "preprocess/test_windows.py::reference.log_ratio",
        "regions": "preprocess/test_windows.py::reference.chi_square",
        "row_spreads": "preprocess/test_windows.py::reference.deviation",
        "row_sums": "preprocess/test_windows.py::reference",
    },
    "preprocess._written_kernels": {"sharp_parts": "preprocess/test_written.py::ndimage.label"},
    "sensors._radar_video_kernels": {
        "look": "sensors/test_radar_video.py::twin.look",
        "mean_about": "sensors/test_radar_video.py::twin.mean_at",
        "peaks": "sensors/test_radar_video.py::twin.peaks",
    },
    "sensors._additive_kernels": {
        "directions": "sensors/test_field.py::reference.log_ratio",
        "effect": "sensors/test_field.py::reference.covariance_of",
        "ratios": "sensors/test_field.py::reference.log_ratio",
    },
    "sensors._clutter_kernels": {"sample_places": "sensors/test_clutter_sensor.py::map_coordinates"},
    "sensors._envelope_kernels": {"log_ratio_rayleigh": "sensors/test_image.py::reference.log_ratio_rayleigh"},
    "sensors._field_kernels": {"power_at": "sensors/test_field.py::reference.power_at"},
    "sensors._kernels": {
        "in_view": "sensors/test_image.py::np.where(inside",
        "log_ratio_gaussian": "sensors/test_image.py::reference.log_ratio_gaussian",
        "template_map_gaussian": "sensors/test_image.py::reference.birth_map",
    },
    "sensors._linear_link_kernels": {
        "log_ratio": "sensors/test_linear_links.py::linear_log_ratio",
        "responses": "sensors/test_linear_links.py::bell",
    },
    "sensors._patch_kernels": {
        "lay": "sensors/test_image_patches.py::reference.spread",
        "log_ratio": "sensors/test_image_patches.py::reference.log_ratio_beside",
        "moments": "sensors/test_image_patches.py::reference.effect",
        "overlap": "sensors/test_image_patches.py::reference.overlap",
        "template_sums": "sensors/test_image_patches.py::reference.log_ratio_beside",
    },
    "sensors._radar_kernels": {
        "judge": "sensors/test_radar.py::reference",
        "scan_log_ratio": "sensors/test_radar.py::reference.log_ratio",
        "states_of_plots": "sensors/test_radar.py::reference.measured",
        "seen_with": "sensors/test_radar.py::reference.in_view",
        "tabulate": "sensors/test_radar.py::reference.log_ratio",
    },
    "sensors._shadowing_kernels": {
        "log_ratio": "sensors/test_link_shadowing.py::shadowed_log_ratio",
        "mean_profiles": "sensors/test_link_shadowing.py::shadowing",
        "prepare": "sensors/test_link_shadowing.py::shadowed_log_ratio",
        "slopes": "sensors/test_shadowing_slopes.py::shadowed_log_ratio",
    },
    "sensors._turn_gatherer_kernels": {
        "gather": "sensors/test_turn_gatherer.py::twin.gathered",
        "overlap": "sensors/test_turn_gatherer.py::twin.overlapped",
    },
    "sensors._waveform_kernels": {"covered_sums": "sensors/test_waveform.py::log_likelihood"},
    "tracking._pair_kernels": {
        "absorb": "tracking/test_peaks.py::reference.absorbed",
        "explain": "tracking/test_peaks.py::reference.ratio",
    },
    "tracking._peak_kernels": {
        "crowding": "tracking/test_peaks.py::reference.crowd",
        "fit_affine": "tracking/test_peaks.py::reference.affine",
        "leave_doubles": "tracking/test_peaks.py::reference.undoubled",
        "moments": "tracking/test_peaks.py::reference.mixed",
        "nearest": "tracking/test_peaks.py::cKDTree",
        "predict": "tracking/test_peaks.py::reference.predicted",
    },
    "tracking._detection_kernels": {
        "associate": "tracking/test_detections.py::twin.marginals",
        "associate_few": "tracking/test_detections.py::twin.marginals",
        "clusters": "tracking/test_detections.py::connected_components",
        "explanations": "tracking/test_detections.py::twin.step",
    },
    "tracking._target_kernels": {
        "moving": "tracking/test_peaks.py::reference.moving",
        "recent": "tracking/test_peaks.py::reference.recent",
        "ways": "tracking/test_peaks.py::reference.ways",
    },
    "tracking._trail_kernels": {
        "climb": "tracking/test_search.py::twin.climb",
        "total": "tracking/test_search.py::twin.values",
        "values": "tracking/test_search.py::twin.values",
    },
}


def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(SOURCE).with_suffix("").parts)


@cache
def kernels() -> dict[str, set[str]]:
    """Compiled functions by module."""
    found: dict[str, set[str]] = {}
    for path in SOURCE.rglob("*kernels.py"):
        found[module_of(path)] = {
            node.name
            for node in tree(path).body
            if isinstance(node, ast.FunctionDef) and any("njit" in ast.unparse(d) for d in node.decorator_list)
        }
    return found


@cache
def called() -> dict[str, set[str]]:
    """Names taken from modules of kernels, in code that is none: the kernel is called from Python there."""
    taken: dict[str, set[str]] = {module: set() for module in kernels()}
    for path in SOURCE.rglob("*.py"):
        if path.name.endswith("kernels.py") or "kernels" not in path.read_text(encoding="utf-8"):
            continue
        nodes, aliases = list(ast.walk(tree(path))), dict[str, str]()
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and node.module:
                for alias in node.names:
                    if node.module in taken:
                        taken[node.module].add(alias.name)
                    elif f"{node.module}.{alias.name}" in taken:
                        aliases[alias.asname or alias.name] = f"{node.module}.{alias.name}"
        for node in nodes:
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in aliases:
                taken[aliases[node.value.id]].add(node.attr)
    return taken


def test_every_kernel_called_from_python_has_a_twin() -> None:
    compiled = kernels()
    needed = {f"{module}.{name}" for module, names in called().items() for name in names & compiled[module]}
    named = {f"elusive.{module}.{name}" for module, twins in TWINS.items() for name in twins}
    assert needed - named == set(), "kernels without a twin"
    assert named - needed == set(), "twins of what no longer is a kernel called from Python"


def test_every_twin_is_compared() -> None:
    for twins in TWINS.values():
        for kernel, place in twins.items():
            file, _, twin = place.partition("::")
            assert twin in (ROOT / "tests" / file).read_text(encoding="utf-8"), (kernel, place)


def test_every_other_kernel_is_part_of_one() -> None:
    """What Python does not call is called by another kernel: its caller's twin covers it."""
    text = {path: path.read_text(encoding="utf-8") for path in SOURCE.rglob("*kernels.py")}
    from_python = called()
    for module, names in kernels().items():
        for name in names - from_python[module]:
            uses = sum(other.count(f"{name}(") + other.count(f"import {name}") for other in text.values())
            assert uses > 1, f"{module}.{name} is called by nothing"
