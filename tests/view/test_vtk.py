"""What ParaView is given can be read back, to the number."""

import base64
from xml.etree import ElementTree

import numpy as np

from calibrator.view import vtk

KINDS = {"Float32": "<f4", "Int32": "<i4"}


def array(node):
    """A DataArray as its attributes say that it is to be read."""
    raw = base64.b64decode(node.text)
    assert int.from_bytes(raw[:4], "little") == len(raw) - 4
    values = np.frombuffer(raw[4:], KINDS[node.get("type")])
    return values.reshape(-1, int(node.get("NumberOfComponents", 1)))


def poly_data(text):
    """Points, fields, and connectivity and offsets of the cells, of a .vtp file."""
    root = ElementTree.fromstring(text)
    assert (root.get("type"), root.get("byte_order")) == ("PolyData", "LittleEndian")
    assert root.get("header_type") == "UInt32"
    (piece,) = root.iter("Piece")
    points = array(piece.find("Points/DataArray"))
    assert int(piece.get("NumberOfPoints")) == len(points)
    fields = {n.get("Name"): array(n)[:, 0] for n in piece.find("PointData")}
    kind = "Verts" if piece.find("Verts") is not None else "Polys"
    cells = {n.get("Name"): array(n)[:, 0] for n in piece.find(kind)}
    assert int(piece.get(f"NumberOf{kind}")) == len(cells["offsets"])
    return points, fields, cells


def test_spheres_come_back_with_their_numbers():
    drawn = np.random.default_rng(1)
    centres, radii = drawn.normal(size=(7, 3)), drawn.random(7)
    text = vtk.spheres(centres, {"radius": radii, "grain": np.arange(7) + 2**24 + 1})
    points, fields, cells = poly_data(text)
    np.testing.assert_array_equal(points, centres.astype("f4"))
    np.testing.assert_array_equal(fields["radius"], radii.astype("f4"))
    np.testing.assert_array_equal(fields["grain"], np.arange(7) + 2**24 + 1)  # no float holds them
    np.testing.assert_array_equal(cells["connectivity"], np.arange(7))
    np.testing.assert_array_equal(cells["offsets"], np.arange(7) + 1)


def test_triangles_come_back_corner_by_corner():
    corners = np.random.default_rng(1).normal(size=(4, 3, 3))
    points, _, cells = poly_data(vtk.triangles(corners))
    np.testing.assert_array_equal(
        points[cells["connectivity"]].reshape(4, 3, 3), corners.astype("f4")
    )
    np.testing.assert_array_equal(cells["offsets"], [3, 6, 9, 12])


def test_a_scene_without_grains_or_walls_is_a_file_all_the_same():
    assert len(poly_data(vtk.spheres(np.empty((0, 3)), {"radius": np.empty(0)}))[0]) == 0
    assert len(poly_data(vtk.triangles(np.empty((0, 3, 3))))[0]) == 0


def test_a_collection_names_a_file_for_each_time(tmp_path):
    vtk.write_collection(tmp_path / "a.pvd", [0.1, 1 / 3], ["x & y.vtp", "z.vtp"])
    root = ElementTree.fromstring((tmp_path / "a.pvd").read_text())
    rows = [(float(n.get("timestep")), n.get("file")) for n in root.iter("DataSet")]
    assert rows == [(0.1, "x & y.vtp"), (1 / 3, "z.vtp")] and root.get("type") == "Collection"
