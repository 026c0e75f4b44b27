"""Images against those of the installed Gymnasium in the same states."""

import pytest
from bipedal_walker_reference import IDS, draw_episode
from picture_comparison import compare
from walkers import make_ours

# Kind of the actions, seed, steps. They cover every kind of terrain, falls to both sides, the flag
# and the end of the terrain.
STATES = {
    IDS[0]: (
        ("heuristic", 6, (0, 3, 9, 14, 60, 150, 300, 500, 700, 900, 1100, 1300, 1450, 1500, 1544)),
        ("noisy", 14, (40, 70, 83)),
        ("saturated", 19, (5, 400)),
    ),
    IDS[1]: (
        ("heuristic", 4, (0, 5, 100, 200, 320, 450, 610)),
        ("heuristic", 0, (100, 250, 373)),
        ("heuristic", 5, (12, 210, 417)),
        ("heuristic", 13, (200, 354)),
        ("noisy", 5, (120, 238)),
        ("saturated", 9, (82,)),
        ("random", 16, (90,)),
        ("heuristic", 6, (1000,)),
    ),
}


def pairs(environment_id):
    """Yields our image and Gymnasium's for each of STATES."""
    ours = make_ours(environment_id, render_mode="rgb_array")
    for kind, seed, steps in STATES[environment_id]:
        ours.reset(seed=seed)
        for step, (action, theirs) in enumerate(draw_episode(environment_id, kind, seed)):
            if action is not None:
                ours.step(action)
            if step in steps:
                yield ours.render(), theirs
            if step == max(steps):
                break


@pytest.mark.parametrize("environment_id", IDS)
def test_pictures_are_gymnasiums(environment_id, capsys):
    similarities, others = compare(pairs(environment_id), environment_id, capsys)
    assert len(similarities) == 20
    assert min(similarities) > 0.998
    assert max(others) < 80
