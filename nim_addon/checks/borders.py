# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the media that interfaces name agree wherever two of them border on the same room."""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..physics import Medium
from .bodies import BACK, FRONT, Patch
from .solids import Part
from .surroundings import Surroundings, same

HOLDING_POINTS = 48  # points of a patch that must lie in another before it is said that all of it does
OTHER = {FRONT: BACK, BACK: FRONT}


class Misfit(NamedTuple):
    """A Patch whose medium on one side is not that of what borders on the same room.

    relation: "lies", wholly within what `partner` has inside; "partly", partly so; "overlaps", both closed and partly
              so; "faces", outside as it is; "joins", the insides of both are one room; the last three name each pair once
    patch:    the one that is wrong, if one is
    partner:  the Patch that says otherwise
    own:      the Medium that the patch names
    medium:   the Medium that the partner names
    sure:     whether it is the patch that is wrong
    """

    relation: str
    patch: Patch
    partner: Patch
    own: Medium
    medium: Medium
    sure: bool


class Borders:
    """The sides that parts have, and the media that do not fit, in Surroundings."""

    def __init__(self, around: Surroundings):
        self.around = around
        self.patches = around.patches
        self._known = set(self.patches)
        self._by_part = {}
        for patch in self.patches:
            self._by_part.setdefault((patch.body, patch.part), []).append(patch)

    def part(self, key: tuple[int, int]) -> Part:
        """The solids.Part of a (body, part)."""
        return self.around.bodies[key[0]].solid.parts[key[1]]

    @cached_property
    def inverted(self) -> set[tuple[int, int]]:
        """The (body, part) that are closed and the wrong way round.

        That a part's faces point inwards is no fault by itself: the inner surface of a shell may be made so, with the
        same media as its outer one. What surrounds a part decides; where nothing does, faces point outwards.
        """
        closed = set() if self.around.blind else {key for key in self._by_part if self._is_closed(key)}
        out = {key: FRONT if self.part(key).volume > 0 else BACK for key in closed}
        lone = len(self.patches) < 2
        holders = {
            key: set() if lone else self.around.holders(self._by_part[key][0], out[key]) & closed - {key}
            for key in closed
        }
        found = set()
        for key in sorted(closed, key=lambda key: (len(holders[key]), key)):
            holder = max(holders[key], key=lambda other: len(holders[other]), default=None)
            kept, turned, unknown = (0, 0, 0) if lone else self._votes(key, out[key], closed - {holder}, found)
            inwards = out[key] == BACK and not unknown
            if turned > kept or (inwards and not kept):
                found.add(key)
        return found

    def _is_closed(self, key):
        part = self.part(key)
        return part.closed and part.agreeing and abs(part.volume) > 1e-7 * part.area**1.5

    def _votes(self, key, out, unsettled, found):
        """How much of what surrounds a part fits to it as it is, fits to it turned, and cannot be told."""
        kept = turned = unknown = 0
        for patch in self._by_part[key]:
            body = self.around.bodies[patch.body]
            own, inner = body.medium(patch, out), body.medium(patch, OTHER[out])
            for hit in (hit for hits in self.around.leaving(patch, out) for hit in hits if hit):
                other = self.around.patch_of(hit)
                if other not in self._known or other[:2] == key or other[:2] in unsettled:
                    continue
                there = self._medium(other, hit.side, found)
                if own is None or there is None:
                    unknown += 1
                elif same(own, there):
                    kept += 1
                elif same(inner, there):
                    turned += 1
        return kept, turned, unknown

    def _medium(self, patch, side, inverted):
        """The medium that a Patch has on that side, were it the right way round."""
        side = OTHER[side] if patch[:2] in inverted else side
        return self.around.bodies[patch.body].medium(patch, side)

    @cached_property
    def misfits(self) -> list[Misfit]:
        """What does not fit, for parts that are the right way round."""
        if len(self.patches) < 2:
            return []
        found, facing, pairs = [], {}, set()
        for patch in self.patches:
            own = self._medium(patch, FRONT, ())
            if own is None or not self._is_settled(patch):
                continue
            votes = self._around(patch, FRONT)
            misfit = self._lying(patch, own, votes)
            if misfit:
                pair = frozenset((patch[:2], misfit.partner[:2]))
                if misfit.sure or pair not in pairs:
                    found.append(misfit)
                pairs.add(pair)
            elif not any(backs for backs, _, _ in votes):
                partner = self._against(own, [fronts for _, fronts, _ in votes], 1)
                if partner:
                    facing[patch] = Misfit("faces", patch, partner[0], own, partner[1], True)
        for patch, misfit in facing.items():
            mutual = misfit.partner in facing
            if not mutual or patch < misfit.partner or facing[misfit.partner].partner != patch:
                found.append(misfit._replace(sure=self._is_backed(misfit.partner, misfit.medium)))
        return found + self._joined({(misfit.patch[:2], misfit.partner[:2]) for misfit in found})

    def _is_settled(self, patch):
        return self.part(patch[:2]).agreeing and patch[:2] not in self.inverted

    def _around(self, patch, side):
        """For each point of a patch: Counters of what rays meet from behind, and from the front, and how many are lost.

        The keys of both are (Patch, Medium).
        """
        found = []
        for hits in self.around.leaving(patch, side):
            backs, fronts = Counter(), Counter()
            for hit in (hit for hit in hits if hit):
                other = self.around.patch_of(hit)
                if other not in self._known or not self.part(other[:2]).agreeing:
                    continue
                seen = OTHER[hit.side] if other[:2] in self.inverted else hit.side
                medium = self._medium(other, hit.side, self.inverted)
                if medium:
                    (backs if seen == BACK else fronts)[other, medium] += 1
            found.append((backs, fronts, hits.count(None)))
        return found

    def _lying(self, patch, own, votes):
        """The Misfit of a patch that lies in what another has inside: that other one decides what is there."""
        bad, fits, lost = Counter(), False, False
        touching, *_ = self.around.touching(patch)
        for backs, _, away in votes:
            # which of two faces in the same place is met is chance
            backs = Counter({key: count for key, count in backs.items() if not touching[key[0].body]})
            wrong = Counter({key: count for key, count in backs.items() if not same(own, key[1])})
            if 2 * wrong.total() > backs.total():
                bad[wrong.most_common(1)[0][0]] += 1
            else:
                fits = fits or bool(backs)
                lost = lost or bool(away and not backs)
        if not bad:
            return None
        partner, medium = bad.most_common(1)[0][0]
        # one ray may have slipped through between two faces
        told = any(same(medium, there) for _, fronts, _ in votes for _, there in fronts)
        if bad.total() < 2 and len(votes) > 2 and not told and not self._is_within(patch, partner):
            return None
        if not self._can_hold(patch, partner):
            return None
        holder = self.part(partner[:2])
        if holder.is_sheet:
            # rays may leave it round its rim, but what is before it is not behind it
            lost = any(self.around.is_before(start, partner) for start in self._spread(patch))
        elif holder.closed:
            lost = not all(partner[:2] in self.around.within(start) for start in self._spread(patch))
        partly = fits or lost
        solid = self.part(patch[:2]).closed and holder.closed
        relation = ("overlaps" if solid else "partly") if partly else "lies"
        return Misfit(relation, patch, partner, own, medium, not partly)

    def _spread(self, patch):
        """Points all over a patch, just outside of it."""
        return self.around.starts(patch, FRONT, HOLDING_POINTS)[0]

    def _is_within(self, patch, partner):
        starts, _ = self.around.starts(patch, FRONT)
        return self.part(partner[:2]).closed and any(partner[:2] in self.around.within(start) for start in starts)

    def _can_hold(self, patch, partner):
        """Whether a Patch may be said to lie in another: within one mesh, holes and faces twice are said by themselves."""
        if patch.body != partner.body:
            return True
        holes = self.part(patch[:2]).holes or self.part(partner[:2]).holes
        return not holes and not self.around.bodies[patch.body].solid.doubled.any()

    def _is_backed(self, patch, medium):
        """Whether others name the medium outside a Patch as it does."""
        return any(
            same(medium, there) for backs, fronts, _ in self._around(patch, FRONT) for _, there in (*backs, *fronts)
        )

    def _against(self, own, votes, least=2):
        """The (Patch, Medium) that most of the points see where all that see anything see what is not `own`; or None."""
        seen = [counts for counts in votes if counts]
        wrong = sum(seen, Counter())
        if not seen or (len(seen) < least and len(votes) >= least) or any(same(own, medium) for _, medium in wrong):
            return None
        return wrong.most_common(1)[0][0]

    def _joined(self, known):
        """Of patches that have their insides in common, the smaller."""
        found = {}
        for patch in self.patches:
            own = self._medium(patch, BACK, ())
            if own is None or not self._is_settled(patch):
                continue
            against = self._against(own, [backs for backs, _, _ in self._around(patch, BACK)])
            if against is None or {(patch[:2], against[0][:2]), (against[0][:2], patch[:2])} & known:
                continue
            partner, medium = against
            pair = Misfit("joins", patch, partner, own, medium, True)
            if self._area(patch) > self._area(partner):
                pair = Misfit("joins", partner, patch, medium, own, True)
            found.setdefault(pair.patch, pair)
        return list(found.values())

    def _area(self, patch):
        body = self.around.bodies[patch.body]
        chosen = (body.solid.part == patch.part) & (body.slots() == patch.slot)
        return float(np.linalg.norm(body.solid.area[chosen], axis=1).sum())
