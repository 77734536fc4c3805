"""Where tests find the project's own files, and recordings that are no part of it."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# beside the checkout, or beside the folder that holds several working trees of it
_PLACES = [folder / "shared" / "data" for folder in (ROOT.parent, ROOT.parents[1])]
SHARED_DATA = next((folder for folder in _PLACES if folder.is_dir()), _PLACES[0])
