"""SceneWeaver's tools: add, remove, resize, move, rotate and relate objects. Each makes a scene that physics settles.

Public repository Scene-Weaver/SceneWeaver, folder `Pipeline/app/tool`: add_gpt (add), add_crowd (crowd), add_acdc
(picture), remove_obj, update_size (resize), update_layout, update_rotation, add_relation. The catalog's sizes are true
ones, so an object is resized by exchange for another size of its model. Datasets of homes (init_metascene,
init_physcene) are left out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from string import digits

import numpy as np

from labgym.assets import Asset
from labgym.layouts.request import Request
from labgym.paper.rivals import household
from labgym.paper.rivals.chamber import Chamber
from labgym.paper.rivals.household import Choice, Top
from labgym.paper.rivals.piece import RivalPiece, named
from labgym.paper.rivals.plan import Constraint, Large
from labgym.paper.rivals.sceneweaver.critic import Critique, SceneProblem
from labgym.paper.rivals.sceneweaver.physics import wall_poses
from labgym.paper.rivals.sceneweaver.policy import WeaverAction
from labgym.paper.rivals.sceneweaver.scene import ROOM, RelationKind, WeaverItem, WeaverScene
from labgym.paper.rivals.spawning import MOST, spawn

BATCH = 5
"""Objects that a step of add adds at most, an assumption: a step of add_gpt adds a list of objects."""
Guide = Callable[[WeaverScene, RivalPiece], Sequence[Asset]]
"""Returns small objects for a piece of furniture, seen in a picture of the scene."""
_TABLE = {choice.asset: choice for choice in household.FLOOR}


@dataclass
class Toolbox:
    """The tools, with what they need: the space, the random numbers, the ids in use, and what looks at pictures."""

    request: Request
    chamber: Chamber
    generator: np.random.Generator
    counts: Counter[str]
    guide: Guide | None = None

    def act(self, scene: WeaverScene, action: WeaverAction, critique: Critique) -> WeaverScene:
        """Return the scene after a step, before physics."""
        problem = action.problem
        if action.tool == "add":
            return self._add(scene, problem, critique)
        if action.tool == "crowd":
            return self._crowd(scene, scene.by_id[problem.subject].piece)
        if action.tool == "picture":
            parent = scene.by_id[problem.subject].piece
            return self._stock(scene, parent, () if self.guide is None else self.guide(scene, parent))
        if action.tool == "remove":
            return scene.without([problem.subject or self._superfluous(scene)])
        if action.tool == "resize":
            return self._resize(scene, problem.subject or self._superfluous(scene), larger=problem.fault == "empty")
        if action.tool == "move":
            return self._move(scene, problem.subject)
        if action.tool == "rotate":
            return self._rotate(scene, problem.subject)
        return self._relate(scene, problem.subject)

    def initial(self, objects: Sequence[Large]) -> WeaverScene:
        """Return the first scene: objects at edges at random along the walls, the others around the middle."""
        scene = WeaverScene(())
        for one in objects:
            scene = scene.adding([self._placed(scene, one.asset, one.constraints)])
        return scene

    def _add(self, scene: WeaverScene, problem: SceneProblem, critique: Critique) -> WeaverScene:
        if problem.fault == "missing":
            names = [one.subject for one in critique.problems if one.fault == "missing"][:BATCH]
            for name in names:
                scene = self._provide(scene, self.request.catalog.get(name))
            return scene
        if problem.fault == "bare":
            parent = scene.by_id[problem.subject].piece
            return self._stock(scene, parent, self._tops(parent.asset))
        present = {piece.asset.name for piece in scene.pieces()}
        fresh = [choice for choice in household.FLOOR if choice.asset not in present]
        choices = fresh if fresh and problem.fault == "monotonous" else [*fresh, *household.FLOOR]
        for index in self.generator.permutation(len(choices))[: 1 + int(self.generator.integers(0, 3))].tolist():
            choice = choices[index]
            scene = scene.adding([self._placed(scene, self.request.catalog.get(choice.asset), _constraints(choice))])
        return scene

    def _provide(self, scene: WeaverScene, asset: Asset) -> WeaverScene:
        """Add an object that is missing, on or in furniture if it is a small one."""
        if asset.placing != "desktop":
            return scene.adding([self._placed(scene, asset, _constraints(_TABLE.get(asset.name)))])
        kind = household.BENCH
        if asset.kind == "reagent":
            stored = self.generator.random() < household.IN_CABINET
            kind = household.CABINET if stored else str(self.generator.choice(household.REAGENT_HOMES))
        parents = sorted(
            (item.piece for item in scene.large if item.piece.asset.surfaces),
            key=lambda piece: piece.asset.name != kind,
        )
        for parent in parents:
            stocked = self._stock(scene, parent, [asset])
            if stocked is not scene:
                return stocked
        return scene

    def _stock(self, scene: WeaverScene, parent: RivalPiece, assets: Sequence[Asset]) -> WeaverScene:
        """Add small objects to a piece, in its orientation: relation "on"."""
        pieces = spawn(parent, assets, self.generator, self.counts, scene.on(parent.id), upright=True)
        return scene.adding(WeaverItem(piece, "on", parent.id) for piece in pieces) if pieces else scene

    def _crowd(self, scene: WeaverScene, parent: RivalPiece) -> WeaverScene:
        """Fill a piece with small objects of its kinds, as many as it takes."""
        tops = self._tops(parent.asset) or self._tops(self.request.catalog.get(household.BENCH))
        return self._stock(scene, parent, tops * MOST)

    def _resize(self, scene: WeaverScene, subject: str, larger: bool) -> WeaverScene:
        """Exchange a large object for the next smaller or larger one of its model, with what stood on it on top.

        Names of sizes of a model differ in their number: LabBench1200, LabBench1800.
        """
        item = scene.by_id[subject]
        model = item.piece.asset.name.rstrip(digits)
        sizes = sorted(
            (asset for asset in self.request.catalog.roles if asset.name.rstrip(digits) == model),
            key=lambda asset: (asset.size.width, asset.name),
        )
        place = sizes.index(item.piece.asset) + (1 if larger else -1) if item.piece.asset in sizes else -1
        if not item.large or not 0 <= place < len(sizes):
            return scene
        piece = replace(item.piece, asset=sizes[place])
        tops = scene.on(subject)
        resized = WeaverScene(
            tuple(
                replace(one, piece=piece) if one.piece.id == subject else one
                for one in scene.without([top.id for top in tops]).items
            )
        )
        return self._stock(resized, piece, [top.asset for top in tops])

    def _tops(self, asset: Asset) -> list[Asset]:
        choice = _TABLE.get(asset.name)
        tops = choice.tops if choice is not None and choice.tops else household.BENCH_TOPS
        return [self.request.catalog.get(top.asset) for top in tops for _ in range(self._count(top))]

    def _count(self, top: Top) -> int:
        drawn = int(self.generator.integers(top.least, top.most + 1))
        return drawn if self.generator.random() < top.chance else 0

    def _placed(self, scene: WeaverScene, asset: Asset, constraints: Sequence[Constraint]) -> WeaverItem:
        """A large object at the pose that the designer writes down, with the relation of its kind."""
        relation, parent = self._relation(scene, constraints)
        ground = self.chamber.ground
        x, y = self.generator.uniform(0.3, 0.7, 2) * (ground.width, ground.depth)
        piece = RivalPiece(
            named(self.counts, asset), asset, float(x), float(y), math.pi * float(self.generator.integers(0, 2))
        )
        if relation == "against_wall":
            poses = list(wall_poses(piece, self.chamber))
            if poses:
                x, y, yaw = poses[int(self.generator.integers(len(poses)))]
                piece = replace(piece, x=x, y=y, yaw=yaw)
        elif parent in scene.by_id:
            piece = replace(
                piece, x=scene.by_id[parent].piece.x + float(self.generator.normal()), y=scene.by_id[parent].piece.y
            )
        return WeaverItem(piece, relation, parent)

    def _relation(self, scene: WeaverScene, constraints: Sequence[Constraint]) -> tuple[RelationKind | None, str]:
        """against_wall for what stands at the edge, front_against a bench for seats.

        A target is a kind of object or one that is numbered, such as LabBench-0.
        """
        if all(constraint.relation != "middle" for constraint in constraints):
            return "against_wall", ROOM
        targets = [one.target.partition("-")[0] for one in constraints if one.relation == "around"]
        parents = [item.piece.id for item in scene.large if item.piece.asset.name in targets]
        parents = parents or [item.piece.id for item in scene.large if item.piece.asset.subtype == "workbench"]
        if targets and parents:
            return "front_against", str(self.generator.choice(parents))
        return None, ""

    def _move(self, scene: WeaverScene, subject: str) -> WeaverScene:
        """Put an object at a random pose that its relation allows."""
        item = scene.by_id[subject]
        if not item.large:
            return scene
        poses = list(wall_poses(item.piece, self.chamber)) if item.relation == "against_wall" else []
        if poses:
            return scene.moved(subject, *poses[int(self.generator.integers(len(poses)))])
        ground = self.chamber.ground
        x, y = self.generator.uniform(0.15, 0.85, 2) * (ground.width, ground.depth)
        return scene.moved(subject, float(x), float(y), item.piece.yaw)

    def _rotate(self, scene: WeaverScene, subject: str) -> WeaverScene:
        """Turn an object by one to three quarter turns; relations that fix its orientation end."""
        item = scene.by_id[subject]
        turns = int(self.generator.integers(1, 4))
        turned = scene.moved(subject, item.piece.x, item.piece.y, item.piece.yaw + turns * math.pi / 2.0)
        return turned.related(subject, None, "")

    def _relate(self, scene: WeaverScene, subject: str) -> WeaverScene:
        """Relate an object: a seat to the nearest bench, anything else to the wall."""
        piece = scene.by_id[subject].piece
        if piece.asset.subtype != "seat":
            return scene.related(subject, "against_wall", ROOM)
        benches = [
            item.piece for item in scene.large if item.piece.asset.surfaces and item.piece.asset.category == "furniture"
        ]
        if not benches:
            return scene
        nearest = min(benches, key=lambda bench: (math.hypot(bench.x - piece.x, bench.y - piece.y), bench.id))
        return scene.related(subject, "front_against", nearest.id)

    def _superfluous(self, scene: WeaverScene) -> str:
        """A large object that nothing stands on, or any."""
        large = [item.piece for item in scene.large]
        idle = [piece for piece in large if not scene.on(piece.id)] or large
        return idle[int(self.generator.integers(len(idle)))].id


def _constraints(choice: Choice | None) -> tuple[Constraint, ...]:
    """The constraints of a kind in the table; none for other objects, which stand against a wall."""
    relations = () if choice is None else choice.relations
    return tuple(Constraint(relation, target) for relation, target in relations)
