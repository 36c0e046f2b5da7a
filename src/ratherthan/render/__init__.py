"""Pictures: what is drawn of explanations and solutions is a pure function of them, the same bytes every time."""

from ratherthan.render.canvas import Picture
from ratherthan.render.drawing import draw

__all__ = ["Picture", "draw"]
