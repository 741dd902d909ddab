"""Snapshots as files that ParaView opens: PolyData in XML, and a collection over time.

The format is that of "VTK File Formats", XML: arrays in base64, each after its length in bytes.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from calibrator.files import write_text

TYPES = {"<f4": "Float32", "<i4": "Int32"}


def spheres(centres: np.ndarray, fields: Mapping[str, np.ndarray]) -> str:
    """Text of a .vtp file of points (n, 3) [m] with a number each (n,) by name."""
    ends = np.arange(1, len(centres) + 1)
    return _poly_data("Verts", centres, ends - 1, ends, fields)


def triangles(corners: np.ndarray) -> str:
    """Text of a .vtp file of triangles (m, 3, 3) [m]."""
    points = corners.reshape(-1, 3)
    ends = 3 * np.arange(1, len(corners) + 1)
    return _poly_data("Polys", points, np.arange(len(points)), ends, {})


def write_collection(path: Path, times: Sequence[float], files: Sequence[str]) -> None:
    """Write a .pvd file: what there is to be seen at each time [s], relative to its folder."""
    rows = "\n".join(
        f'<DataSet timestep="{time!r}" part="0" file={quoteattr(file)}/>'
        for time, file in zip(times, files, strict=True)
    )
    write_text(path, _file("Collection", f"<Collection>\n{rows}\n</Collection>"))


def _poly_data(
    kind: str,
    points: np.ndarray,
    corners: np.ndarray,
    ends: np.ndarray,
    fields: Mapping[str, np.ndarray],
) -> str:
    """PolyData of one kind of cells; ends : where each one's corners end."""
    own = "\n".join(_array(name, values) for name, values in fields.items())
    piece = (
        f'<PolyData>\n<Piece NumberOfPoints="{len(points)}" NumberOf{kind}="{len(ends)}">\n'
        f"<PointData>\n{own}\n</PointData>\n"
        f"<Points>\n{_array('Points', points)}\n</Points>\n"
        f"<{kind}>\n{_array('connectivity', corners)}\n{_array('offsets', ends)}\n</{kind}>\n"
        "</Piece>\n</PolyData>"
    )
    return _file("PolyData", piece)


def _array(name: str, values: np.ndarray) -> str:
    """One array; integers stay integers."""
    kind = "<i4" if values.dtype.kind == "i" else "<f4"
    raw = values.astype(kind).tobytes()
    text = base64.b64encode(len(raw).to_bytes(4, "little") + raw).decode()
    parts = f' NumberOfComponents="{values.shape[1]}"' if values.ndim == 2 else ""
    return (
        f'<DataArray type="{TYPES[kind]}" Name="{name}"{parts} format="binary">{text}</DataArray>'
    )


def _file(kind: str, body: str) -> str:
    head = f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt32">'
    return f'<?xml version="1.0"?>\n{head}\n{body}\n</VTKFile>\n'
