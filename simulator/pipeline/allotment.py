"""Divides the tolerance of a photograph among the approximations of its light."""

from collections.abc import Callable
from dataclasses import replace

from simulator.optics.defocus.accuracy import MOST_SHARP_PX
from simulator.optics.error_term import together
from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.error_budget import ROUNDING, ErrorBudget, error_budget

TRIES = 5  # tighter plans that are looked at: numbers of samples have a least one, which a first share may leave
MARGIN = 0.9  # of what is left for the terms that fall, since numbers of samples grow in steps
TIGHTEST = 0.02  # smallest tolerance of one approximation, in that of the photograph
STEP = 0.3  # factor to the next share where less than the smallest is asked for: what was left out may be computed from it on
LOOSER = 3.0, 9.0  # times a tolerance that no plan keeps, of those that are looked at, too
RESTING = 0.9, 2.7, 8.1  # tolerances of others, which may leave out a short motion
FAR_LESS = 0.01  # of what a plan leaves that has no law for a part of it: no such part is as large as what lamps leave
BESIDE = 0.1  # share of what does not fall that may be left by instants at which the optics run, and by zones of one pupil
BESIDE_FIXED = 0.3  # share of what does not fall below which nothing need fall


Make = Callable[[float], OpticsPlan]
Budget = Callable[[OpticsPlan], ErrorBudget]


def allot(tolerance: float, make: Make, budget_of: Budget = error_budget, make_sharp: Make | None = None) -> OpticsPlan:
    """Return the plan whose approximations together keep a tolerance, where there is one.

    make: plans the optics with each approximation at a tolerance. budget_of: gives what a plan leaves.
    make_sharp: plans them so with blur left out, as a larger tolerance does where circles are small; None: nothing does. What
    follows a blur may leave more than the blur does: that plan is returned where none keeps the tolerance and it leaves least,
    with what a blur takes of a background that the scene does not hold. So is one that moves surfaces as wholes, as a larger
    tolerance does, where points of aperture and time that carry each place by its own distance leave more.
    The first plan has the whole tolerance for each. Where they leave more together, those that can be finer get a smaller share
    in proportion. Where no share is small enough, because a term does not fall, those that fall are at most the tolerance, as
    they are for a tolerance that is met, or a share of what does not fall. Where they cannot, or where a finer plan leaves
    more, as one that computes small blur circles which the first one leaves out, the first plan is returned; or one of a larger
    tolerance that leaves less, since it leaves out, of some surfaces, what would be computed with a larger error.
    """
    first = make(tolerance)
    if not tolerance or not budget_of(first).is_clamped:
        return first

    def beside(fixed: float) -> float:
        return max(tolerance, BESIDE_FIXED * fixed)

    kept = _make_finer(first, tolerance, make, budget_of, lambda fixed: tolerance - fixed)
    if kept is not None:
        return kept
    finer = _make_finer(first, tolerance, make, lambda optics: _typical(budget_of(optics)), beside)
    plans = [first] if finer is None else [finer, first]
    if make_sharp is not None and may_be_sharp(first):
        plans.append(make_sharp(tolerance))
    return _looser(min(plans, key=lambda one: budget_of(one).total_sigma), tolerance, make, budget_of, make_sharp)


def with_few_instants(best: OpticsPlan, make: Callable[..., OpticsPlan], budget_of: Budget = error_budget) -> OpticsPlan:
    """Return the plan with as few instants at which the optics run as err by a share of what does not fall.

    Each costs an image. make: plans the optics with each approximation at a tolerance; takes `beside_sigma` of `with_motion`.
    """
    beside = BESIDE * _fixed_sigma(budget_of(best))
    runs = any(motion.method == "instants" for motion in (best.motion, best.flash_motion) if motion is not None)
    if not best.accuracy.tolerance or not runs or beside <= best.tolerance:
        return best
    fewer = make(best.accuracy.tolerance, is_sharp=best.defocus is None, beside_sigma=beside)
    return replace(fewer, tolerance=best.tolerance)


def with_wide_zones(best: OpticsPlan, budget_of: Budget = error_budget) -> OpticsPlan:
    """Return the plan of a scene at rest whose zones of one pupil are as wide as a share of what does not fall lets them be.

    Each of their corners has images of the aperture of its own, which are made one by one.
    """
    defocus, beside = best.defocus, BESIDE * _fixed_sigma(budget_of(best))
    if defocus is None or not best.accuracy.tolerance or not is_at_rest(best) or beside <= best.tolerance:
        return best
    return replace(best, defocus=defocus.with_zones(beside * best.accuracy.sigma))


def _fixed_sigma(budget: ErrorBudget) -> float:
    """Return what the terms that do not fall leave together, but for bounds that few scenes reach [standard deviations]."""
    return together(term.sigma for term in budget.terms if term.limit == "method" and not (term.falls or term.is_rare))


def _looser(best: OpticsPlan, tolerance: float, make: Make, budget_of: Budget, make_sharp: Make | None) -> OpticsPlan:
    """Return the plan of a larger tolerance that leaves less than the best one, also without bounds that few scenes reach.

    A short motion is left out at the same tolerances, whatever is asked: so a smaller one looks at all that a larger one does.
    Of a scene that moves it must leave far less, as beside lamps, unless it moves one surface as a whole, or leaves out the
    motion, too: what a blur that is left out leaves of edges that move apart has no law.
    """
    if not (_may_move_whole(best) or _may_leave_out(best) or _may_rest(best) or _may_have_distances(best)):
        return best
    moves_whole = _may_move_whole(best)
    tolerances = [factor * tolerance for factor in LOOSER]
    tolerances += [one for one in RESTING if one > tolerances[-1]] if _may_rest(best) else []
    for larger in tolerances:
        looser = [make(larger)]
        if make_sharp is not None and moves_whole and may_be_sharp(looser[0]):
            looser.append(make_sharp(larger))
        for one in looser:
            share = 1.0 if is_at_rest(one) or (moves_whole and _moves_as_one(one)) else FAR_LESS
            found, left = budget_of(replace(one, tolerance=tolerance)), budget_of(best)
            pairs = [(found, left), (_typical(found), _typical(left))]
            if all(less.predicted_sigma < share * more.predicted_sigma for less, more in pairs):
                best = replace(one, tolerance=tolerance)
    return best


def _may_move_whole(best: OpticsPlan) -> bool:
    """Whether points carry each place of one surface by its own distance, which a larger tolerance moves as a whole."""
    motions = [motion for motion in (best.motion, best.flash_motion) if motion is not None]
    return best.joint is not None and all(len(motion.path.motion.surfaces) == 1 for motion in motions)


def _may_leave_out(best: OpticsPlan) -> bool:
    """Whether a larger tolerance may leave out the blur of a surface, by which the plan may be far from what is asked."""
    defocus = best.defocus
    if defocus is None or defocus.maps or not (is_at_rest(best) or best.accuracy.has_lamps):
        return False
    return min(most for _, most in defocus.ranges_px) <= MOST_SHARP_PX


def _may_rest(best: OpticsPlan) -> bool:
    """Whether a larger tolerance may leave out all motion, which is short."""
    motions = [motion for motion in (best.motion, best.flash_motion) if motion is not None]
    return bool(motions) and all(motion.length.longest_px <= MOST_SHARP_PX for motion in motions)


def _may_have_distances(best: OpticsPlan) -> bool:
    """Whether layers behind one kernel, corrected to wave optics, may have kernels by distance for a larger tolerance."""
    return is_at_rest(best) and best.psf is not None and bool(best.psf.corrected_px) and len(best.scene.layers) > 1


def _moves_as_one(optics: OpticsPlan) -> bool:
    """Whether all of the image moves alike, if it does: it is the mean of images at rest then, and so is what is left out."""
    return all(motion.moves_alike for motion in (optics.motion, optics.flash_motion) if motion is not None)


def may_be_sharp(optics: OpticsPlan) -> bool:
    """Whether a plan blurs a scene that rests or moves as one by circles that a larger tolerance may leave out."""
    return _moves_as_one(optics) and optics.defocus is not None and optics.defocus.largest_px <= MOST_SHARP_PX


def is_at_rest(optics: OpticsPlan) -> bool:
    """Whether nothing moves."""
    return optics.motion is None and optics.flash_motion is None


def _make_finer(
    first: OpticsPlan, tolerance: float, make: Make, budget_of: Budget, left: Callable[[float], float]
) -> OpticsPlan | None:
    """Return a plan whose falling terms have at most what is `left` of them, by what the others add; None: there is none."""
    planned, own, tightest = first, tolerance, TIGHTEST * tolerance
    for tries in range(TRIES + 1):
        budget = budget_of(planned)
        falling = falling_sigma(budget)
        wanted = left(budget.predicted_sigma - falling)
        if falling <= ROUNDING * wanted:
            return planned
        share = own * MARGIN * max(wanted, 0.0) / falling if falling else 0.0
        own = max(STEP * own, tightest) if 0.0 < share < tightest < own else share
        if tries == TRIES or own < tightest:
            break
        planned = replace(make(own), tolerance=tolerance)
    return None


def _typical(budget: ErrorBudget) -> ErrorBudget:
    """Return the budget without bounds that few scenes reach: what falls is as large a part of the error in the others."""
    return replace(budget, terms=tuple(term for term in budget.terms if not term.is_rare))


def falling_sigma(budget: ErrorBudget) -> float:
    """Return what the terms that a smaller tolerance makes smaller leave together [standard deviations of the noise]."""
    return together(term.sigma for term in budget.terms if term.limit == "method" and term.falls)
