"""Decorators for options that several commands share; what was given leaves as one `Wanted`."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import click

from ratherthan.apps.driving import driving_options

__all__ = [
    "Command",
    "Option",
    "Wanted",
    "argument",
    "file_option",
    "measure_options",
    "option",
    "output_options",
    "source_options",
]

SECTIONS = ("Arguments", "Question", "Policy", "Source", "Maps (.map, .yaml)", "Output", "Limits", "Other")
F = TypeVar("F", bound=Callable[..., Any])


class Option(click.Option):
    """An option that belongs to a section of the help page, and shows its default."""

    def __init__(self, *args: Any, section: str = "Other", **settings: Any) -> None:
        settings.setdefault("show_default", True)
        super().__init__(*args, **settings)
        self.section = section


class Argument(click.Argument):
    """An argument that the help page explains."""

    section = "Arguments"

    def __init__(self, *args: Any, tells: str, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self.tells = tells

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:
        """Return the line of the help page."""
        return self.make_metavar(ctx), self.tells


class Command(click.Command):
    """A command whose help lists its options by sections and ends with examples."""

    def __init__(self, *args: Any, examples: tuple[str, ...] = (), **settings: Any) -> None:
        super().__init__(*args, **settings)
        self.examples = examples

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, section by section."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None:
                sections.setdefault(getattr(parameter, "section", "Other"), []).append(record)
        for title, records in sorted(sections.items(), key=lambda item: SECTIONS.index(item[0])):
            with formatter.section(title):
                formatter.write_dl(records)

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - click's
        """Write the examples, each on a line that can be copied."""
        if self.examples:
            formatter.write("\nExamples:\n" + "".join(f"  $ {example}\n" for example in self.examples))


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """Which model, and what is wanted of it.

    Parameters
    ----------
    source : str
    properties : tuple of str
        As often as ``--property`` was given.
    discount : float, optional
    constants, start, lexicon : str, optional
    drive : mapping
        What was asked of a robot on a map of cells, by the names that `ratherthan.read` takes.
    """

    source: str
    properties: tuple[str, ...] = ()
    discount: float | None = None
    constants: str | None = None
    start: str | None = None
    lexicon: str | None = None
    drive: Mapping[str, Any] = field(default_factory=dict)


def option(*names: str, section: str, **settings: Any) -> Callable[[F], F]:
    """Decorate a command with one option in a section of its help page."""
    return click.option(*names, cls=Option, section=section, **settings)


def argument(name: str, *, tells: str, **settings: Any) -> Callable[[F], F]:
    """Decorate a command with one argument."""
    return click.argument(name, cls=Argument, tells=tells, **settings)


_SOURCE: Mapping[str, Callable[[F], F]] = {
    "properties": option(
        "-p",
        "--property",
        "properties",
        section="Source",
        metavar="TEXT",
        multiple=True,
        show_default=False,
        help="What is wanted, in PRISM's syntax, by the name it has in the source, or FILE.props:NAME; given again, what comes "
        "second.  [default: the source's own, or the "
        "least of its one reward until goal, target or destination]",
    ),
    "discount": option(
        "--discount",
        section="Source",
        type=float,
        metavar="G",
        help="The discount of a sum without end, -p 'R{\"reward\"}max=? [C]': between 0 and 1.",
    ),
    "constants": option(
        "--constants", section="Source", metavar="N=5,K=2", help="Values for constants of a PRISM or JANI model."
    ),
    "start": option(
        "--start",
        section="Source",
        metavar="STATE",
        help="The state to begin in, a number from 0 or an exact name; on a map a place.  [default: the initial state]",
    ),
    "lexicon": option(
        "--lexicon",
        section="Output",
        metavar="FILE.toml",
        help="Words for actions, states and the objective, in place of the model's.",
    ),
}


_DRIVING = driving_options(option)


_PRECISION = option(
    "--precision",
    section="Limits",
    type=float,
    metavar="P",
    help="The relative width of bounds that is enough; what a sentence must compare is found out more precisely where it is open.  "
    "[default: 1e-6]",
)


def source_options(*keys: str) -> Callable[[F], Callable[..., Any]]:
    """Decorate a command with SOURCE and some of its options; they arrive as one `Wanted`, the first argument."""

    def decorate(command: F) -> Callable[..., Any]:
        @functools.wraps(command)
        def gathered(**given: Any) -> Any:
            from ratherthan.apps.limits import limited
            from ratherthan.solve.precise import aiming

            if given.get("output") not in (None, "", "-"):
                from ratherthan.io._files import check_target

                check_target(given["output"], unlike=given["source"])
            drive = {key: value for key in _DRIVING if (value := given.pop(key)) is not None}
            wanted = Wanted(source=given.pop("source"), drive=drive, **{key: given.pop(key) for key in keys})
            with aiming(given.pop("precision", None)), limited(given.pop("time_limit"), given.pop("memory_limit")):
                return command(wanted, **given)

        decorated: Callable[..., Any] = _limit_options(gathered)
        if "properties" in keys:
            decorated = _PRECISION(decorated)
        for add in reversed(list(_DRIVING.values())):
            decorated = add(decorated)
        for key in reversed(keys):
            decorated = _SOURCE[key](decorated)
        return argument(
            "source",
            tells="An example such as example:paper-5x5, an environment such as gym:FrozenLake-v1, or a model's file.",
        )(decorated)

    return decorate


def _limit_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command with how long it may take, and how much memory."""
    from ratherthan.apps.limits import Amount, Duration

    command = option(
        "--memory-limit",
        section="Limits",
        type=Amount(),
        metavar="SIZE",
        help="Stop before more memory is held than that: 500MB, 4GB.  [default: what the machine has]",
    )(command)
    return option(
        "--time-limit",
        section="Limits",
        type=Duration(),
        metavar="TIME",
        help="Stop after this time, 10s, 2m or 1h, and say what is known by then.  [default: none]",
    )(command)


def measure_options(command: F) -> F:
    """Decorate a command with how decisions are measured, and with the policy that is judged."""
    for add in reversed(_MEASURES):
        command = add(command)
    return command


_MEASURES: tuple[Callable[[F], F], ...] = (
    option(
        "--alpha",
        section="Question",
        type=float,
        default=0.0,
        help="Decisions that change no more than this do not matter.",
    ),
    option(
        "--impact",
        section="Question",
        type=click.Choice(("action-value", "omega")),
        default="action-value",
        help="What makes a state critical: the cost of a step and all that follows, or what follows alone (the paper's).",
    ),
    option(
        "--values",
        section="Question",
        type=click.Choice(("optimum", "policy")),
        default="optimum",
        help="What follows a step: the best plan, or the one of --policy.",
    ),
    option(
        "--horizon",
        section="Question",
        type=click.IntRange(min=0),
        metavar="H",
        help="Look so many steps ahead for choices.",
    ),
    option(
        "--toward",
        section="Question",
        type=click.Choice(("goal",)),
        help="Look for choices only on the way to better states.",
    ),
    option(
        "--policy",
        section="Policy",
        metavar="FILE",
        help="Take this policy (JSON, CSV, .npy, or an export of Storm or PRISM), not the best one.",
    ),
    option("--minimise-q", section="Policy", is_flag=True, help="In a Q table the smallest number is taken."),
)


def file_option(suffix: str) -> Callable[[F], F]:
    """Decorate a command with ``--output`` where there is one format only."""
    return option(
        "-o",
        "--output",
        section="Output",
        metavar=f"FILE{suffix}",
        help="Write the answer to a file, whole or not at all.  [default: standard output]",
    )


def output_options(*formats: str) -> Callable[[F], F]:
    """Decorate a command with ``--format`` (the first is the default) and ``--output``."""

    def decorate(command: F) -> F:
        command = option(
            "-o", "--output", section="Output", metavar="FILE", help="Write the answer to a file, whole or not at all."
        )(command)
        return option(
            "--format",
            "form",
            section="Output",
            type=click.Choice(formats),
            help=f"How the answer is written.  [default: {formats[0]}, or what the suffix of --output says]",
        )(command)

    return decorate
