"""A design and a database enter, a running study leaves: entry, answers, resuming, withdrawal, the researchers' pages and the export.

============== ==================================================================================================
room
============== ==================================================================================================
tables         what is stored, and the migrations beside it
database       opening, migrating, and writing so that what is acknowledged is on the disk
opening        a design meets its database: made, or compared with what is there
course         the screens of a design, and as the browser gets them
places         who takes which row of the balanced plan; places of drop-outs go to others
sessions       one participant: entering, the present screen, an answer, withdrawing
values         what was answered against what a screen records
platforms      how people come and where they go: Prolific, Mechanical Turk, links
tokens         what shows who somebody is
shield         headers, sizes, speed and errors of every request
api, researchers, app   the routes
monitor        how the study is going
exporting      the database as tidy tables
running        the process that serves
============== ==================================================================================================

See docs/study/serving.md for the promises and how each is kept.
"""
