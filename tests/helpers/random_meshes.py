"""Random bodies, and legal ways in which OBJ, STL and DAE files may state them."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

Array = np.ndarray
Rng = np.random.Generator
L_SHAPE = np.array([[0.5, 0.5], [0.5, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 0.5]])  # the inner corner first


@dataclass(frozen=True, eq=False)
class Body:
    """Places of vertices (v, 3), and polygons of them, counter-clockwise from outside, fans of which are exact."""

    places: Array
    polygons: list[list[int]]

    @property
    def triangles(self) -> Array:
        """The fans, (n, 3, 3)."""
        fans = [[ring[0], ring[i], ring[i + 1]] for ring in self.polygons for i in range(1, len(ring) - 1)]
        return self.places[np.array(fans)]


def bodies(rng: Rng, concave: bool = True) -> list[Body]:
    """One to four prisms, turned and apart, rounded to single precision."""
    return [_prism(rng, concave) for _ in range(rng.integers(1, 5))]


def _prism(rng: Rng, concave: bool) -> Body:
    count = int(rng.integers(3, 8))
    turn = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    ring = L_SHAPE if concave and rng.random() < 0.3 else np.column_stack([np.cos(turn), np.sin(turn)])
    count = len(ring)
    ends = [np.column_stack([ring, np.full(count, end)]) for end in (0.0, rng.uniform(0.2, 2.0))]
    places = Rotation.random(rng=rng).apply(np.concatenate(ends) * rng.uniform(0.02, 0.4)) + rng.uniform(-2.0, 2.0, 3)
    sides = [[i, (i + 1) % count, (i + 1) % count + count, i + count] for i in range(count)]
    caps = [[0, *range(count - 1, 0, -1)], list(range(count, 2 * count))]
    return Body(places.astype(np.float32).astype(np.float64), [*caps, *sides])


def turned(rng: Rng, ring: list[int]) -> list[int]:
    """The same polygon from another corner, where all fans are exact."""
    start = int(rng.integers(len(ring))) if len(ring) == 4 else 0
    return ring[start:] + ring[:start]


def numbers(values: Array) -> str:
    """Their shortest exact texts."""
    return " ".join(repr(float(value)) for value in np.ravel(values))


# OBJ


def obj_of(rng: Rng, parts: list[Body], plain: bool) -> bytes:
    """Relative and absolute numbers, tabs and spaces, textures and normals, lines that go on, groups, lines and points.

    Assimp loses lines that begin with a space, and those after comments that end with a backslash, and its binding
    knows no lines and points: ``plain`` has none.
    """
    end = str(rng.choice(["\n", "\r\n"]))
    lines = ["# made at random" + " \\" * (not plain), "mtllib none.mtl"]
    known = 0
    late: list[str] = []
    for number, body in enumerate(parts):
        lines += [str(rng.choice(["o part f 1 2 3", "g a b", "s off", "usemtl v", "", "  # f 1 2 3"]))]
        colours = rng.random() < 0.2
        lines += [
            _obj_line(rng, plain, "v", [*numbers(place).split(), *["0.5"] * (3 * colours)]) for place in body.places
        ]
        lines += ["vn 0 0 1", "vt 0.5 0.5 0", "vt 0.25 0.5"]
        known += len(body.places)
        relative, form = rng.random() < 0.5, str(rng.choice(["{}", "{}/1", "{}//1", "{}/2/1"]))
        faces = []
        for ring in body.polygons:
            shift = -len(body.places) if relative else known - len(body.places) + 1
            faces.append(_obj_line(rng, plain, "f", [form.format(corner + shift) for corner in turned(rng, ring)]))
        lines += ["l 1 2 3", "p 1"] if not plain and rng.random() < 0.2 else []
        late += faces if not relative and number == 0 and rng.random() < 0.3 else []
        lines += [] if late and number == 0 else faces
    return end.join([*lines, *late, ""]).replace("\n", end).replace("\r\r\n", "\r\n").encode()


def _obj_line(rng: Rng, plain: bool, kind: str, words: list[str]) -> str:
    gap = str(rng.choice([" ", "\t", "  ", " \t"]))
    if rng.random() < 0.05:
        words = [*words[:2], "\\\n", *words[2:]]
    return (
        ("" if plain else str(rng.choice(["", " ", "\t"])))
        + gap.join([kind, *words])
        + str(rng.choice(["", " ", "\t"]))
    )


# STL


def stl_of(rng: Rng, parts: list[Body], plain: bool) -> bytes:
    """Binary with any head, or text: several solids with odd names, with odd spaces; in capitals unless ``plain``.

    Assimp reads no text in capitals.
    """
    triangles = np.concatenate([body.triangles for body in parts])
    if rng.random() < 0.4:
        head = [b"solid vertex 1 2 3", b"\0", b"exported", b"SOLID facet normal"][rng.integers(4)]
        records = b"".join(struct.pack("<12fH", 0, 0, 0, *np.ravel(three), 7) for three in triangles)
        return head.ljust(80, b" ") + struct.pack("<I", len(triangles)) + records
    end, inset = str(rng.choice(["\n", "\r\n"])), str(rng.choice(["", "  ", "\t"]))
    lines: list[str] = []
    for body in parts:
        name = str(rng.choice(["", " part", " vertex group 1", " Solid of endloop", " facet 5"]))
        lines += [f"solid{name}"]
        for three in body.triangles:
            lines += ["facet normal 0 0 0", f"{inset}outer loop"]
            lines += [f"{2 * inset}vertex  {numbers(place)}" for place in three]
            lines += [f"{inset}endloop", "endfacet"]
        lines += [str(rng.choice(["endsolid", f"endsolid{name}"])), ""]
    text = end.join(lines)
    return (text if plain or rng.random() < 0.5 else text.upper()).encode()


# DAE


def dae_of(rng: Rng, parts: list[Body], plain: bool) -> bytes:
    """Every primitive, transformation and way to place a geometry; units, odd accessors, several inputs.

    Assimp reads all of it; what is not ``plain`` is indented.
    """
    unit = float(rng.choice([1.0, 0.001, 0.0254]))
    geometries, nodes, library = [], [], []
    for number, body in enumerate(parts):
        pose, transforms = _transforms(rng)
        local = np.linalg.solve(pose, np.column_stack([body.places / unit, np.ones(len(body.places))]).T).T[:, :3]
        geometries.append(_geometry(rng, f"g{number}", local, body.polygons))
        instance = f'<instance_geometry url="#g{number}"/>'
        if rng.random() < 0.3:
            library.append(f'<node id="n{number}">{instance}</node>')
            instance = f'<instance_node url="#n{number}"/>'
        for transform in reversed(transforms):
            instance = f"<node>{transform}{instance}</node>" if rng.random() < 0.3 else f"{transform}{instance}"
        nodes.append(f'<node name="a &amp; b"><extra/>{instance}</node>')
    text = f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2020-01-01T00:00:00</created><unit name="u" meter="{unit}"/><up_axis>Z_UP</up_axis></asset>
<library_geometries>{"".join(geometries)}</library_geometries>
<library_nodes>{"".join(library)}</library_nodes>
<library_visual_scenes><visual_scene id="s">{"".join(nodes)}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
    return (text if plain else text.replace("> ", ">\n  ").replace("><", ">\n\t<")).encode()


def _transforms(rng: Rng) -> tuple[Array, list[str]]:
    """A pose (4, 4), and the elements that state it, outermost first."""
    pose, elements = np.eye(4), []
    for _ in range(rng.integers(0, 4)):
        one = np.eye(4)
        kind = rng.integers(4)
        if kind == 0:
            one[:3, 3] = rng.uniform(-1.0, 1.0, 3)
            elements.append(f"<translate>{numbers(one[:3, 3])}</translate>")
        elif kind == 1:
            axis, degrees = rng.normal(size=3), rng.uniform(-400.0, 400.0)
            axis /= np.linalg.norm(axis)
            one[:3, :3] = Rotation.from_rotvec(np.radians(degrees) * axis).as_matrix()
            elements.append(f"<rotate>{numbers(axis)} {degrees!r}</rotate>")
        elif kind == 2:
            one[:3, :3] = np.diag(rng.uniform(0.5, 2.0, 3))
            elements.append(f"<scale>{numbers(one.diagonal()[:3])}</scale>")
        else:
            one[:3, :3] = Rotation.random(rng=rng).as_matrix() * rng.uniform(0.5, 2.0)
            one[:3, 3] = rng.uniform(-1.0, 1.0, 3)
            elements.append(f"<matrix>{numbers(one)}</matrix>")
        pose = pose @ one
    return pose, elements


def _geometry(rng: Rng, name: str, places: Array, polygons: list[list[int]]) -> str:
    offset, stride = int(rng.integers(0, 3)), int(rng.integers(3, 5))
    table = np.zeros((len(places), stride))
    table[:, :3] = places
    values = np.concatenate([np.full(offset, 9.0), table.ravel()])
    kinds: list[Callable[[Rng, str, list[list[int]]], str]] = [_triangles, _polylist, _polygons, _trifans, _tristrips]
    chosen = rng.permutation(len(polygons))
    split = int(rng.integers(0, len(polygons)))
    groups = [[polygons[i] for i in group] for group in (chosen[:split], chosen[split:])]
    primitives = "".join(kinds[rng.integers(len(kinds))](rng, name, group) for group in groups)
    skipped = '<param type="float"/>' * (stride - 3)
    return f"""<geometry id="{name}"><mesh><source id="{name}-p">
<float_array id="{name}-a" count="{len(values)}">{numbers(values)}</float_array>
<technique_common><accessor source="#{name}-a" count="{len(places)}" stride="{stride}" offset="{offset}">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>{skipped}
</accessor></technique_common></source>
<vertices id="{name}-v"><input semantic="POSITION" source="#{name}-p"/></vertices>{primitives}</mesh></geometry>"""


def _primitive(rng: Rng, name: str, kind: str, lists: list[list[int]], count: int, more: str = "") -> str:
    stride, place = (2, int(rng.integers(2))) if rng.random() < 0.5 else (1, 0)
    inputs = f'<input semantic="VERTEX" source="#{name}-v" offset="{place}"/>'
    if stride == 2:
        inputs += f'<input semantic="NORMAL" source="#{name}-p" offset="{1 - place}"/>'
    indices = ""
    for each in lists:
        rows = np.zeros((len(each), stride), dtype=int)
        rows[:, place] = each
        indices += f"<p>{' '.join(map(str, rows.ravel()))}</p>"
    return f'<{kind} count="{count}">{inputs}{more}{indices}</{kind}>'


def _fans_of(rings: list[list[int]]) -> list[list[int]]:
    return [[ring[0], ring[i], ring[i + 1]] for ring in rings for i in range(1, len(ring) - 1)]


def _triangles(rng: Rng, name: str, rings: list[list[int]]) -> str:
    fans = _fans_of(rings)
    return _primitive(rng, name, "triangles", [[corner for three in fans for corner in three]], len(fans))


def _polylist(rng: Rng, name: str, rings: list[list[int]]) -> str:
    lists = [turned(rng, ring) for ring in rings]
    counts = f"<vcount>{' '.join(str(len(ring)) for ring in rings)}</vcount>"
    return _primitive(rng, name, "polylist", [[corner for ring in lists for corner in ring]], len(rings), counts)


def _polygons(rng: Rng, name: str, rings: list[list[int]]) -> str:
    return _primitive(rng, name, "polygons", [turned(rng, ring) for ring in rings], len(rings))


def _trifans(rng: Rng, name: str, rings: list[list[int]]) -> str:
    return _primitive(rng, name, "trifans", rings, len(rings))


def _tristrips(rng: Rng, name: str, rings: list[list[int]]) -> str:
    """Strips of four corners for quadrilaterals, of three for the triangles of others."""
    whole = [[ring[0], ring[1], ring[3], ring[2]] for ring in rings if len(ring) == 4]
    lists = whole + _fans_of([ring for ring in rings if len(ring) != 4])
    return _primitive(rng, name, "tristrips", lists, len(lists))


WRITERS: dict[str, Callable[[Rng, list[Body], bool], bytes]] = {"obj": obj_of, "stl": stl_of, "dae": dae_of}
