"""Models, solutions and explanations show themselves in notebooks, and cost nothing elsewhere."""

from __future__ import annotations

import base64
import re
import subprocess
import sys
from xml.etree import ElementTree as ET

import pytest
from pages import HOSTILE, named
from pictures import on_cells, solved

import ratherthan as rt
from ratherthan.narrate import sentences
from ratherthan.report.notebook import shown

SVG = "{http://www.w3.org/2000/svg}"


def images(html: str) -> list[str]:
    found = re.findall(r'src="data:image/svg\+xml;base64,([^"]*)"', html)
    return [base64.b64decode(data).decode("utf-8") for data in found]


def test_an_explanation_shows_its_sentences_and_its_picture():
    explanation = rt.explain(solved("paper-5x5"))
    html = shown(explanation)
    assert images(html) == [rt.draw(explanation).svg]
    for sentence in sentences(explanation):
        assert sentence.text in html


def test_a_solution_shows_its_values_with_bounds_and_proof():
    solution = solved("paper-5x5")
    html = shown(solution)
    assert images(html) == [rt.draw(solution).svg]
    assert "7.77778 (proved to lie between 7.77777 and 7.77778)" in html
    assert solution.outcome.value.replace("'", "&#x27;") in html


def test_a_solution_without_a_map_shows_its_numbers():
    html = shown(solved("delivery"))
    assert images(html) == []
    assert "6.10263" in html


def test_a_model_shows_its_map_or_a_graph_and_what_is_in_it():
    problem = rt.read("example:paper-5x5")
    assert images(shown(problem)) == [rt.draw(problem).svg]
    assert "25 states, 31 choices, 56 branches" in shown(problem)
    assert images(shown(problem.mdp)) == [rt.draw(problem.mdp).svg]


def test_names_of_strangers_are_text():
    explanation = named(HOSTILE)
    for html in (shown(explanation), shown(on_cells(["..."], title=HOSTILE)), shown(on_cells(["..."]).problem.mdp)):
        assert "<script" not in html
        assert "<b>" not in html
        for image in images(html):
            ET.fromstring(image)


@pytest.mark.parametrize("what", ["problem", "problem.mdp", "solution", "rt.explain(solution)"])
def test_ipython_shows_them(what):
    pytest.importorskip("IPython", reason="needs IPython, which the extra dev brings")
    code = f"""
from IPython.core.interactiveshell import InteractiveShell
shell = InteractiveShell.instance()
shell.run_cell("import ratherthan as rt; problem = rt.read('example:paper-5x5'); solution = rt.solve(problem)")
shell.run_cell("thing = {what}")
print(shell.display_formatter.format(shell.user_ns["thing"])[0]["text/html"][:5])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.endswith("<img \n"), done.stderr


def test_outside_of_notebooks_nothing_is_loaded_for_them():
    code = "import sys, ratherthan; print([name for name in sys.modules if 'report' in name or 'IPython' in name])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "[]\n", done.stderr
