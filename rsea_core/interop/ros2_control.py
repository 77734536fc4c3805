"""A deployed law as a skeleton of a ros2_control controller plugin (ROS 2 Humble and Jazzy).

The package holds the law's own C headers and one class that calls the guard in `update`; its
README says what it leaves to the hardware's plugin. The interface is ros2_control's
`controller_interface::ControllerInterface` (https://control.ros.org, "Writing a new controller").
"""

import re
from collections.abc import Mapping

from rsea_core.control.c_header import c_name, template
from rsea_core.control.laws.base import Controller

INTERFACES = {
    "duty": "duty",
    "voltage_V": "voltage",
    "current_command_A": "current",
    "motor_torque_Nm": "effort",
}
FILES = {
    "controller.cpp": "src/controller.cpp",
    "CMakeLists.txt": "CMakeLists.txt",
    "package.xml": "package.xml",
    "plugin.xml": "plugin.xml",
    "controllers.yaml": "config/controllers.yaml",
    "README.md": "README.md",
}


def ros2_package(
    controller: Controller,
    command_name: str,
    headers: Mapping[str, str],
    *,
    name: str,
    real: str = "double",
) -> dict[str, str]:
    """Texts by their paths in the package's folder NAME_ros2.

    Parameters
    ----------
    command_name : str
        What the law answers.
    headers : mapping
        Texts of `deployment`, of which NAME.h and NAME_guard.h go along.
    real : "double" or "float"
        Of the headers.
    """
    stem = c_name(name)
    replacements = {
        "STEM": stem,
        "PERIOD_s": repr(float(controller.sample_time_s)),
        "RATE": f"{1.0 / controller.sample_time_s:.10g}",
        "COMMAND_NAME": command_name,
        "COMMAND_INTERFACE": INTERFACES.get(command_name, command_name),
        "REFERENCE_NAME": controller.reference_name,
        "LATE": str(controller.delay_samples),
        "REAL": real,
    }
    found = {
        f"{stem}_ros2/{path}": _filled(template(file, "ros2"), replacements, stem)
        for file, path in FILES.items()
    }
    for header in (f"{stem}.h", f"{stem}_guard.h"):
        found[f"{stem}_ros2/include/{header}"] = headers[header]
    return found


def _filled(text: str, replacements: Mapping[str, str], prefix: str) -> str:
    for name in sorted(replacements, key=len, reverse=True):
        text = text.replace(name, replacements[name])
    return re.sub(r"\brsea_(?!core)", f"{prefix}_", text)
