"""Geometries of a COLLADA document: places of vertices, and polygons of any primitive that has a surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from problems.geometry.mesh_files.dae_xml import Document, Element, known_only, numbers, only, shown, whole
from problems.geometry.mesh_files.faces import Numbers, refused

WITHOUT_SURFACE = {"lines", "linestrips"}


@dataclass(frozen=True, eq=False)
class Polygons:
    """Polygons of one material, in the unit of the file.

    Attributes:
        places: of vertices, (v, 3).
        corners: numbers of vertices from 0, polygon after polygon, (k,).
        counts: of corners of each polygon, (n,).
        material: the symbol that an instance binds to a material.
    """

    places: FloatArray
    corners: Numbers
    counts: Numbers
    material: str


def polygons_of(document: Document, geometry: Element) -> list[Polygons]:
    """The polygons of a geometry; its lines are left out.

    Raises:
        InvalidProblem: ``mesh`` has something in this geometry that is broken or not read.
    """
    known_only(geometry, {"mesh", "asset", "extra"})
    mesh = only(geometry, "mesh")
    known_only(mesh, {"source", "vertices", "extra", *WITHOUT_SURFACE, *PRIMITIVES})
    return [_polygons(document, primitive) for primitive in mesh if primitive.tag in PRIMITIVES]


def _polygons(document: Document, primitive: Element) -> Polygons:
    known_only(primitive, {"input", "vcount", "p", "extra"})
    inputs = primitive.findall("input")
    of_vertices = [each for each in inputs if each.get("semantic") == "VERTEX"]
    if len(of_vertices) != 1:
        raise refused(f"{shown(primitive)}: one input VERTEX is needed, not {len(of_vertices)}")
    vertices = document.target(of_vertices[0], "source", "vertices")
    positions = [each for each in vertices.findall("input") if each.get("semantic") == "POSITION"]
    if len(positions) != 1:
        raise refused(f"{shown(vertices)}: one input POSITION is needed, not {len(positions)}")
    source = document.target(positions[0], "source", "source")
    if source not in document.places:
        document.places[source] = _places(document, source)
    places = document.places[source]
    stride, offset = 1 + max(whole(each, "offset") for each in inputs), whole(of_vertices[0], "offset")
    lists = []
    for element in primitive.findall("p"):
        indices = numbers(element, int)
        if len(indices) % stride:
            raise refused(f"{shown(primitive)}: {len(indices)} indices are no multiple of its {stride} inputs")
        lists.append(indices[offset::stride])
    corners, counts = PRIMITIVES[primitive.tag](primitive, lists)
    if min(counts, default=3) < 3 or sum(counts) != len(corners):
        raise refused(f"{shown(primitive)}: its corners are not those of whole polygons")
    if primitive.tag != "triangles" and len(primitive.findall("vcount")) != (primitive.tag == "polylist"):
        raise refused(f"{shown(primitive)}: vcount is needed in a polylist, and there alone")
    return Polygons(places, _array(corners), _array(counts), primitive.get("material", ""))


def _array(found: list[int]) -> Numbers:
    return np.array(found, dtype=np.int64)


def _places(document: Document, source: Element) -> FloatArray:
    """Places (v, 3) in a source, as its accessor says."""
    accessor = only(only(source, "technique_common"), "accessor")
    array = document.target(accessor, "source", "float_array")
    values = np.array(numbers(array, float, whole(array, "count")), dtype=np.float64)
    names = [parameter.get("name") for parameter in accessor.findall("param")]
    used = [place for place, name in enumerate(names) if name]
    count, stride, start = whole(accessor, "count"), whole(accessor, "stride", 1), whole(accessor, "offset", 0)
    if [names[place] for place in used] != ["X", "Y", "Z"] or len(names) > stride:
        raise refused(f"{shown(source)}: its parameters are not X, Y, Z")
    if start + count * stride > len(values):
        raise refused(f"{shown(source)}: {len(values)} numbers, too few for {count} places")
    return values[start : start + count * stride].reshape(count, stride)[:, used]


Lists = list[list[int]]


def _counted(primitive: Element, found: int) -> None:
    stated = whole(primitive, "count", found)
    if stated != found:
        raise refused(f"{shown(primitive)}: it counts {stated}, but has {found}")


def _triangles(primitive: Element, lists: Lists) -> tuple[list[int], list[int]]:
    corners = [corner for each in lists for corner in each]
    _counted(primitive, len(corners) // 3)
    return corners, [3] * (len(corners) // 3)


def _polylist(primitive: Element, lists: Lists) -> tuple[list[int], list[int]]:
    counts = [count for element in primitive.findall("vcount") for count in numbers(element, int)]
    _counted(primitive, len(counts))
    return [corner for each in lists for corner in each], counts


def _single_polygons(primitive: Element, lists: Lists) -> tuple[list[int], list[int]]:
    _counted(primitive, len(lists))
    return [corner for each in lists for corner in each], [len(each) for each in lists]


def _strips(primitive: Element, lists: Lists) -> tuple[list[int], list[int]]:
    return _rows(primitive, lists, lambda each, last: each[last - 2 : last + 1][:: -1 if last % 2 else 1])


def _fans(primitive: Element, lists: Lists) -> tuple[list[int], list[int]]:
    return _rows(primitive, lists, lambda each, last: [each[0], each[last - 1], each[last]])


def _rows(
    primitive: Element, lists: Lists, triangle: Callable[[list[int], int], list[int]]
) -> tuple[list[int], list[int]]:
    """Numbers of the corners of triangles, each given by the place of its last corner."""
    _counted(primitive, len(lists))
    if min(map(len, lists), default=3) < 3:
        raise refused(f"{shown(primitive)}: three corners are needed")
    corners = [corner for each in lists for last in range(2, len(each)) for corner in triangle(each, last)]
    return corners, [3] * (len(corners) // 3)


PRIMITIVES = {
    "triangles": _triangles,
    "polylist": _polylist,
    "polygons": _single_polygons,
    "tristrips": _strips,
    "trifans": _fans,
}
