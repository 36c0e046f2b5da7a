"""``ratherthan explain``: a model enters, the explanation of its plan leaves."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.options import Command, Wanted, option, output_options, source_options

EXAMPLES = (
    "ratherthan explain example:paper-5x5",
    "ratherthan explain example:paper-5x5 --state 10 --rather-than south",
    "ratherthan explain example:delivery -p safest --kind selective",
    "ratherthan explain example:paper-5x5 --output route.json",
)
KIND_NAMES = ("none", "naive-state", "responsibility", "constrictive", "naive-path", "selective", "contrastive")
FORMS = ("text", "json")


@click.command("explain", cls=Command, examples=EXAMPLES, short_help="Say what the plan does, and why.")
@source_options("properties", "constants", "start", "lexicon")
@option(
    "--kind",
    section="Question",
    type=click.Choice(KIND_NAMES),
    metavar="KIND",
    help=f"Which explanation: {', '.join(KIND_NAMES)}.  [default: contrastive]",
)
@option(
    "--scope",
    section="Question",
    type=click.Choice(("state", "route")),
    help="In place of a kind: one step, or all of them.",
)
@option(
    "--factors",
    section="Question",
    metavar="A,B",
    help="In place of a kind: of selectiveness, responsibility and constrictiveness, those that are told.",
)
@option(
    "--state",
    section="Question",
    metavar="STATE",
    help="Where: a number from 0, or an exact name.  [default: the initial state]",
)
@option("--rather-than", section="Question", metavar="ACTION", help="Why not this action, at the one state?")
@option(
    "--alpha",
    section="Question",
    type=float,
    default=0.0,
    help="Decisions that change no more than this do not matter.",
)
@option(
    "--impact",
    section="Question",
    type=click.Choice(("action-value", "omega")),
    default="action-value",
    help="What decides: the cost of a step and all that follows, or what follows alone (the paper's).",
)
@option(
    "--values",
    section="Question",
    type=click.Choice(("optimum", "policy")),
    default="optimum",
    help="What follows a step: the best plan, or the one that is explained.",
)
@option(
    "--horizon",
    section="Question",
    type=click.IntRange(min=0),
    metavar="H",
    help="Look so many steps ahead for choices.",
)
@option(
    "--toward",
    section="Question",
    type=click.Choice(("goal",)),
    help="Look for choices only on the way to better states.",
)
@option("--detail", section="Question", is_flag=True, help="Say also what the other actions would lead to.")
@option(
    "--policy",
    section="Policy",
    metavar="FILE",
    help="Explain this policy (JSON, CSV, .npy, or an export of Storm or PRISM), not the best one.",
)
@option("--minimise-q", section="Policy", is_flag=True, help="In a Q table the smallest number is taken.")
@output_options(*FORMS)
def command(wanted: Wanted, form: str | None, output: str | None, **given: Any) -> None:
    """Say what the plan of SOURCE does, and why this rather than that."""
    from ratherthan.apps.asked import explanation_of
    from ratherthan.apps.output import form_of, send, send_line
    from ratherthan.narrate import narrate, to_json

    explanation = explanation_of(wanted, given)
    if form_of(form, output, FORMS) == "json":
        send([to_json(explanation)], output)
    else:
        send_line(narrate(explanation), output)
