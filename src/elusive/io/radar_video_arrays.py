"""Radar video as arrays, in netCDF 4 or a .npz archive: how research sets that have formats of their own are brought.

| name | shape | what |
| --- | --- | --- |
| ``amplitude`` | spokes, samples | whole numbers from 0, real numbers, or complex samples, whose magnitude is taken |
| ``time_s`` | spokes | since 1970 (UTC) or the recording's start; without it, give the antenna's period |
| ``azimuth_deg`` | spokes, or one | clockwise; one value of an antenna that stands |
| ``range_m`` | samples | evenly spaced; or ``start_m`` and ``step_m``, one value each |
| ``from_north`` | one | whether azimuths count from north (the default) or from the bow |
| ``bits`` | one | of whole numbers, where not all that their type has |
| ``heading_deg``, ``lon_deg``, ``lat_deg`` | spokes, or one | of the radar's carrier, where known |

netCDF 4 holds them as variables, ``from_north`` and ``bits`` as attributes of ``amplitude``; spokes are read some at a
time.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.errors import DataError
from elusive.io.atomic import atomic_path
from elusive.io.netcdf_files import new_netcdf
from elusive.sensors.spokes import Spokes, check_spokes, join_spokes

SPOKE, SAMPLE = "spoke", "sample"  # dimensions
UNITS = {"time_s": "s", "azimuth_deg": "degree", "heading_deg": "degree"}
UNITS |= {"lon_deg": "degrees_east", "lat_deg": "degrees_north"}


def write_radar_video_arrays(path: str | os.PathLike[str], spokes: Iterable[Spokes]) -> int:
    """Write radar video of one range scale as arrays, whole or not at all.

    Parameters
    ----------
    path
        ``.npz``, for which all spokes are held in memory; else netCDF 4, written part by part.
    spokes
        In the order of time.

    Returns
    -------
    int
        Spokes written.

    Raises
    ------
    DataError
        If there are none, they contradict themselves or differ in scale, or the file cannot be written.
    """
    with atomic_path(path) as temporary:
        if str(path).lower().endswith(".npz"):
            whole = join_spokes([check_spokes(part, str(path)) for part in spokes])
            arrays: dict[str, Any] = {"amplitude": whole.amplitude, **_columns(whole), "range_m": whole.range_m}
            arrays |= {"from_north": whole.from_north} | ({"bits": whole.bits} if whole.bits else {})
            np.savez_compressed(temporary, **arrays)
            return len(whole.amplitude)
        return _netcdf(temporary, spokes, str(path))


def _columns(part: Spokes) -> dict[str, NDArray[Any]]:
    return {
        "time_s": part.time_s,
        "azimuth_deg": np.degrees(part.azimuth_rad),
        "heading_deg": np.degrees(part.heading_rad),
        "lon_deg": part.lonlat_deg[:, 0],
        "lat_deg": part.lonlat_deg[:, 1],
    }


def _netcdf(temporary: os.PathLike[str], spokes: Iterable[Spokes], name: str) -> int:
    written, first = 0, None
    with new_netcdf(temporary) as file:
        for part in spokes:
            check_spokes(part, name)
            columns = {"amplitude": part.amplitude, **_columns(part)}
            if first is None:
                first = part.select_spokes(slice(0, 1))
                file.dimensions = {SPOKE: None, SAMPLE: part.amplitude.shape[1]}
                file.create_variable("range_m", (SAMPLE,), data=part.range_m).attrs["units"] = "m"
                for key, values in columns.items():
                    made = file.create_variable(key, (SPOKE, SAMPLE)[: values.ndim], values.dtype)
                    made.attrs.update({"units": UNITS[key]} if key in UNITS else {})
                told = {"from_north": np.int8(part.from_north)} | ({"bits": np.int8(part.bits)} if part.bits else {})
                file.variables["amplitude"].attrs.update(told)
            join_spokes([first, part.select_spokes(slice(0, 1))])  # refuses another scale
            file.resize_dimension(SPOKE, written + len(part.amplitude))
            for key, values in columns.items():
                file.variables[key][written:] = values
            written += len(part.amplitude)
        if first is None:
            raise DataError(f"{name}: there are no spokes to write; give some.")
    return written
