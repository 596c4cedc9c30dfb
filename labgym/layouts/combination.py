"""Several protocols as one: what a laboratory needs in which all of them are carried out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from pydantic import ValidationError

from labgym.assets import Catalog
from labgym.errors import OptionError
from labgym.protocols import Protocol

MOST = 5
"""Most protocols of one laboratory."""


def combination(protocols: Sequence[Protocol], catalog: Catalog) -> Protocol:
    """Return a protocol whose laboratory serves several protocols.

    Reagents and equipment are shared: each occurs as often as the protocol needs it that needs it most often. Steps
    follow one another, and the constraints of all hold.

    Raises:
        OptionError: no protocol, too many, one named twice, or more steps or reagents than a protocol can have.
    """
    if not 1 <= len(protocols) <= MOST:
        raise OptionError(f"{len(protocols)} protocols: a laboratory is for 1 to {MOST}")
    ids = [protocol.id for protocol in protocols]
    twice = next((name for name in ids if ids.count(name) > 1), None)
    if twice is not None:
        raise OptionError(f"protocol {twice!r} is named twice; name each once")
    if len(protocols) == 1:
        return protocols[0]
    reagents = {catalog.find(use.name).name: use for protocol in reversed(protocols) for use in protocol.reagents}
    instruments: Counter[str] = Counter()
    for protocol in protocols:
        instruments |= Counter(catalog.find(name).name for name in protocol.instruments)
    steps = [step for protocol in protocols for step in protocol.steps]
    try:
        return Protocol(
            id="-".join(ids)[:64].rstrip("-_"),
            name="; ".join(protocol.name for protocol in protocols),
            reaction_type=protocols[0].reaction_type,
            reagents=tuple(reagents[name] for name in sorted(reagents)),
            instruments=tuple(sorted(instruments.elements())),
            steps=tuple(step.model_copy(update={"index": number}) for number, step in enumerate(steps, 1)),
            chemical_constraints=tuple(dict.fromkeys(c for p in protocols for c in p.chemical_constraints)),
            spatial_constraints=tuple(dict.fromkeys(c for p in protocols for c in p.spatial_constraints)),
        )
    except ValidationError as error:
        problem = error.errors()[0]
        raise OptionError(
            f"protocols {', '.join(ids)} need too much for one laboratory: {problem['loc'][0]}: {problem['msg']}; name "
            "fewer protocols"
        ) from None
