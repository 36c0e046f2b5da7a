"""All statistics of a study enter, a document of plain JSON leaves, and the ratings as R's package ordinal takes them."""

from __future__ import annotations

import csv
import dataclasses
import io
from typing import Any

import numpy as np

from ratherthan.apps.study.analysis.data import Data
from ratherthan.apps.study.analysis.preferring import Lacking
from ratherthan.apps.study.analysis.published import published_f
from ratherthan.apps.study.analysis.report import Findings, verdicts_of
from ratherthan.apps.study.analysis.words import say

__all__ = ["R_SCRIPT", "as_document", "ratings_csv"]

VERSION = 1

R_SCRIPT = """\
# Cumulative-link mixed models of the ratings in ratings.csv. Needs R with the package ordinal:
#   install.packages("ordinal"); then: Rscript clmm.R
library(ordinal)
ratings <- read.csv("ratings.csv", stringsAsFactors = TRUE)
ratings <- droplevels(ratings[tolower(ratings$kept) == "true", ])  # whose answers count in the report
ratings$kind <- factor(ratings$kind, levels = unique(ratings$kind[order(ratings$kind_order)]))
for (item in levels(ratings$item)) {
  own <- droplevels(ratings[ratings$item == item, ])
  own$value <- factor(own$value, ordered = TRUE)
  cat("\\n==", item, "==\\n")
  place <- if (nlevels(own$map) > 1) " + map" else ""
  full <- clmm(as.formula(paste0("value ~ kind", place, " + (1 | participant)")), data = own)
  none <- clmm(as.formula(paste0("value ~ 1", place, " + (1 | participant)")), data = own)
  print(summary(full))
  print(anova(none, full))
}
"""


def as_document(found: Findings) -> dict[str, Any]:
    """Return all statistics as plain JSON, without NaN; what is lacking is ``{"lacking": why}``."""
    data = found.data
    return {
        "version": VERSION,
        "simulated": data.simulated,
        **({"notice": say("forms.simulated")} if data.simulated else {}),
        "title": data.title,
        "design": data.design,
        "kinds": [{"id": kind, "label": data.label(kind)} for kind in data.kinds],
        "notes": list(data.notes),
        "participants": {
            "all": len(data.persons),
            "kept": int(found.exclusion.keep.sum()),
            "states": found.exclusion.states,
            "excluded": found.exclusion.counts,
        },
        "rules": _plain(found.rules),
        "measures": [_measure(data, m) for m in found.measured],
        "everyone": [_measure(data, m) for m in found.everyone],
        "lacking": found.lacking,
        "preferences": _plain(found.preferences),
        "verdicts": [_plain(verdict) for verdict in verdicts_of(found)],
        "published": {name: {**dataclasses.asdict(test), "p": test.p} for name, test in published_f().items()}
        if data.cores
        else {},
    }


def _measure(data: Data, measured: Any) -> dict[str, Any]:
    """Return one measure; kinds by their ids."""
    document: dict[str, Any] = _plain(measured)
    measure = measured.measure
    document["measure"] = {
        "name": measure.name,
        "label": measure.label,
        "unit": measure.unit,
        "time": measure.time,
        "scale": measure.scale,
    }
    document["kinds"] = [data.kinds[k] for k in measured.kinds]
    for summary in document["summaries"]:
        summary["kind"] = data.kinds[summary["kind"]]
    for compared in document["compared"]:
        compared["first"], compared["second"] = data.kinds[compared["first"]], data.kinds[compared["second"]]
    if isinstance(document["tukey"], list):
        for pair in document["tukey"]:
            pair["first"], pair["second"] = document["kinds"][pair["first"]], document["kinds"][pair["second"]]
    return document


def _plain(value: Any) -> Any:
    """Return dataclasses, arrays and tuples as plain JSON."""
    if isinstance(value, Lacking):
        return {"lacking": value.why}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value) if f.name != "measure"}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, np.generic):
        return value.item()
    return value


def ratings_csv(found: Findings) -> str:
    """Return the ratings, a row each, as the script for R takes them; "" where there are none."""
    data, keep = found.data, found.exclusion.keep
    rated = [measure for measure in data.measures if measure.scale is not None]
    if not rated:
        return ""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["simulated", "kept", "participant", "map", "kind", "kind_order", "item", "value"])
    for measure in rated:
        for p, m, k, value in zip(measure.person, measure.place, measure.kind, measure.value, strict=True):
            cells = (data.persons[p].name, data.maps[m], data.kinds[k])
            safe = [f"'{cell}" if cell[:1] in ("=", "+", "-", "@", "\t", "\r") else cell for cell in cells]
            writer.writerow(
                [str(data.simulated).lower(), str(bool(keep[p])).lower(), *safe, int(k) + 1, measure.name, f"{value:g}"]
            )
    return file.getvalue()
