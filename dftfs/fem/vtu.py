"""Meshes with nodal fields as VTK files, one a step, and the collection that orders them.

The node orders of VTK's quadratic quadrilateral and hexahedron are the mesh's own. Arrays are
written inline in base64, as VTK's XML format states (`vtkXMLUnstructuredGridReader`; "VTK File
Formats", Kitware): a count of bytes in 32 bits, then the values.
"""

import base64
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.mesh import TaggedMesh

_CELL_TYPE = {2: 23, 3: 25}
_TYPES = {"float64": "Float64", "float32": "Float32", "int32": "Int32", "uint8": "UInt8"}


def vtu_text(mesh: TaggedMesh, fields: Mapping[str, NDArray]) -> str:
    """An unstructured grid with fields at its nodes, (n,) or (n, dim); planar ones get z = 0."""
    count, width = mesh.cells.shape
    points = [_array("Points", _in_space(mesh.nodes))]
    cells = [
        _array("connectivity", mesh.cells.ravel().astype(np.int32)),
        _array("offsets", (width * np.arange(1, count + 1)).astype(np.int32)),
        _array("types", np.full(count, _CELL_TYPE[mesh.dim], dtype=np.uint8)),
    ]
    data = [
        _array(name, (_in_space(values) if values.ndim == 2 else values).astype(np.float32))
        for name, values in fields.items()
    ]
    return "\n".join(
        [
            '<?xml version="1.0"?>',
            '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">',
            f'<UnstructuredGrid><Piece NumberOfPoints="{len(mesh.nodes)}" NumberOfCells="{count}">',
            "<Points>",
            *points,
            "</Points><Cells>",
            *cells,
            "</Cells><PointData>",
            *data,
            "</PointData></Piece></UnstructuredGrid></VTKFile>\n",
        ]
    )


def pvd_text(steps: Sequence[tuple[float, str]]) -> str:
    """The collection of step files: (value of the step, name of its file)."""
    rows = [f'<DataSet timestep="{value!r}" file="{name}"/>' for value, name in steps]
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1"><Collection>'
    return "\n".join([head, *rows, "</Collection></VTKFile>\n"])


def _in_space(values: NDArray) -> NDArray:
    flat = np.zeros((len(values), 3))
    flat[:, : values.shape[1]] = values
    return flat


def _array(name: str, values: NDArray) -> str:
    raw = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<"), copy=False).tobytes()
    parts = 1 if values.ndim == 1 else values.shape[1]
    text = base64.b64encode(np.array([len(raw)], dtype="<u4").tobytes() + raw).decode()
    return (
        f'<DataArray type="{_TYPES[values.dtype.name]}" Name="{name}" format="binary"'
        f' NumberOfComponents="{parts}">{text}</DataArray>'
    )
