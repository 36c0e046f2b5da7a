"""``ratherthan explain``: a model enters, the explanation of its plan leaves."""

from __future__ import annotations

from typing import Any

import click

from ratherthan.apps.asking import question_options
from ratherthan.apps.clustered import cluster_options, explain_in_blocks
from ratherthan.apps.options import Command, Wanted, measure_options, output_options, source_options

EXAMPLES = (
    "ratherthan explain example:paper-5x5",
    "ratherthan explain example:paper-5x5 --state 10 --rather-than south",
    "ratherthan explain example:delivery -p safest --also time",
    "ratherthan explain example:paper-5x5 --output route.json",
)
FORMS = ("text", "json")
MANY = 30
"""From how many sentences about steps on it is said that there may be fewer."""


@click.command("explain", cls=Command, examples=EXAMPLES, short_help="Say what the plan does, and why.")
@source_options("properties", "discount", "constants", "start", "lexicon")
@cluster_options(explain_in_blocks)
@question_options
@measure_options
@output_options(*FORMS)
def command(wanted: Wanted, form: str | None, output: str | None, **given: Any) -> None:
    """Say what the plan of SOURCE does, and why this rather than that."""
    from ratherthan.apps.asked import explanation_of
    from ratherthan.apps.door import say
    from ratherthan.apps.output import form_of, send, send_line
    from ratherthan.explain.telling import told_groups
    from ratherthan.narrate import narrate, to_json

    explanation = explanation_of(wanted, given)
    if form_of(form, output, FORMS) == "json":
        send([to_json(explanation)], output)
        return
    send_line(narrate(explanation), output)
    steps = len(told_groups(explanation))
    if steps > MANY and given["at_most"] is None:
        say(f"These were {steps} sentences about steps; '--at-most 7' tells the decisions that matter most.")
