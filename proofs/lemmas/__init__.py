"""Every lemma, from the leaves up."""

from lemmas import (
    compensation,
    force_loop,
    learned_lead,
    learning,
    plausibility,
    protection,
    tables,
    tick,
    velocity,
    windows,
)

LEMMAS = [
    lemma
    for room in (
        compensation,
        tables,
        force_loop,
        velocity,
        protection,
        plausibility,
        learning,
        learned_lead,
        tick,
        windows,
    )
    for lemma in room.LEMMAS
]
