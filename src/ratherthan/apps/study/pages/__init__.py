"""A study and how it is going enter, its pages leave: those of participants and those of researchers, all as text.

The server owns order, progress and validity. A page shows the screen that the server sends, and sends back what was
answered; see docs/study/pages.md.
"""

from ratherthan.apps.study.pages.rendering import STATIC, render, static
from ratherthan.apps.study.pages.wording import languages, spoken, words

__all__ = ["STATIC", "languages", "render", "spoken", "static", "words"]
