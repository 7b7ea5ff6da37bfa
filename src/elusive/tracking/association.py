"""Which detections each of several targets made: marginal probabilities, exact in small clusters, else by messages.

Loopy belief propagation: Williams and Lau (2014), IEEE Trans. Aerosp. Electron. Syst. 50(4), 2942-2959; exact where the
pairs within reach of one another form no loop. Where they do it errs by .01 to .3, so that clusters of few detections
or few targets are summed over every association instead.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.tracking._detection_kernels import associate, associate_few, clusters

TOLERANCE = 1e-6  # of the messages' logarithms
MOST = 500  # rounds of messages
FEW = 8  # detections or targets of a cluster that is summed over every association


class Association(NamedTuple):
    """Marginal probabilities of what made what."""

    pairs: Array  # (E,) that each pair of target and detection belongs together
    missed: Array  # (T,) that each target made none of the detections
    unclaimed: Array  # (m,) that no target made each detection


def marginals(
    target: NDArray[np.int64], detection: NDArray[np.int64], log_odds: Array, targets: int, detections: int
) -> Association:
    """Return the marginal probabilities of association.

    Parameters
    ----------
    target, detection
        ``(E,)`` of each pair within reach, in the order of targets.
    log_odds
        ``(E,)`` logarithm of the weight that the target made the detection, over that it made none and the detection
        is of nothing that is known.
    targets, detections
        How many there are, T and m.
    """
    found = Association(*associate(target, detection, log_odds, targets, detections, TOLERANCE, MOST))
    of_targets, of_detections = clusters(target, detection, targets, detections)
    pairs_of = of_targets[target]
    members, heard = np.bincount(of_targets, minlength=targets), np.bincount(of_detections, minlength=targets)
    loops = np.bincount(pairs_of, minlength=targets) >= members + heard[: len(members)]
    for cluster in np.flatnonzero(loops).tolist():
        mine = np.flatnonzero(pairs_of == cluster)
        some, all_targets = np.unique(target[mine], return_inverse=True)
        others, all_detections = np.unique(detection[mine], return_inverse=True)
        if len(others) <= FEW:
            exact = associate_few(all_targets, all_detections, log_odds[mine], len(some), len(others))
            parts = exact[:3]
        elif len(some) <= FEW:  # the same sum, with what is paired changed about
            turned = np.argsort(all_detections, kind="stable")
            exact = associate_few(
                all_detections[turned], all_targets[turned], log_odds[mine][turned], len(others), len(some)
            )
            back = np.empty(len(mine))
            back[turned] = exact[0]
            parts = back, exact[2], exact[1]
        else:
            continue
        if exact[3]:
            found.pairs[mine], found.missed[some], found.unclaimed[others] = parts
    return found
