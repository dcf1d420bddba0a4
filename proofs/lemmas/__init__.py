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
    )
    for lemma in room.LEMMAS
]
