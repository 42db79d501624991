"""Places of the texts beside a plot, so that they stand apart."""

LABEL_GAP = 15
"""Pixels from one name to the next, at least."""


def spread(wanted, gap, length):
    """Move places on a line apart: at least ``gap`` between neighbours, in the same order.

    ``wanted`` are pixels in ascending order. Neighbours that would touch become a block about the
    mean of what they want; blocks stay within ``[0, length]`` where they fit.
    """
    blocks = []
    for place in wanted:
        blocks.append([place])
        while len(blocks) > 1 and _top(blocks[-1], gap) < _top(blocks[-2], gap) + gap * len(
            blocks[-2]
        ):
            block = blocks.pop()
            blocks[-1] += block
    places = [_top(block, gap) + gap * i for block in blocks for i in range(len(block))]
    for i in reversed(range(len(places))):  # pushed up from the lower end, then down from the upper
        limit = places[i + 1] - gap if i + 1 < len(places) else length
        places[i] = min(places[i], limit)
    for i in range(len(places)):
        places[i] = max(places[i], places[i - 1] + gap if i else 0)
    return places


def _top(block, gap):
    return sum(block) / len(block) - gap * (len(block) - 1) / 2
