"""COLLADA (DAE): the geometries that a scene places, with the colours of their materials.

Every element on the way from the scene to the numbers is either read or refused; cameras, lights, physics, animations
and effects other than colours are left out. Lengths are in the unit that the file states. The axis that it calls up is
not turned: coordinates are those of the file, as ROS has them.

Source: Khronos Group, COLLADA - Digital Asset Schema Release 1.4.1 (2008) and 1.5.0 (2008).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from problems.base import FloatArray
from problems.geometry.mesh_files.dae_geometry import WITHOUT_SURFACE, Polygons, polygons_of
from problems.geometry.mesh_files.dae_xml import Document, Element, known_only, numbers, only, shown
from problems.geometry.mesh_files.faces import MOST_TRIANGLES, Content, Part, part_of, refused

MOST_NODES = 20_000  # in the scene, one in each place
DEEPEST = 100  # nodes in nodes
LEFT_OUT = {"asset", "extra", "instance_camera", "instance_light"}
UNREAD_TRANSFORMS = {"lookat", "skew"}
PLACED = {"node", "instance_node", "instance_geometry"}
LEAST_AXIS = 1e-100  # axis whose direction is computed without underflow
WHITE = "#ffffff"  # of a material without a plain colour, as of a picture


def read_dae(content: bytes) -> Content:
    """The polygons of a DAE file, placed as its scene says, m.

    Raises:
        InvalidProblem: ``mesh`` is no COLLADA, is broken, or has an element above its polygons that is not read.
    """
    document = Document.of(content)
    unit, up = _unit_and_axis(document)
    geometries: dict[Element, list[Polygons]] = {}
    parts: list[Part] = []
    triangles = 0
    for instance, pose in _instances(document, np.diag([unit, unit, unit, 1.0])):
        geometry = document.target(instance, "url", "geometry")
        known_only(instance, {"bind_material", "extra"})
        if geometry not in geometries:
            geometries[geometry] = polygons_of(document, geometry)
        for polygons in geometries[geometry]:
            triangles += len(polygons.corners) - 2 * len(polygons.counts)
            if triangles > MOST_TRIANGLES:
                raise refused(f"its scene has more than {MOST_TRIANGLES} triangles")
            parts.append(_placed(polygons, pose, shown(geometry), _colour(document, instance, polygons.material)))
    return Content(tuple(parts), tuple(_notes(document, geometries, unit)), up)


def _placed(polygons: Polygons, pose: FloatArray, name: str, colour: str) -> Part:
    with np.errstate(over="ignore", invalid="ignore"):
        places = polygons.places @ pose[:3, :3].T + pose[:3, 3]
    return part_of(places, polygons.corners, polygons.counts, lambda number: f"{name}: polygon {number}", colour)


def _notes(document: Document, geometries: dict[Element, list[Polygons]], unit: float) -> Iterator[str]:
    """Notes on what was left out or converted, which some might not expect."""
    if unit != 1.0:
        yield f"is in a unit of {unit:g} m, as it says: its lengths are converted"
    if any(element.tag in WITHOUT_SURFACE for geometry in geometries for element in geometry.iter()):
        yield "has lines, which have no surface and are left out"
    away = [element for element in document.root.iter("geometry") if element not in geometries]
    if away:
        yield f"has geometries that its scene places nowhere and that are left out, {shown(away[0])} first"


def _unit_and_axis(document: Document) -> tuple[float, str]:
    """The length of the document's unit in m, and the axis that it calls up, the same in all its parts."""
    units = {element.get("meter", "1") for element in document.root.findall("asset/unit")}
    axes = {(element.text or "").strip() for element in document.root.findall("asset/up_axis")}
    unit, axis = next(iter(units), "1"), next(iter(axes), "Y_UP")
    for asset in document.root.iter("asset"):
        units |= {element.get("meter", "1") for element in asset.findall("unit")}
        axes |= {(element.text or "").strip() for element in asset.findall("up_axis")}
    try:
        meter = float(unit)
    except ValueError:
        meter = 0.0
    meter = 0.0 if "_" in unit else meter
    if len(units - {unit}) or len(axes - {axis}):
        raise refused("<asset>: parts of it state another unit or another axis that is up")
    if not 0.0 < meter < np.inf or axis not in ("X_UP", "Y_UP", "Z_UP"):
        raise refused(f"<asset>: the unit {unit[:20]!r} or the axis {axis[:20]!r} is none")
    return meter, axis[0]


def _instances(document: Document, pose: FloatArray) -> Iterator[tuple[Element, FloatArray]]:
    """Instances of geometries in the scene, with their poses (4, 4)."""
    scene = only(document.root, "scene")
    known_only(scene, {"instance_visual_scene", "extra"})
    visual = document.target(only(scene, "instance_visual_scene"), "url", "visual_scene")
    known_only(visual, {"node", "asset", "extra", "evaluate_scene"})
    waiting = [(node, pose, "", 1) for node in reversed(visual.findall("node"))]
    seen = 0
    while waiting:
        element, pose, unread, depth = waiting.pop()
        seen += 1
        if seen > MOST_NODES or depth > DEEPEST:
            raise refused(f"{shown(element)}: more than {MOST_NODES} nodes, or {DEEPEST} in each other")
        if element.tag == "instance_geometry":
            if unread:
                raise refused(f"{shown(element)}: <{unread}> above it is not read")
            yield element, pose
            continue
        if element.tag == "instance_node":
            known_only(element, {"extra"})
            waiting.append((document.target(element, "url", "node"), pose, unread, depth + 1))
            continue
        known_only(element, PLACED | LEFT_OUT | UNREAD_TRANSFORMS | TRANSFORMS.keys())
        unread = next((child.tag for child in element if child.tag in UNREAD_TRANSFORMS), unread)
        for child in element:
            pose = pose @ TRANSFORMS[child.tag](child) if child.tag in TRANSFORMS else pose
        inside = [child for child in element if child.tag in PLACED]
        waiting += [(child, pose, unread, depth + 1) for child in reversed(inside)]


def _matrix(element: Element) -> FloatArray:
    matrix = np.array(numbers(element, float, 16)).reshape(4, 4)
    if matrix[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        raise refused(f"{shown(element)}: its last row is not 0 0 0 1")
    return matrix


def _translation(element: Element) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, 3] = numbers(element, float, 3)
    return matrix


def _scaling(element: Element) -> FloatArray:
    return np.diag([*numbers(element, float, 3), 1.0])


def _rotation(element: Element) -> FloatArray:
    """The pose of a turn about an axis by an angle in degrees (Rodrigues)."""
    *axis, degrees = numbers(element, float, 4)
    length = float(np.linalg.norm(axis))
    if not LEAST_AXIS < length < np.inf or not np.isfinite(degrees):
        raise refused(f"{shown(element)}: its axis has no length, or its angle is none")
    x, y, z = np.array(axis) / length
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix, angle = np.eye(4), np.radians(degrees % 360.0)
    matrix[:3, :3] += np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
    return matrix


TRANSFORMS = {"matrix": _matrix, "translate": _translation, "rotate": _rotation, "scale": _scaling}


def _colour(document: Document, instance: Element, symbol: str) -> str:
    """The colour of the material that an instance binds to a symbol; empty where there is none."""
    path = "bind_material/technique_common/instance_material"
    names = [element.get("target", "") for element in instance.findall(path) if element.get("symbol") == symbol]
    material = _of_id(document, "material", names)
    if material is None:
        return ""
    effect = _of_id(document, "effect", [element.get("url", "") for element in material.findall("instance_effect")])
    colours = [] if effect is None else effect.findall("profile_COMMON/technique/*/diffuse/color")
    try:
        levels = [float(word) for word in (colours[0].text or "").split()[:3]]
        red, green, blue = (int(255.0 * min(max(level, 0.0), 1.0) + 0.5) for level in levels)
    except (ValueError, IndexError):
        return WHITE
    return f"#{red:02x}{green:02x}{blue:02x}"


def _of_id(document: Document, tag: str, urls: list[str]) -> Element | None:
    """The first element of a tag with the id in the first of the references, if any."""
    return next((each for each in document.root.iter(tag) if urls[:1] == [f"#{each.get('id', '')}"]), None)
