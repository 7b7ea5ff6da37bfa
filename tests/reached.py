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
        self.defined: dict[str, dict[str, list[tuple[str, ...]]]] = {}  # names, and attributes of names, that each uses
        self._imported: dict[str, dict[str, tuple[str, str]]] = {}
        for path in source.rglob("*.py"):
            module = ".".join(path.relative_to(source).with_suffix("").parts).removesuffix(".__init__")
            imported = self._imported[module] = {}
            defined = self.defined[module] = {"": []}
            for statement in ast.parse(path.read_text(encoding="utf-8")).body:
                used = list[tuple[str, ...]]()
                for node in _all_in(statement):
                    if isinstance(node, ast.ImportFrom) and node.module:
                        imported |= {alias.asname or alias.name: (node.module, alias.name) for alias in node.names}
                    used += _uses(node)
                for name in _names(statement):
                    defined.setdefault(name, []).extend(used)

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
        for of, *attribute in self.defined[module].get(name, []):
            used: Place | str | None
            if attribute:
                held = of if "." in of else self._meant(module, of)  # a module by its whole name, or what it is here
                used = self._meant(held, *attribute) if isinstance(held, str) else None
            else:
                used = self._meant(module, of)
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


def _all_in(statement: ast.AST) -> Iterator[ast.AST]:
    """Yield what `ast.walk` does, in another order and a third of its time."""
    left = [statement]
    while left:
        node = left.pop()
        yield node
        for value in vars(node).values():
            if isinstance(value, list):
                left += [item for item in value if isinstance(item, ast.AST)]
            elif isinstance(value, ast.AST):
                left.append(value)


def _uses(node: ast.AST) -> Iterator[tuple[str, ...]]:
    if isinstance(node, ast.Name):
        yield (node.id,)
    elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        yield node.value.id, node.attr
    elif isinstance(node, ast.Constant) and (named := CALLED.fullmatch(str(node.value))):
        yield named[1], named[2]


def _names(statement: ast.stmt) -> list[str]:
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return [statement.name]
    if isinstance(statement, ast.Import | ast.ImportFrom):
        return []
    targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", statement)]
    names = [node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name)]
    return [] if names == ["__all__"] else names if isinstance(statement, ast.Assign | ast.AnnAssign) else [""]
