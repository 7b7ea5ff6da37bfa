"""A campaign's zarr store: one array an output, one chunk a block of trials, and a record of the blocks done."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive import __version__
from elusive.campaign.config import DONE, TRIAL, CampaignConfig, coordinate
from elusive.campaign.scenario import GridPoint
from elusive.campaign.trials import Layout, TrialError, block_layout, require_equal, trial_name
from elusive.errors import StoreError

if TYPE_CHECKING:
    import xarray as xr
    import zarr

ABSENT = "(nothing)"
ATTRIBUTES = ("configuration", "configuration_sha256", "elusive_version")


class Block(NamedTuple):
    """Consecutive trials at one point of the grid: what is run, written and recorded at once."""

    point: GridPoint
    numbers: range


class CampaignStore:
    """The store of one configuration, made when the first block shows what the outputs are.

    Raises
    ------
    StoreError
        If the path holds something else, or another configuration's store.
    """

    def __init__(self, path: Path, configuration: CampaignConfig, dims: Mapping[str, tuple[str, ...]]) -> None:
        self.path, self.configuration, self.dims = path, configuration, dims
        self._block = min(configuration.chunk, configuration.trials)
        self._arrays: dict[str, zarr.Array[Any]] = {}
        if path.exists() and not (path.is_dir() and not any(path.iterdir())):
            _require_same(path, _attributes_of(path), self._attributes())
            with _writing(path):
                self._open()

    def missing(self, points: Sequence[GridPoint]) -> list[Block]:
        """List the blocks not done yet, in the grid's order."""
        total = self.configuration.trials
        done = np.asarray(self._arrays[DONE][...]) if self._arrays else None
        return [
            Block(point, range(first, min(first + self._block, total)))
            for point in points
            for first in range(0, total, self._block)
            if done is None or not done[(*point.place, first)]
        ]

    def write(self, block: Block, outputs: Mapping[str, NDArray[Any]]) -> None:
        """Write a block's outputs, ``(n, ...)`` each, and then record it as done.

        Raises
        ------
        StoreError
            If the disk refuses.
        TrialError
            If the outputs differ from the other blocks' in names, shapes or types.
        """
        where = trial_name(block.numbers[0], block.point)
        with _writing(self.path):
            if not self._arrays:
                self._create(block_layout(outputs), where)
            require_equal(block_layout(outputs), self._layout(), where)
            place: tuple[int | slice, ...] = (*block.point.place, slice(block.numbers.start, block.numbers.stop))
            for name, array in outputs.items():
                self._arrays[name][place] = array
            self._arrays[DONE][place] = True

    def _attributes(self) -> dict[str, str]:
        text = self.configuration.canonical()
        return dict(zip(ATTRIBUTES, (text, hashlib.sha256(text.encode()).hexdigest(), __version__), strict=True))

    def _layout(self) -> Layout:
        front = len(self.configuration.grid) + 1
        return {name: (str(a.dtype), a.shape[front:]) for name, a in self._arrays.items() if name != DONE}

    def _open(self) -> None:
        import zarr

        # What a kill left between writing beside and renaming; a flag not yet whole is a block not done.
        for left in self.path.rglob("*.partial"):
            left.unlink()
        for flag in (self.path / DONE / "c").rglob("*"):
            if flag.is_file() and flag.stat().st_size != self._block:
                flag.unlink()
        axes = {*self.configuration.grid, TRIAL}
        found = zarr.open_group(self.path, mode="r+", zarr_format=3).arrays()
        self._arrays = {name: array for name, array in found if name not in axes}

    def _create(self, layout: Layout, where: str) -> None:
        """Make the empty store beside its place and rename it, so that it is never found half made."""
        import zarr
        from zarr.codecs import ZstdCodec

        trials, grid = self.configuration.trials, self.configuration.grid
        axes = {axis: coordinate(values) for axis, values in grid.items()} | {TRIAL: np.arange(trials)}
        dims = self._name_dims(layout, set(axes), where)
        beside = self.path.with_name(f".{self.path.name}.partial")
        if beside.exists():
            shutil.rmtree(beside)
        beside.parent.mkdir(parents=True, exist_ok=True)
        group = zarr.create_group(beside, zarr_format=3, attributes=self._attributes())
        for axis, labels in axes.items():
            kind: Any = str if labels.dtype.kind == "U" else labels.dtype
            made = group.create_array(
                axis, shape=labels.shape, chunks=labels.shape, dtype=kind, dimension_names=(axis,), compressors=None
            )
            made[...] = labels
        front = tuple(len(labels) for labels in axes.values())
        chunk = (*[1] * len(grid), self._block)
        for name, (kind, shape) in sorted(layout.items()):
            group.create_array(
                name,
                shape=front + shape,
                chunks=chunk + tuple(max(size, 1) for size in shape),
                dtype=kind,
                dimension_names=(*axes, *dims[name]),
                compressors=ZstdCodec(level=3),
                fill_value=np.nan if np.dtype(kind).kind in "fc" else 0,
            )
        # Uncompressed, so that its size tells whether a flag is whole.
        group.create_array(
            DONE,
            shape=front,
            chunks=chunk,
            dtype="bool",
            dimension_names=tuple(axes),
            compressors=None,
            fill_value=False,
        )
        if self.path.exists():
            self.path.rmdir()
        beside.rename(self.path)
        self._open()

    def _name_dims(self, layout: Layout, axes: set[str], where: str) -> dict[str, tuple[str, ...]]:
        """Name each output's own dimensions, and refuse names that the dataset could not hold together."""
        sizes: dict[str, int] = {}
        named = {}
        for name, (_, shape) in layout.items():
            own = self.dims.get(name, tuple(f"{name}_{axis}" for axis in range(len(shape))))
            if len(own) != len(shape):
                raise TrialError(f"{where} gave {name} of shape {shape}; the scenario names its dimensions {own}.")
            for dim, size in zip(own, shape, strict=True):
                if sizes.setdefault(dim, size) != size:
                    raise TrialError(f"{where}: dimension {dim} is {size} long in {name} and {sizes[dim]} in another.")
            named[name] = own
        taken = ({*layout} & {*axes, DONE, *sizes}) | ({*sizes} & {*axes, DONE})
        if taken or any(len(set(own)) < len(own) for own in named.values()):
            what = ", ".join(sorted(taken)) or "a dimension"
            raise TrialError(f"{where}: {what} is named twice among outputs, dimensions and the grid; rename one.")
        return named


def open_campaign(store: str | Path) -> xr.Dataset:
    """Open a campaign's results lazily, finished or not.

    Returns
    -------
    xarray.Dataset
        Each output with dims ``(grid axes..., trial, its own...)``, the grid's values as coordinates, and the
        coordinate ``done (grid axes..., trial)``: what is not done reads as NaN, 0 or False. The attribute
        ``configuration`` is JSON that :class:`CampaignConfig` takes.

    Raises
    ------
    StoreError
        If there is no campaign's store.
    """
    import xarray as xr

    path = Path(store)
    if not path.exists():
        raise StoreError(f"{path}: there is no such store; check the path.")
    _attributes_of(path)
    dataset = xr.open_dataset(path, engine="zarr", consolidated=False, chunks=None, mask_and_scale=False)
    dataset = dataset.set_coords(DONE)
    # Fixed-width text is what a netCDF file can hold as well.
    texts = {
        axis: (axis, np.asarray(labels.values.tolist(), dtype=np.str_))
        for axis, labels in dataset.coords.items()
        if labels.dtype.kind in "TO"
    }
    return dataset.assign_coords(texts)[sorted(str(name) for name in dataset.data_vars)]


def _attributes_of(path: Path) -> dict[str, Any]:
    try:
        attributes = json.loads((path / "zarr.json").read_text(encoding="utf-8"))["attributes"]
        return {name: attributes[name] for name in ATTRIBUTES}
    except (OSError, ValueError, KeyError, TypeError):
        raise StoreError(f"{path}: exists and is no campaign's store; choose another path.") from None


def _require_same(path: Path, found: dict[str, Any], wanted: dict[str, Any]) -> None:
    """Refuse to go on with another campaign, naming what differs."""
    if found == wanted:
        return
    there = json.loads(found["configuration"]) | {"elusive_version": found["elusive_version"]}
    here = json.loads(wanted["configuration"]) | {"elusive_version": wanted["elusive_version"]}
    differing = "; ".join(_differences("", there, here)) or "its checksum: it was edited"
    raise StoreError(f"{path}: holds another campaign. It differs in {differing}. Choose another path.")


def _differences(prefix: str, there: dict[str, Any], here: dict[str, Any]) -> Iterator[str]:
    for key in dict.fromkeys([*there, *here]):
        one, other = there.get(key, ABSENT), here.get(key, ABSENT)
        if isinstance(one, dict) and isinstance(other, dict) and prefix + key != "grid":
            yield from _differences(f"{prefix}{key}.", one, other)
        elif (a := json.dumps(one)) != (b := json.dumps(other)):
            yield f"{prefix}{key} ({a:.60} there, {b:.60} here)"


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise StoreError(
            f"{path}: cannot be written ({error.strerror or error}); free the disk or choose another path."
        ) from error
