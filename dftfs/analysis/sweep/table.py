"""A sweep's rows as files: CSV for people and spreadsheets, Parquet with types and units."""

import csv
import importlib
import importlib.util
import io

from dftfs.analysis.sweep.run import SweepResult
from dftfs.errors import DesignError

# the longest ending that fits is a column's unit
_UNITS = {
    "_Nm_per_rad": "Nm/rad",
    "_percent": "%",
    "_rad": "rad",
    "_deg": "deg",
    "_Nm": "Nm",
    "_mm": "mm",
    "_kg": "kg",
    "_Pa": "Pa",
}


def unit_of(column: str) -> str:
    """The unit that ends a column's name, "1" where none does."""
    fitting = [ending for ending in _UNITS if column.endswith(ending)]
    return _UNITS[max(fitting, key=len)] if fitting else "1"


def csv_text(result: SweepResult) -> str:
    """The table as CSV: numbers to the last bit, nothing where there is no value."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(result.columns)
    for row in result.rows:
        values = (row[name] for name in result.columns)
        writer.writerow(
            ["" if v is None else repr(v) if isinstance(v, float) else v for v in values]
        )
    return text.getvalue()


def parquet_bytes(result: SweepResult) -> bytes:
    """The table as a Parquet file with a unit per column.

    A varied field with numbers and words in it is kept as text.

    Raises
    ------
    DesignError
        If pyarrow is not installed (extra "interop").
    """
    try:
        pa = importlib.import_module("pyarrow")
        parquet = importlib.import_module("pyarrow.parquet")
    except ImportError:
        raise DesignError("Parquet needs pyarrow: pip install 'dftfs[interop]'") from None
    arrays, fields = [], []
    for name in result.columns:
        values = [row[name] for row in result.rows]
        if any(isinstance(value, str) for value in values):
            values = [None if value is None else str(value) for value in values]
        array = pa.array(values, type=pa.float64() if all(v is None for v in values) else None)
        arrays.append(array)
        fields.append(pa.field(name, array.type, metadata={"unit": unit_of(name)}))
    table = pa.Table.from_arrays(arrays, schema=pa.schema(fields))
    buffer = pa.BufferOutputStream()
    parquet.write_table(table, buffer)
    return buffer.getvalue().to_pybytes()


def has_parquet() -> bool:
    """Whether pyarrow is there."""
    return importlib.util.find_spec("pyarrow") is not None
