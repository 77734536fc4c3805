"""Values of `[rig]` from a robot model (MJCF or URDF): inertia, gravity, friction of one joint.

Sources: URDF specification (joint/dynamics, link/inertial); MuJoCo XML reference (joint
damping, inertial, gear of an actuator). Only the link that the joint moves is counted,
not what hangs on it further out.
"""

import difflib
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from rsea_core.errors import RigError

LARGEST_BYTES = 20_000_000


def rig_values(path: str | Path, joint: str | None) -> dict[str, tuple[float, str]]:
    """Key of `[rig]` to (value, where it comes from).

    Raises
    ------
    RigError
        If the file is not a robot model or has no such joint; the message names the nearest.
    """
    path = Path(path)
    try:
        text = path.read_bytes()
    except OSError as problem:
        raise RigError(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    if len(text) > LARGEST_BYTES or b"<!ENTITY" in text:
        raise RigError(f"{path}: is no plain robot model (too large, or with entities)")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as problem:
        raise RigError(f"{path}: is not XML: {problem}") from problem
    if root.tag not in ("mujoco", "robot"):
        raise RigError(f"{path}: <{root.tag}> is neither MJCF (mujoco) nor URDF (robot)")
    is_urdf = root.tag == "robot"
    names = [j.get("name", "") for j in root.iter("joint") if j.get("type") not in ("fixed", "ref")]
    if joint is None and len(names) == 1:
        joint = names[0]
    if joint not in names:
        close = difflib.get_close_matches(str(joint), names, n=3, cutoff=0.0)
        raise RigError(f"{path}: has no joint {joint!r}; nearest: {', '.join(close) or 'none'}")
    try:
        return (_of_urdf if is_urdf else _of_mjcf)(root, joint, path.name)
    except (ValueError, TypeError) as problem:
        raise RigError(f"{path}: joint {joint}: a value is not a number: {problem}") from problem


def _vector(text: str | None, size: int = 3) -> np.ndarray:
    values = np.array([float(v) for v in (text or "").split()] or [0.0] * size)
    if values.size != size or not np.all(np.isfinite(values)):
        raise ValueError(f"{text!r} has not {size} finite numbers")
    return values


def _link(mass: float, centre: np.ndarray, inertia: np.ndarray, axis: np.ndarray, source: str):
    """Mass, distance of its centre from the axis and inertia about the axis."""
    axis = axis / np.linalg.norm(axis)
    lever = centre - axis * float(centre @ axis)
    distance = float(np.linalg.norm(lever))
    about = float(axis @ inertia @ axis) + mass * distance**2
    found = {"load_mass_kg": (mass, source), "load_distance_m": (distance, source)}
    if about > 0.0:
        found["load_inertia_kgm2"] = (about, source)
    return found


def _of_urdf(root, joint: str, file: str) -> dict[str, tuple[float, str]]:
    own = next(j for j in root.findall("joint") if j.get("name") == joint)
    axis = own.find("axis")
    axis_of = _vector(axis.get("xyz")) if axis is not None else np.array([1.0, 0.0, 0.0])
    child = own.find("child").get("link")
    found: dict[str, tuple[float, str]] = {}
    for link in root.findall("link"):
        inertial = link.find("inertial") if link.get("name") == child else None
        if inertial is None:
            continue
        origin, matrix = inertial.find("origin"), inertial.find("inertia")
        centre = _vector(origin.get("xyz")) if origin is not None else np.zeros(3)
        i = {k: float(matrix.get(k, "0")) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
        inertia = np.array([[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]],
                            [i["ixz"], i["iyz"], i["izz"]]])  # fmt: skip
        mass = float(inertial.find("mass").get("value"))
        found |= _link(mass, centre, inertia, axis_of, f"{file}: link {child}")
    dynamics = own.find("dynamics")
    if dynamics is not None and dynamics.get("damping"):
        found["load_viscous_Nms_per_rad"] = (float(dynamics.get("damping")), f"{file}: damping")
    return found


def _of_mjcf(root, joint: str, file: str) -> dict[str, tuple[float, str]]:
    body, own = next(
        (b, j) for b in root.iter("body") for j in b.findall("joint") if j.get("name") == joint
    )
    found: dict[str, tuple[float, str]] = {}
    inertial = body.find("inertial")
    if inertial is not None:
        centre = _vector(inertial.get("pos")) - _vector(own.get("pos"))
        if inertial.get("fullinertia"):
            a, b, c, d, e, f = _vector(inertial.get("fullinertia"), 6)
            inertia = np.array([[a, d, e], [d, b, f], [e, f, c]])
        else:
            inertia = np.diag(_vector(inertial.get("diaginertia")))
        axis = _vector(own.get("axis") or "0 0 1")
        mass = float(inertial.get("mass"))
        found |= _link(mass, centre, inertia, axis, f"{file}: body {body.get('name', '')}")
    if own.get("damping"):
        found["load_viscous_Nms_per_rad"] = (float(own.get("damping")), f"{file}: damping")
    for actuator in root.iter("actuator"):
        for motor in actuator:
            if motor.get("joint") == joint and motor.get("gear"):
                ratio = float(motor.get("gear").split()[0])
                found["gear_ratio"] = (abs(ratio), f"{file}: gear of the actuator")
    return found
