"""``ratherthan verify``: a stored explanation and its model enter, a verdict on every claim leaves."""

from __future__ import annotations

import click

from ratherthan.apps.options import Command, Wanted, argument, output_options, source_options

EXAMPLES = (
    "ratherthan explain example:paper-5x5 --output route.json",
    "ratherthan verify route.json example:paper-5x5",
)
FORMS = ("text", "json")


@click.command(
    "verify", cls=Command, examples=EXAMPLES, short_help="Check a stored explanation against its model, claim by claim."
)
@argument("explanation", tells="What `ratherthan explain --format json` wrote.")
@source_options("constants", "start", "lexicon")
@output_options(*FORMS)
@click.pass_context
def command(context: click.Context, wanted: Wanted, explanation: str, form: str | None, output: str | None) -> None:
    """Check every claim of EXPLANATION (a JSON file) against SOURCE, without the code that made it.

    SOURCE must be what was explained: give the same --constants, --start and --lexicon again.

    The exit code is 0 where nothing fails and 2 where something does, or where the explanation was tampered with.
    """
    from ratherthan.apps.answers import verdict_document, verdict_lines
    from ratherthan.apps.asked import problem_of
    from ratherthan.apps.output import as_json, form_of, send, send_lines
    from ratherthan.apps.waiting import waiting
    from ratherthan.verify import verify

    problem = problem_of(wanted)
    with waiting("Checking"):
        verdicts = verify(explanation, problem)
    if form_of(form, output, FORMS) == "json":
        send([as_json(verdict_document(verdicts))], output)
    else:
        send_lines(verdict_lines(verdicts), output)
    context.exit(2 if verdicts.fails else 0)
