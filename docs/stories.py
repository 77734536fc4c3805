"""Runs the four stories and writes them as notebooks: `python docs/stories.py`.

The text of a story is `docs/notebooks/NAME.py` (jupytext's percent format); `NAME.ipynb` beside it
is that story with what its cells printed and drew, as the manual shows it.
"""

import os
import re
import sys
import tempfile
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).with_name("notebooks")
STORIES = tuple(sorted(path.stem for path in FOLDER.glob("*.py")))
_DIFFERS = re.compile(r"\d+(\.\d+)? s in all|takes \d+(\.\d+)? us|/tmp/\S+")  # from run to run


def executed(name: str) -> nbformat.NotebookNode:
    """The story's notebook with its outputs; run in a new folder, with this interpreter.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell fails.
    """
    notebook = jupytext.read(FOLDER / f"{name}.py", fmt="py:percent")
    with tempfile.TemporaryDirectory() as folder:
        path = os.pathsep.join([str(FOLDER.parents[1]), os.environ.get("PYTHONPATH", "")])
        own = {
            **os.environ,
            "PYTHONPATH": path,
            "MPLBACKEND": "module://matplotlib_inline.backend_inline",
        }
        client = NotebookClient(
            notebook,
            timeout=300,
            extra_arguments=["--log-level=40"],
            resources={"metadata": {"path": folder}},
        )
        client.create_kernel_manager()
        client.km.kernel_spec.argv[0] = sys.executable
        client.execute(env=own)
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number}"
        cell.metadata = {}
    notebook.metadata = {
        "kernelspec": {"name": "python3", "display_name": "Python 3"},
        "language_info": {"name": "python"},
    }
    return notebook


def texts(notebook: nbformat.NotebookNode) -> list[str]:
    """What the cells printed, without what differs from run to run."""
    found = []
    for cell in notebook.cells:
        outputs = cell.get("outputs", ())  # one text a cell: the kernel parts it by its clock
        text = "".join(o["text"] for o in outputs if o.output_type == "stream")
        found += [_DIFFERS.sub("...", text)] if text else []
    return found


if __name__ == "__main__":
    for name in sys.argv[1:] or STORIES:
        nbformat.write(executed(name), FOLDER / f"{name}.ipynb")
        print(FOLDER / f"{name}.ipynb")
