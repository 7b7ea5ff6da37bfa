"""What a filter believes of people in a radio network: who may be there, where, and how surely."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from elusive.contracts import Array

Status = Literal["candidate", "confirmed"]
SHOWN = 0.5  # existence from which a person counts as there


class LinkPerson(NamedTuple):
    """Somebody who may be there."""

    track: int  # number, from 1
    status: Status
    existence: float  # probability that they are there
    position: tuple[float, float]  # mean given existence [m]
    velocity: tuple[float, float]  # mean given existence [m a frame]
    sd: tuple[float, float]  # deviation of the position, x and y [m]
    age: int  # frames since the first
    sure: int  # latest frames in a row with a high existence
    particles: Array  # (N, 4) x, vx, y, vy given existence, of equal weight


class LinkPeopleState(NamedTuple):
    """Belief after a frame."""

    time_s: float  # NaN before the first frame, where no time was given
    people: tuple[LinkPerson, ...]
    mean: Array  # (P, 4) of each person given existence
    covariance: Array  # (P, 4, 4)
    born: int  # people so far, those that came to nothing too

    @property
    def tracks(self) -> tuple[LinkPerson, ...]:
        """Those who are there more likely than not."""
        return tuple(person for person in self.people if person.existence >= SHOWN)


def summary_of(track: int, status: Status, existence: float, age: int, sure: int, particles: Array) -> LinkPerson:
    """Return a person with what their particles say of them."""
    x, vx, y, vy = particles.mean(axis=0)
    sd_x, _, sd_y, _ = particles.std(axis=0)
    return LinkPerson(track, status, existence, (x, y), (vx, vy), (sd_x, sd_y), age, sure, particles)


def state_of(time_s: float, people: list[LinkPerson], born: int) -> LinkPeopleState:
    """Return the belief in some people."""
    mean = np.array([person.particles.mean(axis=0) for person in people]).reshape(-1, 4)
    covariance = np.array([np.cov(person.particles.T, bias=True) for person in people]).reshape(-1, 4, 4)
    return LinkPeopleState(time_s, tuple(people), mean, covariance, born)


def posterior(prior: float, log_ratio: float) -> float:
    """Probability after evidence of a log likelihood ratio."""
    if prior in (0.0, 1.0):
        return prior
    log_odds = math.log(prior) - math.log1p(-prior) + log_ratio
    # beyond 700 the exponential leaves the range of numbers
    return 1 / (1 + math.exp(-log_odds)) if log_odds > -700 else 0.0
