"""A file of properties (``.props``, ``.prctl`` …) enters, its properties join those of a problem.

Such a file is PRISM's: properties, each with a name before it or not, with ``;`` or a new line behind it; constants, with a
value or to be given; labels; and comments. ``FILE.props`` means its one property, ``FILE.props:NAME`` the one with a name (or,
where it has none, with its number, from 1).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from ratherthan.errors import NotExplainableError, PropertyError, SourceError
from ratherthan.io._constants import Constant, Given, chosen_values, given_texts, reachable_names, text_of_value
from ratherthan.io._files import open_source
from ratherthan.model.formula import states_where
from ratherthan.model.mdp import Bools
from ratherthan.model.problem import Problem
from ratherthan.model.property import parse_property

__all__ = ["PropertyFile", "files_of", "read_with_files"]

SUFFIXES = (".props", ".prctl", ".pctl", ".csl", ".ltl", ".pltl")
LONGEST = 1 << 24

_ASKED = re.compile(rf"(?P<path>.+(?:{'|'.join(map(re.escape, SUFFIXES))}))(?::(?P<name>[^\[\]]+))?", re.IGNORECASE)
_COMMENT = re.compile(r'("[^"\n]*")|//[^\n]*|/\*.*?\*/', re.DOTALL)
_PIECE = re.compile(r'"[^"\n]*"|[\[\]{}();\n]|[^"\[\]{}();\n]+|"')
_NAMED = re.compile(r'"(?P<name>[^"\n]*)"\s*:\s*(?P<text>.+)', re.DOTALL)
_BEGINS = re.compile(
    r'\s*("[^"\n]*"\s*:|const\b|label\b|filter\s*\(|multi\s*\(|quantile\s*\(|(P|R|T|S|LRA|E|A)\W|(P|R|T|S|LRA)(min|max))'
)
_CONSTANT = re.compile(r"const\s+(?:(?P<kind>int|double|bool)\s+)?(?P<name>\w+)\s*(?:=\s*(?P<value>.+))?", re.DOTALL)
_LABEL = re.compile(r'label\s+"(?P<name>[^"\n]*)"\s*=\s*(?P<value>.+)', re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class PropertyFile:
    """What stands in a file of properties.

    Parameters
    ----------
    path : str
    texts : dict of str to str
        The properties by name.
    constants : tuple of Constant
    definitions : dict of str to str
        The values of constants that have one.
    labels : dict of str to str
    """

    path: str
    texts: dict[str, str] = field(default_factory=dict)
    constants: tuple[Constant, ...] = ()
    definitions: dict[str, str] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)


def files_of(texts: Iterable[str]) -> dict[str, tuple[PropertyFile, str]]:
    """Return for each text that names a property of a file that file and the property's name in it.

    Raises
    ------
    SourceError
        Where the file cannot be read.
    PropertyError
        Where it does not have the property, or several and none is named; it lists them.
    """
    read: dict[str, PropertyFile] = {}
    found = {}
    for text in texts:
        match = _ASKED.fullmatch(text.strip())
        if match is None or "[" in text:
            continue
        path = match["path"]
        if path not in read:
            read[path] = _file(path)
        found[text.strip()] = read[path], _chosen(read[path], match["name"])
    return found


def _chosen(file: PropertyFile, name: str | None) -> str:
    listed = ", ".join(file.texts)
    if name is None:
        if len(file.texts) == 1:
            return next(iter(file.texts))
        raise PropertyError(
            f"A file of properties must have one, or one must be named: '{file.path}' has {listed or 'none'}. "
            + (f"Give one, for example --property {file.path}:{next(iter(file.texts))}." if file.texts else ""),
            path=file.path,
        )
    name = name.strip().strip('"')
    if name not in file.texts:
        raise PropertyError(
            f"A property of '{file.path}' must be one of {listed or 'none'}; got '{name}'.", path=file.path
        )
    return name


def read_with_files(
    reader: Callable[[Given], Problem], constants: Given, asked: Mapping[str, tuple[PropertyFile, str]]
) -> Problem:
    """Read a problem, and add the properties of files under the texts that name them.

    Parameters
    ----------
    reader : callable
        Reads the model with the constants that it is given.
    constants : str or mapping, optional
        Of the model and of the files.
    asked : mapping of str to (PropertyFile, str)
        See `files_of`.

    Returns
    -------
    Problem
        Where a constant of a file is one of the model, too, both get the value.
    """
    given = given_texts(constants)
    theirs = {item.name for file, _ in asked.values() for item in file.constants if not item.defined}
    own = {name: text for name, text in given.items() if name not in theirs}
    try:
        problem = reader(own or None)
    except SourceError as error:
        missing = theirs & given.keys() & set(error.place.get("constants", ()))
        if not missing:
            raise
        problem = reader(own | {name: given[name] for name in missing})
    for text, (file, name) in asked.items():
        problem = _with_property(problem, text, file, name, given)
    return problem


def _with_property(problem: Problem, text: str, file: PropertyFile, name: str, given: Mapping[str, str]) -> Problem:
    """Return the problem with one property of a file under the text that names it."""
    wanted = file.texts[name]
    needed = reachable_names([wanted, *file.labels.values()], file.definitions)
    open_names = {item.name for item in file.constants if not item.defined}
    shared = {item: value for item, value in problem.definitions.items() if item in open_names and item not in given}
    values = chosen_values(
        file.constants,
        {item: value for item, value in {**shared, **given}.items() if item in open_names},
        needed=needed,
        shown=file.path,
    )
    definitions = {**problem.definitions, **file.definitions, **{n: text_of_value(v) for n, v in values.items()}}
    problem = replace(problem, definitions=definitions)
    labels = {label: _mask(problem, label, said, file.path) for label, said in file.labels.items()}
    problem = replace(problem, mdp=replace(problem.mdp, labels={**problem.mdp.labels, **labels}))
    try:
        return replace(problem, properties={**problem.properties, text: parse_property(wanted, problem)})
    except NotExplainableError:
        return replace(problem, others={**problem.others, text: wanted})


def _mask(problem: Problem, label: str, said: str, path: str) -> Bools:
    if label in problem.mdp.labels:
        raise PropertyError(
            f"A label of '{path}' must be new, but the model has one called '{label}'. Rename it.", path=path
        )
    return states_where(problem.mdp, said, problem.definitions)


def _file(path: str) -> PropertyFile:
    """Read a file of properties."""
    if not Path(path).is_file():
        raise SourceError(f"A file of properties must exist, but there is no '{path}'. Check its name.", path=path)
    with open_source(path, "a file of properties") as source:
        data = source.read(LONGEST + 1)
    if len(data) > LONGEST:
        raise SourceError(f"A file of properties must have at most {LONGEST} bytes, but '{path}' has more.", path=path)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SourceError(
            f"A file of properties must be text in UTF-8, but '{path}' is not, at byte {error.start}.", path=path
        ) from error
    return _made(path, _statements(_COMMENT.sub(lambda found: found[1] or " ", text)))


def _statements(text: str) -> list[str]:
    """Return the statements of a file: up to ``;`` or a line end outside of brackets, where a new one begins behind it."""
    found, now, depth = [], "", 0
    pieces = _PIECE.findall(text)
    ends = [";" if piece == ";" else "" for piece in pieces]
    for i, piece in enumerate(pieces):
        depth += (piece in "([{") - (piece in ")]}")
        following = "".join(pieces[i + 1 : i + 4])
        if (ends[i] and depth <= 0) or (piece == "\n" and depth <= 0 and _ends(now) and _BEGINS.match(following)):
            found.append(now)
            now, depth = "", 0
        else:
            now += piece
    return [" ".join(statement.split()) for statement in [*found, now] if statement.strip()]


def _ends(text: str) -> bool:
    """Whether a statement can end behind a text, which no name or operator is left to hang on."""
    return not text.rstrip().endswith((":", "=", "&", "|", "<", ">", "+", "-", "*", "/", "!", ",", "?"))


def _made(path: str, statements: list[str]) -> PropertyFile:
    file = PropertyFile(path=path)
    constants = []
    for statement in statements:
        if constant := _CONSTANT.fullmatch(statement):
            value = constant["value"]
            constants.append(Constant(name=constant["name"], kind=constant["kind"] or "int", defined=value is not None))
            if value is not None:
                file.definitions[constant["name"]] = value
        elif label := _LABEL.fullmatch(statement):
            file.labels[label["name"]] = label["value"]
        else:
            named = _NAMED.fullmatch(statement)
            name = named["name"] if named else str(len(file.texts) + 1)
            if name in file.texts:
                raise PropertyError(
                    f"The properties of '{path}' must have names of their own, got '{name}' twice.", path=path
                )
            file.texts[name] = named["text"] if named else statement
    return replace(file, constants=tuple(constants))
