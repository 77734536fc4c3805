"""`dftfs predict`: sensor readings that the diagnosed machine will give under new inputs."""

import argparse
from pathlib import Path

from dftfs.cli.common import progress
from dftfs.cli.own_effects import add_effects, load_own_effects
from dftfs.files import OutputError, prepare_folder, refuse_existing
from rsea_core.identify.result.corrected_model import FoundModel, write_prediction
from rsea_core.recordings.case import read_test


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("model", type=Path, metavar="MODEL.toml")
    parser.add_argument("test", type=Path, metavar="TEST", help="folder with a test.toml")
    add_effects(parser)
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("prediction.csv"),
        metavar="CSV",
        help="file to write (default prediction.csv)",
    )
    parser.add_argument("--force", action="store_true", help="overwrite existing files")


def run(arguments: argparse.Namespace) -> int:
    """Predict every test recording; further ones get their number in the name."""
    if arguments.out.is_dir():
        raise OutputError(f"--out {arguments.out}: is a folder; name a CSV file")
    load_own_effects(arguments, progress())
    model = FoundModel.from_toml(arguments.model)
    tests = read_test(arguments.test, model.rig)
    prepare_folder(arguments.out.parent)
    out = arguments.out
    more = [out.with_name(f"{out.stem}-{k}{out.suffix}") for k in range(2, len(tests) + 1)]
    refuse_existing([out, *more], force=arguments.force)
    for test, path in zip(tests, [out, *more], strict=True):
        print(write_prediction(model, test, path))
    return 0
