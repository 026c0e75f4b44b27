"""How alike pictures are."""

import numpy as np
from skimage.metrics import structural_similarity

MUCH = 64  # of 255


def compare(pairs, what, capsys):
    """Compares pairs of pictures, shape (height, width, 3) each, and prints what came out.

    Returns a number of each pair: the structural similarity; and the pixels of which a color
    differs much, for where most of a picture is background, a walker in another place would hardly
    tell in the former.
    """
    similarities, others = [], []
    for ours, theirs in pairs:
        similarities.append(structural_similarity(ours, theirs, channel_axis=2))
        difference = np.abs(ours.astype(int) - theirs).max(axis=2)
        others.append(np.count_nonzero(difference > MUCH))
    with capsys.disabled():
        print(
            f"\n{what}: structural similarity of {len(similarities)} pictures"
            f" {min(similarities):.4f} at least, {np.mean(similarities):.4f} on average;"
            f" {max(others)} of {difference.size} pixels differ at most"
        )
    return similarities, others
