"""Monte Carlo campaigns over any ``concurrent.futures.Executor``, into a zarr store, resumable.

The same configuration gives the same bytes from one process, from many, from a cluster, and from a run that was
killed and started again. Linear algebra that changes its last digit with the number of its own threads is the one
thing a trial must fix itself (``OMP_NUM_THREADS=1``), which a pool of processes runs faster with anyway.
"""

from elusive.campaign.config import CampaignConfig
from elusive.campaign.executors import make_executor
from elusive.campaign.loop import Progress, run_campaign
from elusive.campaign.scenario import Scenario, resolve
from elusive.campaign.store import open_campaign
from elusive.campaign.trials import TrialError

__all__ = [
    "CampaignConfig",
    "Progress",
    "Scenario",
    "TrialError",
    "make_executor",
    "open_campaign",
    "resolve",
    "run_campaign",
]
