"""A Solution, a state and two of its actions enter; their search trees side by side leave, as in Fig. 2 of the paper."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from ratherthan.errors import QuestionError
from ratherthan.explain.measures import Factors
from ratherthan.explain.question import question
from ratherthan.render.branching import Kind, Node, Tree, tree_of
from ratherthan.render.canvas import Canvas, Picture, cut, text_width
from ratherthan.render.legend import Entry
from ratherthan.render.palette import INK, MARK, PAPER, QUIET, ROUTE
from ratherthan.render.sheet import Sheet, sheet
from ratherthan.render.wording import state_words, words
from ratherthan.solve.solution import Solution

__all__ = ["draw_trees"]

LAYER, PILL, APART, BETWEEN = 62.0, 22.0, 12.0, 48.0
SIZE, SMALL = 12.0, 11.0
WIDEST = 130.0
HEAD = 58.0


def draw_trees(solution: Solution, state: int, rather_than: str | None = None) -> Picture:
    """Return the picture of the search trees of two actions of a state.

    Parameters
    ----------
    solution : Solution
    state : int
    rather_than : str, optional
        The action beside the one that is taken; by default the first other one.

    Raises
    ------
    QuestionError
        If the state has no two actions, or not this one.
    """
    mdp, lexicon = solution.problem.mdp, solution.problem.lexicon
    if not 0 <= state < mdp.states:
        raise QuestionError(f"A state must be a number from 0 to {mdp.states - 1}, got {state}.", state=state)
    one, other = _pair(solution, state, rather_than)
    factors = Factors(solution=solution, asked=question("contrastive"))
    trees = [tree_of(factors, choice) for choice in (one, other)]
    table = words(lexicon.language)["tree"]
    names = {"one": trees[0].action, "other": trees[1].action}
    place = state_words(lexicon, state, mdp.names[state], named=mdp.names.named)
    labels = _Labels(solution)
    laid = [_laid(tree, labels) for tree in trees]
    said = [table["head"].format(action=tree.action, count=_count(tree)) for tree in trees]
    widths = [max(part.width, 160.0) for part in laid]
    caption = [table["caption"]]
    for tree in trees:
        if tree.more:
            caption.append(table["more_one" if tree.more == 1 else "more"].format(action=tree.action, count=tree.more))
    text = Sheet(
        title=table["title"].format(place=place, **names),
        description=table["description"].format(
            place=place,
            states_one=trees[0].states,
            count_one=_count(trees[0]),
            states_other=trees[1].states,
            count_other=_count(trees[1]),
            **names,
        ),
        caption=" ".join(caption),
        entries=_entries(table, trees),
    )
    height = HEAD + max(part.height for part in laid)
    body = sheet(text, sum(widths) + BETWEEN, height)
    x = body.x
    for part, width, head in zip(laid, widths, said, strict=True):
        _draw(body.canvas, part, (x + (width - part.width) / 2, body.y), labels.of(state), cut(head, width, SIZE))
        x += width + BETWEEN
    return body.canvas.picture()


def _pair(solution: Solution, state: int, rather_than: str | None) -> tuple[int, int]:
    """Return the choice taken in a state, and the other one."""
    mdp, policy = solution.problem.mdp, solution.policy
    own = mdp.choices_of(state)
    shares = policy.weights(mdp)[own.start : own.stop]
    taken = own.start + int(shares.argmax())
    others = {mdp.action_name(choice): choice for choice in own if choice != taken}
    if not others:
        raise QuestionError(f"Two search trees need two actions, but state {state} has one.", state=state)
    if rather_than is not None and rather_than not in others:
        raise QuestionError(
            f"'rather than' must name another action of state {state} than the one taken, one of {', '.join(others)}; "
            f"got '{rather_than}'.",
            state=state,
            action=rather_than,
        )
    return taken, others[rather_than] if rather_than is not None else next(iter(others.values()))


def _count(tree: Tree) -> str:
    low, high = tree.count
    return str(low) if low == high else f"{low}–{high}"


class _Labels:
    """What stands in the nodes."""

    def __init__(self, solution: Solution) -> None:
        self.names, self.lexicon = solution.problem.mdp.names, solution.problem.lexicon

    def of(self, state: int) -> str:
        """Return the label of a state: what a lexicon calls it by itself, else its name, else its number."""
        name = self.names[state] if self.names.named else str(state)
        return cut(self.lexicon.states.get(name) or self.lexicon.states.get(str(state)) or name, WIDEST, SIZE)


@dataclass(eq=False)
class _Laid:
    """A tree with places: each node at (x, layer)."""

    tree: Tree
    width: float = 0.0
    height: float = 0.0
    places: dict[int, tuple[float, float]] = field(default_factory=dict)
    sizes: dict[int, tuple[str, float]] = field(default_factory=dict)

    def nodes(self) -> Iterator[Node]:
        """Yield all nodes."""
        stack = list(self.tree.roots)
        while stack:
            node = stack.pop()
            yield node
            stack += node.children


def _slot(node: Node) -> float:
    """Return how much room the action over a node has at least."""
    return min(WIDEST, 1.1 * text_width(node.action, SMALL) + 6.0)


def _laid(tree: Tree, labels: _Labels) -> _Laid:
    """Return a tree with a place for each node: leaves side by side, a parent over the middle of its children."""
    laid, edge = _Laid(tree), 0.0

    def put(node: Node) -> float:
        nonlocal edge
        label = "↺" if node.kind is Kind.BACK else labels.of(node.state) + ("…" if node.kind is Kind.CUT else "")
        width = max(PILL + 4.0, text_width(label, SIZE) + 12.0)
        laid.sizes[id(node)] = label, width
        slot = max(width, _slot(node))
        if node.children:
            begin = edge
            places = [put(child) for child in node.children]
            x = (places[0] + places[-1]) / 2
            if edge - begin < slot + APART:  # a wide parent of narrow children
                edge = begin + slot + APART
            x = max(x, begin + slot / 2)
        else:
            x = edge + slot / 2
            edge += slot + APART
        laid.places[id(node)] = (x, (node.depth + 1) * LAYER)
        laid.height = max(laid.height, (node.depth + 1) * LAYER + PILL)
        laid.width = max(laid.width, edge - APART, x + slot / 2)
        return x

    for root in tree.roots:
        put(root)
    return laid


def _draw(canvas: Canvas, laid: _Laid, corner: tuple[float, float], start: str, head: str) -> None:
    """Draw one tree under its heading."""
    left, top = corner
    where = {key: (left + x, top + HEAD - PILL + y) for key, (x, y) in laid.places.items()}
    ends = [where[id(root)][0] for root in laid.tree.roots] or [left + laid.width / 2]
    origin = ((ends[0] + ends[-1]) / 2, top + HEAD - PILL)
    half = text_width(head, SIZE) / 2
    middle = min(max(origin[0], half + 2.0), canvas.width - half - 2.0)
    canvas.text(middle, top + SIZE, head, size=SIZE, text_anchor="middle", font_weight="bold")
    captions = []
    for root in laid.tree.roots:
        _edge(canvas, origin, where[id(root)], counts=False)
        captions.append(
            ((origin[0] + 3 * where[id(root)][0]) / 4, (origin[1] + 3 * where[id(root)][1]) / 4 - 5.0, root)
        )
    for node in laid.nodes():
        for child in node.children:
            a, b = where[id(node)], where[id(child)]
            _edge(canvas, a, b, counts=child.counts)
            captions.append(((a[0] + 3 * b[0]) / 4, (a[1] + 3 * b[1]) / 4 - 5.0, child))
    for x, y, child in captions:
        said = cut(child.action, max(laid.sizes[id(child)][1], _slot(child)), SMALL)
        weight = "bold" if child.counts else None
        canvas.text(
            x,
            y + 4.0,
            said,
            size=SMALL,
            text_anchor="middle",
            font_weight=weight,
            stroke=PAPER,
            stroke_width=3.0,
            paint_order="stroke",
        )
    _pill(canvas, origin, (start, max(PILL + 4.0, text_width(start, SIZE) + 12.0)), fill=ROUTE, ink=PAPER)
    for node in laid.nodes():
        _node(canvas, where[id(node)], node, laid.sizes[id(node)])


def _edge(canvas: Canvas, a: tuple[float, float], b: tuple[float, float], *, counts: bool) -> None:
    """Draw an edge of a tree; one that counts is thick."""
    canvas.path([a, b], stroke=MARK if counts else QUIET, stroke_width=3.0 if counts else 1.2)


def _node(canvas: Canvas, place: tuple[float, float], node: Node, size: tuple[str, float]) -> None:
    if node.kind is Kind.BACK:
        _pill(canvas, place, size, fill=PAPER, ink=INK, stroke=None)
    elif node.kind is Kind.AGAIN:
        _pill(canvas, place, size, fill=PAPER, ink=INK, dash="3 3")
    elif node.critical:
        _pill(canvas, place, size, fill=MARK, ink=PAPER)
    else:
        ended = node.kind is Kind.ENDED
        _pill(canvas, place, size, fill=PAPER, ink=INK, width=1.2, double=ended)


def _pill(
    canvas: Canvas,
    place: tuple[float, float],
    size: tuple[str, float],
    *,
    fill: str,
    ink: str,
    stroke: str | None = INK,
    dash: str | None = None,
    width: float = 1.2,
    double: bool = False,
) -> None:
    """Draw a node with its label."""
    (x, y), (label, across) = place, size
    shape = {"stroke": stroke or PAPER, "stroke_width": width, "stroke_dasharray": dash}
    canvas.rect(x - across / 2, y - PILL / 2, across, PILL, rx=PILL / 2, fill=fill, **shape)
    if double:
        canvas.rect(
            x - across / 2 + 3.0,
            y - PILL / 2 + 3.0,
            across - 6.0,
            PILL - 6.0,
            rx=PILL / 2 - 3.0,
            fill="none",
            stroke=INK,
            stroke_width=0.8,
        )
    canvas.text(x, y + 0.36 * SIZE, label, size=SIZE, fill=ink, text_anchor="middle")


def _entries(table: dict[str, str] | object, trees: list[Tree]) -> list[Entry]:
    """Return the lines of the legend: what is to be seen, and nothing else."""
    assert isinstance(table, dict)
    nodes = [node for tree in trees for node in _Laid(tree).nodes()]
    sample = ("1", PILL + 4.0)

    def shown(kind: Kind, *, critical: bool = False) -> Entry:
        word = "critical" if critical else {Kind.AGAIN: "again", Kind.ENDED: "ended", Kind.BACK: "back"}[kind]
        node = Node(0, "", counts=False, depth=0, kind=kind, critical=critical)
        label = ("↺", PILL) if kind is Kind.BACK else sample
        return Entry(words=table[word], sample=lambda c, x, y: _node(c, (x, y), node, label))

    found = []
    if any(node.critical and node.kind not in (Kind.AGAIN, Kind.BACK) for node in nodes):
        found.append(shown(Kind.UNFOLDED, critical=True))
    for counts, word in ((True, "pair"), (False, "plain")):
        if any(child.counts is counts for node in nodes for child in node.children):
            found.append(
                Entry(words=table[word], sample=lambda c, x, y, k=counts: _edge(c, (x - 13, y), (x + 13, y), counts=k))  # type: ignore[misc]
            )
    found += [shown(kind) for kind in (Kind.AGAIN, Kind.ENDED, Kind.BACK) if any(node.kind is kind for node in nodes)]
    return found
