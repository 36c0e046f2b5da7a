"""A study enters, what stands on each of its pages leaves."""

from __future__ import annotations

from typing import Any

from ratherthan.apps.study.server.opening import Study

__all__ = ["about"]


def about(study: Study) -> dict[str, Any]:
    """Return what stands on every page of a study.

    Parameters
    ----------
    study : Study
    """
    design = study.design
    return {
        "title": design.title,
        "language": design.language,
        "contact": design.contact,
        "simulated": study.simulated,
        "words": getattr(design, "words", None) or {},
    }
