"""The data of a page in one file beside it, from which `dftfs report` draws the page again.

The file is a NumPy archive: the arrays, and one JSON text that says where they belong. Reading it
makes records of this program and plain values only; nothing in it is run.
"""

import dataclasses
import enum
import importlib
import io
import json
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from dftfs import __version__
from dftfs.errors import DftfsError
from dftfs.files import write_bytes, write_text
from dftfs.report.provenance import recorded_command

SUFFIX = ".page.npz"
RENDERERS = {
    "study": "dftfs.report.study.render:render_study_page",
    "simulation": "dftfs.report.control.simulation:render_simulation_page",
    "comparison": "dftfs.report.control.comparison:render_comparison",
    "diagnosis": "dftfs.report.diagnosis.render:render_diagnosis",
    "result": "dftfs.report.result_page:result_page",
    "recordings": "dftfs.report.recording_page:recording_page",
}
_OURS = ("dftfs.", "rsea_core.")
_PLAIN = (str, int, float, bool, type(None))

_DAMAGED = (
    ValueError, KeyError, TypeError, AttributeError, IndexError, ImportError, EOFError,
    RecursionError, zipfile.BadZipFile,
)  # fmt: skip


class PageDataError(DftfsError):
    """A file that is not the data of a page."""


def write_page(path: Path, kind: str, **values: object) -> Path:
    """Draw a page, write it, and its data beside it; ``kind`` is a key of `RENDERERS`.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    path = Path(path)
    made = {"kind": kind, "version": __version__, "page": path.name, "command": recorded_command()}
    content = pack({**made, "values": values})
    write_text(path, render(kind, path.parent, values))
    write_bytes(path.with_suffix(SUFFIX), content)
    return path


def render(kind: str, folder: Path, values: Mapping) -> str:
    """The HTML of a page that will be in ``folder``."""
    module, name = RENDERERS[kind].split(":")
    placed = {"folder": folder} if kind == "study" else {}
    return getattr(importlib.import_module(module), name)(**values, **placed)


def draw_again(path: Path, folder: Path) -> tuple[str, str]:
    """Name and HTML of the page whose data are in the file ``path``, to be put into ``folder``.

    Raises
    ------
    PageDataError
        If the file is damaged, or was written by a version whose records were other ones.
    """
    content = page_content(path)
    with _damage_named(path):
        return Path(content["page"]).name, render(content["kind"], folder, content["values"])


def page_content(path: Path) -> dict:
    """Kind, version, command and values of the page whose data are in the file ``path``.

    Raises
    ------
    PageDataError
        As `draw_again`.
    """
    with _damage_named(path):
        return dict(unpack(path.read_bytes()))


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise PageDataError(f"{path}: cannot be read: {error.strerror}") from None
    except _DAMAGED as error:
        raise PageDataError(
            f"{path}: is damaged, or its records are not those of dftfs {__version__}; run the"
            f" command again ({type(error).__name__}: {str(error)[:120]})"
        ) from None


def pack(value: object) -> bytes:
    """Records, arrays and plain values as the bytes of a NumPy archive.

    Functions become None: a record keeps what it computes, not how. Of records that are not
    this program's the values are kept.

    Raises
    ------
    TypeError
        If something in it is neither a record nor a plain value.
    """
    packer = _Packer()
    text = json.dumps(packer.tree(value)).encode()
    stream = io.BytesIO()
    arrays = {f"a{k}": array for k, array in enumerate(packer.arrays)}
    np.savez_compressed(stream, tree=np.frombuffer(text, dtype=np.uint8), **arrays)
    return stream.getvalue()


def unpack(content: bytes) -> object:
    """What `pack` was given; of records the fields only, without their checks."""
    with np.load(io.BytesIO(content), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    tree = json.loads(arrays.pop("tree").tobytes())
    return _Unpacker([arrays[f"a{k}"] for k in range(len(arrays))]).value(tree)


class _Packer:
    """Makes the tree of a value; an object that occurs twice is written once."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = []
        self._known: dict[int, int] = {}
        self._kept: list[object] = []  # alive, so that no identity is used again

    def tree(self, value: object) -> object:
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, _PLAIN) and type(value) in _PLAIN:
            return value
        if isinstance(value, list):
            return [self.tree(item) for item in value]
        if callable(value) and not isinstance(value, type):
            return None
        if id(value) in self._known:
            return {"same": self._known[id(value)]}
        found = self._tree(value)
        self._known[id(value)] = len(self._kept)
        self._kept.append(value)
        return found

    def _tree(self, value: object) -> dict:
        if isinstance(value, np.ndarray):
            if value.dtype.hasobject:
                raise TypeError("an array of objects is no data of a page")
            self.arrays.append(value)
            return {"array": len(self.arrays) - 1}
        if isinstance(value, complex):
            return {"complex": [value.real, value.imag]}
        if isinstance(value, Path):
            return {"path": str(value)}
        if isinstance(value, Mapping):
            return {"mapping": [[self.tree(k), self.tree(v)] for k, v in value.items()]}
        if isinstance(value, set | frozenset):
            return {"set": [self.tree(item) for item in sorted(value)]}
        kind = type(value)
        if kind is tuple:
            return {"tuple": [self.tree(item) for item in value]}
        named = {"class": f"{kind.__module__}:{kind.__qualname__}"}
        if not _is_ours(kind):  # a controller or an effect of the user's: its values only
            named = {"class": "types:SimpleNamespace"}
            return named | {"fields": {k: self.tree(v) for k, v in vars(value).items()}}
        if isinstance(value, enum.Enum):
            return named | {"member": value.name}
        if isinstance(value, tuple):
            return named | {"items": [self.tree(item) for item in value]}
        return named | {"fields": {k: self.tree(v) for k, v in _fields(value).items()}}


class _Unpacker:
    """Makes the value of a tree."""

    def __init__(self, arrays: list[np.ndarray]) -> None:
        self._arrays = arrays
        self._known: list[object] = []

    def value(self, tree: object) -> object:
        if isinstance(tree, list):
            return [self.value(item) for item in tree]
        if not isinstance(tree, dict):
            return tree
        if "same" in tree:
            return self._known[tree["same"]]
        found = self._value(tree)
        self._known.append(found)
        return found

    def _value(self, tree: dict) -> object:
        if "class" in tree:
            return self._record(_record_class(tree["class"]), tree)
        ((kind, content),) = tree.items()
        makers = {
            "array": lambda: self._arrays[content],
            "complex": lambda: complex(*content),
            "path": lambda: Path(content),
            "mapping": lambda: {self.value(k): self.value(v) for k, v in content},
            "set": lambda: frozenset(self.value(item) for item in content),
            "tuple": lambda: tuple(self.value(item) for item in content),
        }
        return makers[kind]()

    def _record(self, kind: type, tree: dict) -> object:
        if "member" in tree:
            return kind[tree["member"]]
        if "items" in tree:
            return tuple.__new__(kind, [self.value(item) for item in tree["items"]])
        found = kind.__new__(kind)
        for name, content in tree["fields"].items():
            object.__setattr__(found, name, self.value(content))
        return found


def _fields(value: object) -> dict:
    if dataclasses.is_dataclass(value) and not hasattr(value, "__dict__"):
        return {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    kind = type(value)
    return {
        name: content
        for name, content in vars(value).items()
        if not isinstance(getattr(kind, name, None), cached_property)
    }


def _is_ours(kind: type) -> bool:
    return kind is SimpleNamespace or kind.__module__.startswith(_OURS)


def _record_class(name: str) -> type:
    """A record of this program by its name; nothing else can be made from a file."""
    module, _, place = name.partition(":")
    if module == "types" and place == "SimpleNamespace":
        return SimpleNamespace
    found: object = importlib.import_module(module) if module.startswith(_OURS) else None
    for part in place.split("."):
        found = getattr(found, part)
    if isinstance(found, type) and found.__module__ == module:
        plain = dataclasses.is_dataclass(found) or issubclass(found, enum.Enum)
        if plain or hasattr(found, "_fields"):
            return found
    raise TypeError(f"{name} is no record")
