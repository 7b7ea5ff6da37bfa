"""What of the package commands and pages reach, by the names that its sources use: nothing is run."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

Place = tuple[str, str]  # module, name of a definition in it; "" is all that stands there besides
HEADS = ("elusive.cli", "elusive.workbench", "elusive.__main__")  # and the pages of systems, and the package itself
CALLED = re.compile(r"(elusive[\w.]*):(\w+)")


class Sources:
    """Definitions of each module, and what the names in it mean."""

    def __init__(self, source: Path) -> None:
        self.defined: dict[str, dict[str, list[ast.stmt]]] = {}
        self._imported: dict[str, dict[str, tuple[str, str]]] = {}
        for path in source.rglob("*.py"):
            module = ".".join(path.relative_to(source).with_suffix("").parts).removesuffix(".__init__")
            tree = ast.parse(path.read_text(encoding="utf-8"))
            defined: dict[str, list[ast.stmt]] = {"": []}
            for statement in tree.body:
                for name in _names(statement):
                    defined.setdefault(name, []).append(statement)
            self.defined[module] = defined
            self._imported[module] = {
                alias.asname or alias.name: (node.module, alias.name)
                for node in ast.walk(tree)
                if isinstance(node, ast.ImportFrom) and node.module
                for alias in node.names
            }

    def reached_from(self, begins: Iterable[Place]) -> set[Place]:
        """Follow names from some definitions on."""
        found, left = set[Place](), list(begins)
        while left:
            place = left.pop()
            if place not in found:
                found.add(place)
                left += self._used(*place)
        return found

    def heads(self) -> Iterator[Place]:
        """Yield all of the commands and pages, and what modules do when they are loaded."""
        for module, defined in self.defined.items():
            is_head = (
                module == "elusive"
                or module.startswith(HEADS)
                or (module.startswith("elusive.systems.") and ".page" in module)
            )
            yield from ((module, name) for name in defined if is_head or not name)

    def _used(self, module: str, name: str) -> Iterator[Place]:
        for statement in self.defined[module].get(name, []):
            for node in ast.walk(statement):
                used: Place | str | None = None
                if isinstance(node, ast.Name):
                    used = self._meant(module, node.id)
                elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                    held = self._meant(module, node.value.id)
                    used = self._meant(held, node.attr) if isinstance(held, str) else None
                elif isinstance(node, ast.Constant) and (named := CALLED.fullmatch(str(node.value))):
                    used = self._meant(named[1], named[2])
                if isinstance(used, tuple):
                    yield used

    def _meant(self, module: str, name: str) -> Place | str | None:
        """Return what a name in a module stands for: a definition or a module."""
        if name in self.defined[module]:
            return module, name
        if name in self._imported[module]:
            of, original = self._imported[module][name]
            if of in self.defined and (meant := self._meant(of, original)):
                return meant
        inner = f"{module}.{name}"
        return inner if inner in self.defined else None


def _names(statement: ast.stmt) -> list[str]:
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return [statement.name]
    if isinstance(statement, ast.Import | ast.ImportFrom):
        return []
    targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", statement)]
    names = [node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)]
    return [] if names == ["__all__"] else names if isinstance(statement, ast.Assign | ast.AnnAssign) else [""]
