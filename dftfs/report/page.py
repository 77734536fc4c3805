"""The one family of pages: every page is made by one of the templates, with one style.

Colours of figures are variables of the style, so that a page follows the reader's dark mode; a
printed page is always light.
"""

import re
from collections.abc import Iterable

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from dftfs.report.live import library
from dftfs.report.style import DARK, ReportFigure

_COLOUR = re.compile("|".join(DARK), re.IGNORECASE)


def page_environment(**filters) -> Environment:
    """Templates of pages, escaping what they are given; ``symbols`` sets the text of tables."""
    environment = Environment(
        loader=PackageLoader("dftfs.report", "template"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"symbols": escape, "themed": themed} | filters
    return environment


def render_page(
    environment: Environment,
    template: str,
    drawn: Iterable[ReportFigure | None],
    own_style: str = "",
    /,
    **values: object,
) -> str:
    """The HTML of a page with the family's style and the scripts that its figures need.

    Parameters
    ----------
    drawn : iterable of ReportFigure or None
        Every figure of the page.
    own_style : str
        Name of a style sheet beside the family's.
    values : object
        What the template shows.
    """
    source = environment.loader.get_source
    sheets = [source(environment, name)[0] for name in ("style.css", own_style) if name]
    scripts = library([figure for figure in drawn if figure is not None])
    return environment.get_template(template).render(
        style=_variables() + "\n".join(sheets), library=scripts, **values
    )


def themed(svg: str) -> Markup:
    """The markup of a figure with the style's variables in place of its neutral colours."""
    return Markup(_COLOUR.sub(lambda found: f"var({_name(found.group())})", svg))


def _name(colour: str) -> str:
    return f"--figure-{colour.lower().lstrip('#')}"


def _variables() -> str:
    light = "".join(f"{_name(c)}:{c};" for c in DARK)
    dark = "".join(f"{_name(c)}:{d};" for c, d in DARK.items())
    return f":root{{{light}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n"
