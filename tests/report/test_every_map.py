"""Every published map at hand reads, solves, is explained in seven sentences at most, and becomes a picture and a page."""

from __future__ import annotations

import pytest

import ratherthan as rt
from ratherthan.narrate import sentences

pytestmark = pytest.mark.slow
MAPS = {
    "ros/turtlebot3/map.yaml": {"start": "-2m,-0.5m", "goal": "2m,0.5m"},
    "ros/nav2/tb3_sandbox.yaml": {"start": "-2m,-0.5m", "goal": "2m,0.5m"},
    "ros/nav2/TenByTen.yaml": {"start": "2m,2m", "goal": "8m,8m"},
    "ros/nav2/depot.yaml": {"start": "3m,3m", "goal": "27m,12m"},
    "movingai/empty-8-8.map": {"start": "0,0", "goal": "7,7"},
    "movingai/maze-32-32-2.map": {"scen": "movingai/maze-32-32-2-random-1.scen", "row": 3},
    "movingai/random-32-32-20.map": {"scen": "movingai/random-32-32-20-random-1.scen", "row": 3},
    "movingai/room-64-64-8.map": {"scen": "movingai/room-64-64-8-random-1.scen", "row": 3},
    "movingai/warehouse-10-20-10-2-1.map": {"scen": "movingai/warehouse-10-20-10-2-1-random-1.scen", "row": 7},
    "movingai/Berlin_0_256.map": {"scen": "movingai/Berlin_0_256.map.scen", "row": 500},
    "movingai/den312d.map": {"scen": "movingai/den312d.map.scen", "row": 300},
    "movingai/maze512-8-1.map": {"scen": "movingai/maze512-8-1.map.scen", "row": 4000},
}
MOST = 7


def test_no_map_is_left_out(shared_data):
    found = {
        path.relative_to(shared_data / "maps").as_posix()
        for pattern in ("*.map", "*.yaml")
        for path in (shared_data / "maps").rglob(pattern)
    }
    assert found == set(MAPS)


@pytest.mark.parametrize("name", MAPS)
def test_a_map_becomes_a_page(shared_data, name):
    folder, options = shared_data / "maps", dict(MAPS[name])
    if "scen" in options:
        options["scen"] = str(folder / options["scen"])
    explanation = rt.explain(rt.solve(rt.read(str(folder / name), **options)), at_most=MOST)
    told = [one for one in sentences(explanation) if one.number is not None]
    assert explanation.route_outcome == "arrives"
    assert 1 <= len(told) <= MOST
    picture = rt.draw(explanation)
    assert len(picture.svg.encode()) < 1_000_000
    html = rt.report(explanation).html
    assert len(html.encode()) < 1_000_000
    for one in told:
        assert f'id="w-mark-{one.number}"' in html
        assert f"<p>{one.text}</p>" in html
    pytest.importorskip("resvg_py")
    assert picture.png().startswith(b"\x89PNG")
