"""Similarity of pictures."""

import numpy as np
from skimage.metrics import structural_similarity

MAX_DIFFERENCE = 64  # of 255


def compare(pairs, what, capsys):
    """Returns two numbers per pair of pictures, shape (height, width, 3): structural similarity,
    and the number of pixels with a channel that differs by more than MAX_DIFFERENCE. A displaced
    walker barely changes the similarity if most of a picture is background."""
    similarities, others = [], []
    for ours, theirs in pairs:
        similarities.append(structural_similarity(ours, theirs, channel_axis=2))
        difference = np.abs(ours.astype(int) - theirs).max(axis=2)
        others.append(np.count_nonzero(difference > MAX_DIFFERENCE))
    with capsys.disabled():
        print(
            f"\n{what}: structural similarity of {len(similarities)} pictures"
            f" {min(similarities):.4f} at least, {np.mean(similarities):.4f} on average;"
            f" {max(others)} of {difference.size} pixels differ at most"
        )
    return similarities, others
