"""A page's name and what it is about enter, the page as HTML leaves: no script and no style stands in it.

Every text comes through Jinja's escaping, whoever wrote it: a text with a script in it is shown as that text. What the
browser's modules say (the words of the interface) stands in a block of JSON, which is not run.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ratherthan.apps.study.pages.wording import in_browser, spoken, words

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["STATIC", "render", "static"]

HERE = Path(__file__).parent
STATIC = HERE / "static"
ABOUT = ("title", "language", "contact", "simulated", "words")


def render(page: str, study: object, **context: Any) -> str:
    """Return a page of a study.

    Parameters
    ----------
    page : str
        One of the files in templates/: ``entry.html``, ``withdraw.html``, ``message.html``, ``login.html``,
        ``monitor.html``, ``export.html``, ``erase.html``. What each needs is listed in docs/study/pages.md.
    study : object
        A mapping, or anything with attributes: ``title``, ``language``, ``contact``, ``simulated``, and ``words``, which
        are words of the design in place of the interface's own. All but the title may be missing.
    **context
        What the page is about.

    Returns
    -------
    str
        HTML.
    """
    about = {name: found for name in ABOUT if (found := _part(study, name)) is not None}
    language = about.setdefault("language", "en")
    texts = words(language, about.get("words"))

    def say(key: str, /, **parts: object) -> str:
        """Return the words of a key, with what stands in braces filled in; the key itself where it has none."""
        text = texts.get(key, key)
        for name, part in parts.items():
            text = text.replace("{" + name + "}", str(part))
        return text

    def sentence(key: str, of: str) -> str:
        """Return the words of ``of-key``, or `key`, which is a sentence itself, where there are none."""
        return texts.get(f"{of}-{key}", key)

    given = {
        "study": {"contact": "", "simulated": False, **about},
        "say": say,
        "sentence": sentence,
        "browser": {key: texts[key] for key in in_browser()},
        "direction": texts["direction"],
        "speaks": spoken(language),
        "static": static,
        "preview": False,
    }
    return _environment().get_template(page).render({**given, **context, "study": given["study"]})


@cache
def static(name: str) -> str:
    """Return the address of a file, which changes when its bytes do.

    Parameters
    ----------
    name : str
        The name of a file in static/.

    Returns
    -------
    str
        Such as ``/static/style.css?v=0123456789ab``.
    """
    return f"/static/{name}?v={sha256((STATIC / name).read_bytes()).hexdigest()[:12]}"


def _part(study: object, name: str) -> Any:
    """Return what `study` says under a name, None where it says nothing."""
    return study.get(name) if isinstance(study, Mapping) else getattr(study, name, None)


@cache
def _environment() -> Environment:
    """Return the templates, which escape whatever they are given and fail where something is missing."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
