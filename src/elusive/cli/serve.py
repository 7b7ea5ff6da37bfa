"""`elusive serve`: one source, one system, its sinks and a health page, gone on from where it was killed."""

from __future__ import annotations

import json
import os
import secrets
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml
from pydantic import Field

from elusive.cli import serving
from elusive.cli.health import health_page
from elusive.cli.terminal import say
from elusive.errors import DataError, ParameterError
from elusive.io.atomic import atomic_path, existing_folder, refused
from elusive.io.sources.address import LOOPBACK
from elusive.model import Model
from elusive.systems.registry import SYSTEMS

RUN = "run-{:04d}"
TOKEN, TOKEN_LETTERS = "token", 16  # file of the folder; at least


class Health(Model):
    """Where the health page is."""

    host: str = Field(LOOPBACK, description="Address to listen at; loopback, unless it is to be seen from elsewhere")
    port: int = Field(0, ge=0, le=65535, description="Port; 0: any that is free")
    token: str | None = Field(
        None, min_length=TOKEN_LETTERS, description="What is asked for; none: made, and kept in the folder"
    )


class ServeConfig(Model):
    """What `elusive serve` runs."""

    system: str = Field(description="Noun of `elusive track`: links, images, bearings, radar, ...")
    source: str = Field(description="File, folder, camera or address, as the command takes it")
    out: Path = Field(description="Folder: the checkpoint, and a folder of results for each start")
    options: dict[str, Any] = Field(default={}, description="The command's other options, by name, without hyphens")
    parameters: dict[str, Any] = Field(default={}, description="As in the file of --config")
    to: tuple[str, ...] = Field((), description="Sinks, as --to")
    health: Health = Health()

    def arguments(self, out: Path, parameters: Path) -> list[str]:
        """Return the command's arguments."""
        words = ["track", self.system, self.source, "--follow", "--out", str(out), "--config", str(parameters)]
        for name, value in self.options.items():
            flag = f"--{name.replace('_', '-')}"
            if isinstance(value, bool):
                words.append(flag if value else f"--no-{flag[2:]}")
            else:
                words += [flag, *map(str, value if isinstance(value, list) else [value])]
        return [*words, *(word for sink in self.to for word in ("--to", sink))]


def serve_command(
    config: Annotated[Path, typer.Argument(help="YAML file: system, source, options, parameters, to, health, out.")],
) -> None:
    """Track a source day and night: sinks, a health page, and on after a kill with the numbers of the tracks."""
    from elusive.cli import main

    wanted = ServeConfig.from_yaml(config)
    nouns = [system.noun for system in SYSTEMS]
    if wanted.system not in nouns:
        raise ParameterError(f"system: is {wanted.system!r:.40}; it must be one of {', '.join(nouns)}.")
    folder = existing_folder(wanted.out)
    what = json.dumps([wanted.system, wanted.source, wanted.options, wanted.parameters], sort_keys=True, default=str)
    served = serving.Served(f"elusive {wanted.system}: {Path(config).stem}", folder / "checkpoint", what)
    with closing(served):
        parameters = folder / "parameters.yaml"
        with refused(parameters):
            parameters.write_text(yaml.safe_dump(wanted.parameters), encoding="utf-8")
        token = wanted.health.token or _token(folder / TOKEN)
        with health_page(wanted.health.host, wanted.health.port, token, served.health, served.watched) as port:
            where = f"http://{wanted.health.host}:{port}/"
            (folder / "health.url").write_text(where + "\n", encoding="utf-8")
            say(f"Health: {where}?token=..., the token is in {folder / TOKEN}.")
            serving.now = served
            try:
                main(wanted.arguments(_next_run(folder), parameters))
            finally:
                serving.now = None


def _token(path: Path) -> str:
    """Return the folder's token, made at the first start; nobody else can read it.

    Raises
    ------
    DataError
        If it is none, or cannot be kept.
    """
    if not path.exists():
        with (
            atomic_path(path) as made,
            os.fdopen(os.open(made, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file,
        ):
            file.write(secrets.token_urlsafe(24))
    token = path.read_text(encoding="utf-8").strip()
    if len(token) < TOKEN_LETTERS:
        raise DataError(f"{path}: has fewer than {TOKEN_LETTERS} letters; remove it, and another is made.")
    return token


def _next_run(folder: Path) -> Path:
    """Return the folder of this start: the first number that is not taken."""
    taken = [int(path.name.rpartition("-")[2]) for path in folder.glob("run-*") if path.name[4:].isdecimal()]
    return folder / RUN.format(max(taken, default=0) + 1)
