"""A study's answers enter as tables, a report with statistics, figures and one paragraph a hypothesis leaves.

The straight line: `tables` reads files as columns of text, `tidy` makes `data` of our own exports and `foreign` of other
people's tables; `excluding` says whose answers count; `measuring` and `preferring` ask `statistics`; `verdicts` puts numbers into
the sentences of ``words/en.toml``; `charts` draws; `report` lays all of it out as a document, which `rendering` writes as HTML and
Markdown. `analyse` is the verb for all of this.
"""
