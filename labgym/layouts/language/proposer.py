"""The proposer that asks a language model: the room first, then each piece of furniture that holds items."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from labgym.errors import ProposalError
from labgym.layouts.language.answers import room_form, surface_form
from labgym.layouts.language.grounding import Furnished, GroundedPiece, arranged, furnished
from labgym.layouts.language.material import (
    distance_facts,
    fixed_facts,
    floor_facts,
    furniture_facts,
    item_facts,
    needs_facts,
    piece_facts,
    protocol_facts,
)
from labgym.layouts.language.offer import Offer, offer_of
from labgym.layouts.model import Layout
from labgym.layouts.placement import Placement
from labgym.layouts.records import Provenance
from labgym.layouts.request import Request
from labgym.llm.client import LanguageModel
from labgym.llm.completion import QUOTED
from labgym.llm.errors import LanguageModelError
from labgym.llm.prompting import load_prompt
from labgym.llm.rounds import REPAIRS, UNUSABLE, ask_with_repairs

PROMPTS = Path(__file__).resolve().parent / "prompts"
SEEDS = 2**31
"""Number of random seeds that a server accepts."""


class LanguageProposer:
    """Proposes a layout with a language model: zones, furniture and the zone of each step, then the items.

    The result is what the model answered. It may violate any rule and lack required assets; what was left out is noted
    in its provenance.

    Args:
        model: the client; by default the one that the environment configures.
        repairs: maximum number of times an answer that does not have the required form is returned.
    """

    def __init__(self, model: LanguageModel | None = None, repairs: int = REPAIRS) -> None:
        self._model, self._repairs = model, repairs

    def propose(self, request: Request) -> Layout:
        """Return the layout that the model proposes, with the request's seed as random seed.

        Raises:
            ProposalError: the model gives no usable answer about the room, or declines.
            LanguageModelError: no model is configured or reachable.
            OptionError: floor, protocol or inventory are too long for a prompt.
        """
        if self._model is not None:
            return self._proposed(self._model, request)
        with LanguageModel.from_environment() as model:
            return self._proposed(model, request)

    def _proposed(self, model: LanguageModel, request: Request) -> Layout:
        offer = offer_of(request)
        room = self._room(model, request, offer)
        placements = [*(piece.placement for piece in room.pieces), *request.fixed]
        notes = list(room.notes)
        for piece in room.carriers:
            items, further = self._surface(model, request, offer, piece)
            placements += items
            notes += further
        options = {
            "model": model.config.model,
            "zones": room.zones,
            "steps": {str(number): zone for number, zone in room.steps.items()},
            "notes": notes,
        }
        return Layout(
            id=f"{request.protocol.id}-{request.floor.label}-{request.seed}"[:80],
            protocols=request.protocols,
            floor=request.floor,
            placements=tuple(placements),
            catalog=request.catalog,
            provenance=Provenance(generator="llm", seed=request.seed, options=options),
        )

    def _room(self, model: LanguageModel, request: Request, offer: Offer) -> Furnished:
        """Return the room level of a layout.

        Raises:
            ProposalError: no usable answer.
        """
        prompt = load_prompt(PROMPTS / "propose_room.md")
        question = prompt.fill(
            floor=floor_facts(request.floor),
            fixed=fixed_facts(request),
            furniture=furniture_facts(offer),
            required=needs_facts(offer),
            items=item_facts(offer.items, request.profile),
            protocol=protocol_facts(request.protocol),
            distances=distance_facts(request.profile),
        )
        form = room_form(offer, request.floor, len(request.protocol.steps))
        try:
            reply = ask_with_repairs(model, prompt.label, question, form, self._repairs, request.seed % SEEDS)
        except LanguageModelError as error:
            if error.reason not in UNUSABLE:
                raise
            raise _no_proposal(request, str(error)) from None
        answer: Any = reply.answer
        if answer.refusal.strip() and not answer.furniture:
            why = " ".join(answer.refusal.split())[: 2 * QUOTED]
            raise _no_proposal(request, f"the language model declines to plan the laboratory: {why!r}")
        return furnished(answer, offer, request)

    def _surface(
        self, model: LanguageModel, request: Request, offer: Offer, piece: GroundedPiece
    ) -> tuple[tuple[Placement, ...], tuple[str, ...]]:
        """Return the items of a piece of furniture and notes; no items if the model gives no usable answer."""
        items = {item: offer.items[item] for item in piece.holds}
        steps = [
            {"step": number, "action": step.action, "uses": list(step.uses)}
            for number, step in enumerate(request.protocol.steps, 1)
            if step.location == piece.asset.role
        ]
        prompt = load_prompt(PROMPTS / "propose_surface.md")
        question = prompt.fill(
            piece=piece_facts(piece.placement.id, piece.asset),
            items=item_facts(items, request.profile),
            steps=steps,
            distances=distance_facts(request.profile),
        )
        form = surface_form(piece.asset, items)
        try:
            reply = ask_with_repairs(model, prompt.label, question, form, self._repairs, request.seed % SEEDS)
        except LanguageModelError as error:
            if error.reason not in UNUSABLE:
                raise
            left = f"{len(items)} items are left out"
            return (), (f"the model gave no usable answer for {piece.placement.id} ({error.reason}): {left}",)
        return arranged(reply.answer, piece, offer)


def _no_proposal(request: Request, why: str) -> ProposalError:
    what = f"no layout of protocol {request.protocol.id!r} on floor {request.floor.name!r} was proposed"
    return ProposalError(what, [why], None, remedy="try another seed or model")
