"""`dftfs schema`: the JSON schema of a file that the program reads."""

import argparse
from pathlib import Path

from dftfs.cli.common import emit
from dftfs.cli.file_schemas import SCHEMAS, schema
from dftfs.files import refuse_existing, to_json, write_text


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("name", nargs="?", choices=SCHEMAS, help="the file; without: all names")
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="file to write it to")
    parser.add_argument("--force", action="store_true", help="overwrite an existing file")


def run(arguments: argparse.Namespace) -> int:
    """Print the schema, write it, or list the names."""
    if arguments.name is None:
        print("\n".join(SCHEMAS))
        return 0
    found = schema(arguments.name)
    if arguments.out is None:
        emit(found, "", as_json=True)
        return 0
    refuse_existing([arguments.out], force=arguments.force)
    print(write_text(arguments.out, to_json(found)))
    return 0
